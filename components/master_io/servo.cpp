#include "components/master_io/servo.hpp"

#include "common/runtime/process/process.hpp"
#include "components/master_io/gains.hpp"

namespace phantom::master_io {

namespace {
constexpr core::Nanoseconds kViewStale_ns = core::kNsPerSecond;  // it comes at 10 Hz

// Takes what acts on joints that the master does not have out of the inputs: nobody can feel it.
void keep_led(const teleop::JointMapping& mapping, std::size_t joint_count, MasterInputs& in) noexcept {
  for (core::JointArray* values :
       {&in.slave.loop_torque_Nm, &in.slave.external_torque_Nm, &in.drag.drag.plus, &in.drag.drag.minus,
        &in.drag.drag.drift, &in.drag.reaction.torque, &in.drag.reaction.stiffness})
    mapping.keep_led(*values);
  for (std::size_t i = 0; i < joint_count; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      if (!mapping.leads(i) || !mapping.leads(j)) in.drag.drag.coupled[i * (i + 1) / 2 + j] = 0.0;
    }
  }
}

}  // namespace

Servo::Servo(const Config& config, const core::JointArray& home, Device& device, Inbox& inbox,
             std::uint64_t seed, teleop::StopStore& stops)
    : enabling(config.enabling_switch),
      joint_count_(static_cast<std::uint32_t>(config.device.joint_count)),
      inbox_(inbox),
      period_s_(config.period_s),
      staleness_s_(config.link.staleness_s),
      controller_(config, teleop::StopLatch(seed, stops.read())),
      device_(device),
      loop_guard_(config.loop),
      driver_(config.driver),
      held_by_person_(is_held_by_person(config)),
      desk_leads_(uses_desk(config)),
      scripted_(is_scripted(config)),
      stops_(inbox.stops, stops),
      desk_hand_(config.desk, config.hand.joint_count),
      hand_(config.hand, config.driver == Driver::kCartesian ? config.hand_start : home),
      script_(config.script, hand_) {
  inputs_.settings = initial_settings(config);
  if (config.mapping) mapping_.emplace(config.mapping->mapping);
}

void Servo::read_inbox(core::Nanoseconds now_ns) noexcept {
  inbox_.slave.read(inputs_.slave);
  drag_is_new_ = inbox_.drag.read(inputs_.drag);
  if (mapping_) keep_led(*mapping_, joint_count_, inputs_);
  inbox_.phantom.read(inputs_.phantom);
  inbox_.settings.read(inputs_.settings);
  inbox_.view.read(view_);
  desk.read(desk_now_);
  const auto since_s = [now_ns](core::Nanoseconds then_ns) { return core::seconds(now_ns - then_ns); };
  if (inputs_.drag.received_ns != 0) inputs_.drag_age_s = since_s(inputs_.drag.received_ns);
  teleop::age_partner(inputs_, inputs_.slave, now_ns);
  inputs_.drag_round_trip_s = inputs_.drag.answers_ns != 0 ? since_s(inputs_.drag.answers_ns) : 0.0;
  if (inputs_.phantom.received_ns != 0) inputs_.phantom_age_s = since_s(inputs_.phantom.received_ns);
}

// A simulated person hears the tone and sees the views that are on.
void Servo::notice(const MasterReport& report) noexcept {
  const bool fresh = inputs_.phantom_age_s <= kPhantomStaleness_s;
  hand_.notice(fresh && report.tone_enabled ? inputs_.phantom.closeness : 0.0,
               fresh && report.views_enabled ? inputs_.phantom.threat_closeness : 0.0);
}

// The desk pushes nothing before master and slave are coupled. A person on real drives needs no simulated
// torque.
const core::JointArray& Servo::hand_torque(bool go, const DeviceSense& sense, double dt_s) noexcept {
  if (held_by_person_) return no_torque_;
  if (desk_leads_) return desk_hand_.step(go ? desk_now_ : DeskState{}, sense.hand_velocity);
  // A hand on a Cartesian device lets go while nothing is coupled: the master goes to the slave by itself.
  if (driver_ == Driver::kCartesian && !go) hand_.release(sense.hand_position);
  return hand_.step(sense.hand_position, sense.hand_velocity, (go && !sense.hand_waits) || script_.meeting(),
                    dt_s);
}

