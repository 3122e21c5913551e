#include "components/slave_io/servo.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::slave_io {

Servo::Servo(const ArmModel& model, const Config& config, const teleop::ContactWorld& world, Inbox& inbox)
    : inbox_(inbox),
      period_s_(config.period_s),
      force_sensor_(config.force_sensor),
      controller_(model.arm, config, model.home),
      plant_(model.arm, config.plant,
             contact_points(model, config.contact.point_pitch_m, config.contact.max_points), world,
             model.home, model.tip_in_last_link_m) {}

void Servo::tick(double dt_s, core::Nanoseconds now_ns) noexcept {
  inbox_.master.read(inputs_.master);
  inbox_.requests.read(inputs_.requests);
  if (inputs_.master.received_ns != 0)
    inputs_.master_age_s = core::seconds(now_ns - inputs_.master.received_ns);
  inputs_.master_round_trip_s =
      inputs_.master.answers_ns != 0 ? core::seconds(now_ns - inputs_.master.answers_ns) : 0.0;
  SlaveReport report;
  const int periods = std::clamp(static_cast<int>(std::lround(dt_s / period_s_)), 1, kMostMadeUp);
  for (int k = 0; k < periods; ++k) {
    inputs_.position = plant_.position();
    inputs_.velocity = plant_.velocity();
    inputs_.gravity_Nm = plant_.gravity_Nm();
    report.outputs = controller_.step(inputs_, period_s_);
    plant_.step(report.outputs.torque.drive_Nm, period_s_);
    contacts_.step(plant_.contact(), plant_.tool_speed_m_s(), period_s_);
  }
  report.followed = inputs_.master.stamp;
  report.position = plant_.position();
  report.velocity = plant_.velocity();
  const teleop::ContactReport& touch = plant_.contact();
  report.force_measured = force_sensor_;
  if (force_sensor_) report.external_torque_Nm = touch.joint_torque_Nm;
  report.contact = touch.contact;
  report.contact_force_N = touch.force_N;
  report.contact_object = touch.object;
  report.contact_point_W_m = {touch.point_W_m.x(), touch.point_W_m.y(), touch.point_W_m.z()};
  report.clearance_m = touch.clearance_m;
  report.tool_speed_m_s = plant_.tool_speed_m_s();
  outbox.write(report);
  published.raise();
}

}  // namespace phantom::slave_io
