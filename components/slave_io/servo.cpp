#include "components/slave_io/servo.hpp"

#include "common/runtime/process/process.hpp"

namespace phantom::slave_io {

Servo::Servo(const ArmModel& model, const Config& config, ArmDriver& arm, Inbox& inbox, std::uint64_t seed,
             teleop::StopStore& stops, GripperDriver* gripper, WristInput* wrist)
    : enabling(config.enabling_switch),
      joint_count_(static_cast<std::uint32_t>(model.arm.joint_count())),
      inbox_(inbox),
      period_s_(config.period_s),
      controller_(model.arm, config, model.home, teleop::StopLatch(seed, stops.read())),
      arm_(arm),
      wrist_(wrist),
      loop_guard_(config.loop),
      stops_(inbox.stops, stops) {
  if (gripper != nullptr) gripper_.emplace(config.gripper.value().limits, *gripper, inbox.gripper);
  inbox_.counterbalance.begin(config.plant.balanced, config.gravity_feed_forward);
}

void Servo::tick(double dt_s, core::Nanoseconds now_ns) noexcept {
  SlaveReport report;
  inbox_.master.read(inputs_.master);
  if (inbox_.payload.read(payload_)) arm_.carry(payload_);
  if (inbox_.places.read(places_)) controller_.place_objects(places_);
  teleop::age_partner(inputs_, inputs_.master, now_ns);
  // An arm whose time is the loop's waits for it.
  if (!arm_.makes_up_periods()) inputs_.loop = loop_guard_.tick(now_ns);
  report.stop_requests = stops_.begin(inputs_, runtime::emergency_stop_signals());
  const auto steps = teleop::steps_of_tick(dt_s, period_s_, arm_.makes_up_periods());
  bool known = false;
  for (int k = 0; k < steps.count; ++k) {
    if (gripper_) gripper_->sense();
    const ArmSense& sense = arm_.sense();
    inputs_.position = sense.position;
    inputs_.velocity = sense.velocity;
    inputs_.gravity_Nm = sense.gravity_Nm;
    inputs_.force_measured = force_measured_;
    inputs_.external_Nm = external_Nm_;
    inputs_.contact = contact_;
    inputs_.contact_force_N = contact_force_N_;
    inputs_.contact_object = contact_object_;
    inputs_.counterbalance = inbox_.counterbalance.on();
    inputs_.drives_operational = sense.follows;
    inputs_.drive_fault = sense.fault;
    inputs_.enabling = enabling.step(sense.inputs, now_ns, steps.step_s);
    known = sense.known;
    report.outputs = controller_.step(inputs_, steps.step_s);
    const bool released = stops_.end(inputs_, report.outputs);
    const bool stopped = report.outputs.stop.id != 0;
    using Homing = HomingRequest::State;
    // The gripper's drive is homed as the arm's are, and with them.
    const bool whole = sense.homing == Homing::kNotNeeded && gripper_;
    const Homing homing = whole ? gripper_->homing() : sense.homing;
    const bool possible = homing == Homing::kPossible;
    // Homing moves the arm, too.
    const bool withheld = !teleop::permits(inputs_.enabling) || report.outputs.peer_motion_inhibited;
    inbox_.homing.report(possible && stopped    ? Homing::kStopped
                         : possible && withheld ? Homing::kWithheld
                                                : homing);
    const bool home = inbox_.homing.take() && possible && !stopped && !withheld;
    const bool ends = stopped || (withheld && sense.homing == Homing::kRuns);
    arm_.move({report.outputs, ends, released, home}, steps.step_s, now_ns);
    if (gripper_) {
      const bool holds = withheld && homing == Homing::kRuns;
      gripper_->step(holds ? teleop::LinkState::kStopped : report.outputs.state, home, steps.step_s, now_ns);
    }
  }
  if (gripper_) report.gripper = gripper_->state();
  if (!known) return;
  report.state = report.outputs.state;
  report.stop = report.outputs.stop;
  report.switch_fitted = report.outputs.enabling != teleop::SwitchState::kNotFitted;
  report.motion_permitted = teleop::permits(report.outputs.enabling);
  report.master_echo = inputs_.master.stamp;
  report.joint_count = joint_count_;
  report.loop_torque_Nm = report.outputs.torque.loop_Nm;
  report.counterbalance = report.outputs.counterbalance;
  arm_.fill(report);
  if (wrist_ != nullptr) wrist_->step(report, dt_s, now_ns);
  force_measured_ = report.force_measured;
  external_Nm_ = report.external_torque_Nm;
  contact_ = report.contact;
  contact_force_N_ = report.contact_force_N;
  contact_object_ = report.contact_object;
  outbox.write(report);
  published.raise();
}

}  // namespace phantom::slave_io
