#include "components/slave_io/servo.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::slave_io {

Servo::Servo(const ArmModel& model, const Config& config, ArmDriver& arm, Inbox& inbox)
    : inbox_(inbox), period_s_(config.period_s), controller_(model.arm, config, model.home), arm_(arm) {}

void Servo::tick(double dt_s, core::Nanoseconds now_ns) noexcept {
  inbox_.master.read(inputs_.master);
  inbox_.requests.read(inputs_.requests);
  if (inputs_.master.received_ns != 0)
    inputs_.master_age_s = core::seconds(now_ns - inputs_.master.received_ns);
  inputs_.master_round_trip_s =
      inputs_.master.answers_ns != 0 ? core::seconds(now_ns - inputs_.master.answers_ns) : 0.0;
  SlaveReport report;
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
    const bool reset = inputs_.requests.resets != resets_seen_;
    resets_seen_ = inputs_.requests.resets;
    arm_.move({report.outputs, inputs_.requests.pending(), reset}, step_s, now_ns);
  }
  if (!known) return;
  report.followed = inputs_.master.stamp;
  arm_.fill(report);
  outbox.write(report);
  published.raise();
}

}  // namespace phantom::slave_io