// Returns false if the device's position is not known yet.
bool Servo::step(MasterReport& report, double dt_s, core::Nanoseconds now_ns) noexcept {
  const bool go = state_ == teleop::LinkState::kCoupled;
  const bool heard = inputs_.partner_age_s <= staleness_s_;
  const bool contact = inputs_.slave.contact && heard;
  const DeviceSense& sense = device_.sense(now_ns);
  const bool apart = state_ == teleop::LinkState::kReady && heard;
  if (scripted_) {
    if (apart && driver_ == Driver::kSim) {
      script_.meet(inputs_.slave.position, dt_s);
    } else {
      script_.step(sense.hand_position, go && !sense.hand_waits, contact, dt_s);
    }
    inputs_.percept_wanted = script_.percept_on();
  }
  inputs_.position = sense.position;
  inputs_.velocity = sense.velocity;
  inputs_.drives_operational = sense.follows;
  inputs_.drive_fault = sense.fault;
  inputs_.enabling = enabling.step(sense.inputs, now_ns, dt_s);
  inputs_.device_longer_s = sense.longer_s;
  inputs_.rendered_share = sense.rendered_share;
  controller_.step(inputs_, dt_s, report);
  const bool released = stops_.end(inputs_, report.outputs);
  state_ = report.outputs.state;
  notice(report);
  const core::JointArray& hand_Nm = hand_torque(go, sense, dt_s);
  // A Cartesian hand's wrench is none of the joints' torques.
  report.operator_torque_Nm = driver_ == Driver::kCartesian ? no_torque_ : hand_Nm;
  const bool seen = view_.received_ns != 0 && now_ns - view_.received_ns < kViewStale_ns;
  device_.move({.motor_Nm = report.outputs.motor_Nm,
                .hand_Nm = hand_Nm,
                .power = report.outputs.power,
                .reset = released,
                .late = report.outputs.loop.late,
                .clutch_out = desk_leads_ && (desk_now_.clutch_out || !desk_now_.alive),
                .coupled = state_ == teleop::LinkState::kCoupled,
                .view = seen ? &view_ : nullptr,
                .meet = apart ? &inputs_.slave.position : nullptr},
               dt_s, now_ns);
  log_.step({script_.number(), script_.index(), script_.percept_on(), report.percept_torque_Nm,
             report.operator_torque_Nm},
            inputs_.slave, dt_s);
  return sense.known;
}

void Servo::tick(double dt_s, core::Nanoseconds now_ns) noexcept {
  read_inbox(now_ns);
  MasterReport report;
  // A device whose time is the loop's waits for it.
  if (!device_.makes_up_periods()) inputs_.loop = loop_guard_.tick(now_ns);
  report.stop_requests = stops_.begin(inputs_, runtime::emergency_stop_signals());
  const auto steps = teleop::steps_of_tick(dt_s, period_s_, device_.makes_up_periods());
  bool known = false;
  for (int k = 0; k < steps.count; ++k) known = step(report, steps.step_s, now_ns);
  if (!known) return;
  // Position and velocity to which the torques belong, so that torque · velocity is the rendered power.
  report.joint_count = joint_count_;
  report.position = inputs_.position;
  report.velocity = inputs_.velocity;
  report.reach = script_.number();
  report.gripper_asked = script_.gripper_asked();
  report.gripper_open = script_.gripper_action() == simulation::GripperAction::kOpen;
  const messages::HapticDeviceWrench* wrench = device_.wrench_to_send();
  report.has_wrench = wrench != nullptr;
  if (wrench != nullptr) report.wrench = *wrench;
  report.slave_echo = inputs_.slave.stamp;
  report.drag_echo = inputs_.drag.stamp;
  if (drag_is_new_) report.round_trip_s = inputs_.drag.round_trip_s;
  outbox.write(report);
  published.raise();
}

}  // namespace phantom::master_io
