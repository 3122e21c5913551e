#include "components/slave_io/gripper.hpp"

#include "common/core/text.hpp"

namespace phantom::slave_io {

using teleop::LinkState;

core::Status GripperRequests::refusal() const {
  const auto refused = [](const char* why) {
    return core::Status::invalid_argument(std::string("gripper: ") + why);
  };
  if (!limits_) return refused("the arm has none");
  switch (state_.load(std::memory_order_acquire)) {
    case State::kNotYet:
      return refused("its drive is not ready yet; allowed: once it follows");
    case State::kStopped:
      return refused("the arm is stopped; allowed: after a reset");
    case State::kReady:
      break;
  }
  return core::Status::ok();
}

core::Status GripperRequests::ask_width(double width_m) {
  if (core::Status status = refusal(); !status) return status;
  last_.width_m = width_m;
  ++last_.width_number;
  newest_.write(last_);
  return core::Status::ok();
}

core::Status GripperRequests::ask_force(double force_N) {
  if (core::Status status = refusal(); !status) return status;
  if (!(force_N >= limits_->least_force_N && force_N <= limits_->greatest_force_N)) {
    return core::Status::invalid_argument(core::formatted("gripper: force is %g; allowed: %g to %g N",
                                                          force_N, limits_->least_force_N,
                                                          limits_->greatest_force_N));
  }
  last_.force_N = force_N;
  ++last_.force_number;
  newest_.write(last_);
  return core::Status::ok();
}

void Gripper::step(LinkState link, bool home, double dt_s, core::Nanoseconds now_ns) noexcept {
  const bool stopped = link == LinkState::kStopped;
  requests_.report(stopped                          ? GripperRequests::State::kStopped
                   : sense_.follows || sense_.fault ? GripperRequests::State::kReady
                                                    : GripperRequests::State::kNotYet);
  requests_.read(request_);
  const bool asked = request_.width_number != width_number_;
  width_number_ = request_.width_number;
  const teleop::GripperDemand demand = control_.step(sense_, request_, dt_s);
  const bool unattended = stopped || link == LinkState::kDegraded;
  // While a stop is in force a request that overtook it is ended, too.
  if (stopped || (unattended && !unattended_)) control_.halt();
  unattended_ = unattended;
  powered_ = powered_ || !stopped;
  driver_.move({demand, powered_, stopped, asked && sense_.fault, home}, dt_s, now_ns);
}

messages::GripperState Gripper::state() const noexcept {
  messages::GripperState state;
  static_cast<teleop::GripperStatus&>(state) = control_.status();
  state.widest_m = limits_.widest_m;
  state.least_force_N = limits_.least_force_N;
  state.greatest_force_N = limits_.greatest_force_N;
  return state;
}

core::Health with_gripper(core::Health health, const core::ActuatorHealth& gripper,
                          const messages::GripperState& state) {
  health.figures.push_back({"gripper_width", state.sense.width_m, "m"});
  health.figures.push_back({"gripper_force", state.sense.force_N, "N"});
  if (gripper.message.empty() || !health.message.empty()) return health;
  health.message = "gripper: " + gripper.message;
  using core::ComponentState;
  if (health.state == ComponentState::kReady || health.state == ComponentState::kRunning)
    health.state = ComponentState::kDegraded;
  return health;
}

}  // namespace phantom::slave_io
