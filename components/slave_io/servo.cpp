#include "components/slave_io/servo.hpp"

#include <algorithm>
#include <cmath>

#include "common/runtime/process.hpp"

namespace phantom::slave_io {

Servo::Servo(const ArmModel& model, const Config& config, ArmDriver& arm, Inbox& inbox, std::uint64_t seed,
             teleop::StopStore& stops)
    : joint_count_(static_cast<std::uint32_t>(model.arm.joint_count())),
      inbox_(inbox),
      period_s_(config.period_s),
      controller_(model.arm, config, model.home, teleop::StopLatch(seed, stops.read())),
      arm_(arm),
      stops_(stops),
      kept_(stops.read()) {}

void Servo::tick(double dt_s, core::Nanoseconds now_ns) noexcept {
  SlaveReport report;
  inbox_.master.read(inputs_.master);
  report.stop_requests = inbox_.stops.stops();
  inputs_.stop_requests = report.stop_requests + runtime::emergency_stop_signals();
  core::StopRequests::Reset reset;
  if (inbox_.stops.take(reset)) inputs_.reset = &reset.names;
  if (inputs_.master.received_ns != 0)
    inputs_.master_age_s = core::seconds(now_ns - inputs_.master.received_ns);
  inputs_.master_round_trip_s =
      inputs_.master.answers_ns != 0 ? core::seconds(now_ns - inputs_.master.answers_ns) : 0.0;
  const int missed = static_cast<int>(std::clamp(std::round(dt_s / period_s_), 1.0, double{kMostMadeUp}));
  const int steps = arm_.makes_up_periods() ? missed : 1;
  const double step_s = period_s_ * missed / steps;
  bool known = false;
  for (int k = 0; k < steps; ++k) {
    const ArmSense& sense = arm_.sense();
    inputs_.position = sense.position;
    inputs_.velocity = sense.velocity;
    inputs_.gravity_Nm = sense.gravity_Nm;
    inputs_.drives_follow = sense.follows;
    inputs_.drive_fault = sense.fault;
    known = sense.known;
    report.outputs = controller_.step(inputs_, step_s);
    // The stop is kept before anything acts on it.
    if (report.outputs.stop != kept_) stops_.write(kept_ = report.outputs.stop);
    const bool released = report.outputs.reset == teleop::ResetOutcome::kReleased;
    if (inputs_.reset != nullptr) inbox_.stops.give_result({reset.number, released});
    inputs_.reset = nullptr;
    arm_.move({report.outputs, report.outputs.stop.id != 0, released}, step_s, now_ns);
  }
  if (!known) return;
  report.state = report.outputs.state;
  report.stop = report.outputs.stop;
  report.master_echo = inputs_.master.stamp;
  report.joint_count = joint_count_;
  report.loop_torque_Nm = report.outputs.torque.loop_Nm;
  arm_.fill(report);
  outbox.write(report);
  published.raise();
}

}  // namespace phantom::slave_io
