#pragma once

// Master and slave as they run, servo, controllers, plants and the topics' conversions, on a simulated clock
// and a network that does what a test wants. The slave's arm is simulated, or has simulated drives on CAN
// buses. The two share nothing but the wire, and a person who sees and commands them over it: each has its
// own requests and its own kept stop, which outlives it.

#include <algorithm>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <random>

#include "common/dds/admission/source_guard.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/simulation/tests/half_space.hpp"
#include "common/teleop/tests/stop_store.hpp"
#include "components/master_io/servo.hpp"
#include "components/master_io/tests/fixture.hpp"
#include "components/slave_io/can_arm.hpp"
#include "components/slave_io/servo.hpp"
#include "components/slave_io/simulated_arm.hpp"
#include "components/slave_io/tests/drive_rig.hpp"
#include "tests/faults/link_trace.hpp"

namespace phantom::faults {

inline constexpr core::Nanoseconds kTick_ns = 1'000'000;
inline constexpr double kTick_s = 0.001;
inline constexpr std::size_t kJoints = 7;

/// One direction of one topic: best effort, newest counts, as in the topics' contract.
template <class Message>
class Channel {
 public:
  bool cut = false;
  double loss = 0.0;       ///< probability
  bool duplicate = false;  ///< every sample comes twice, the second 3 ms later
  core::Nanoseconds delay_ns = 200'000, jitter_ns = 0;

  void send(const Message& message, core::Nanoseconds now_ns) {
    if (cut || share() < loss) return;
    put(message, now_ns);
    if (duplicate) put(message, now_ns + 3 * kTick_ns);
  }
  /// Calls take(message) for everything that has arrived, in order of arrival.
  template <class Take>
  void receive(core::Nanoseconds now_ns, Take take) {
    std::stable_sort(under_way_.begin(), under_way_.end(),
                     [](const auto& a, const auto& b) { return a.due_ns < b.due_ns; });
    for (; !under_way_.empty() && under_way_.front().due_ns <= now_ns; under_way_.pop_front())
      take(under_way_.front().message);
  }

 private:
  struct UnderWay {
    core::Nanoseconds due_ns;
    Message message;
  };
  double share() { return static_cast<double>(random_()) / 4294967296.0; }
  void put(const Message& message, core::Nanoseconds now_ns) {
    under_way_.push_back(
        {now_ns + delay_ns + static_cast<core::Nanoseconds>(share() * static_cast<double>(jitter_ns)),
         message});
  }
  std::deque<UnderWay> under_way_;
  std::mt19937 random_{7};
};

/// A process: it runs, is frozen (SIGSTOP), or is gone.
enum class Life { kRuns, kFrozen, kGone };

class Pair {
 public:
  Channel<msg::MasterState> up;
  Channel<msg::SlaveState> down;
  Channel<msg::DragField> drag;
  Life master_life = Life::kRuns, slave_life = Life::kRuns, phantom_life = Life::kRuns;
  bool spoil_master = false, spoil_slave = false, spoil_drag = false;  ///< numbers that are none
  bool wrong_joints = false;                                           ///< both report another arm
  bool second_master = false,
       second_slave = false;  ///< another process sends the same topic, of another pose
  bool person_off_master = false, person_off_slave = false;  ///< the person's cable to that side is out
  bool person_looks = true;  ///< at what is stopped; else the person goes by what was seen before
  teleop::MemoryStopStore master_stops, slave_stops;  ///< their files
  master_io::Settings settings;                       ///< what operators have set at the master

  explicit Pair(const master_io::Config& master)
      : master_config_(master), slave_config_(slave_io::shipped_config()) {
    start_master();
    start_slave();
  }
  Pair() : slave_config_(slave_io::shipped_config()) {
    start_master();
    start_slave();
  }
  /// With drives on CAN in torque mode.
  explicit Pair(can::FaultReaction reaction)
      : slave_config_(slave_io::can_config(can::DriveMode::kTorque, reaction)) {
    rig = std::make_unique<slave_io::DriveRig>(slave_config_, slave_io::shipped_arm().home);
    start_master();
    start_slave();
  }
  /// With both sides' configurations; a slave with a section can has simulated drives.
  Pair(const master_io::Config& master, const slave_io::Config& slave)
      : master_config_(master), slave_config_(slave) {
    if (slave_config_.can)
      rig = std::make_unique<slave_io::DriveRig>(
          slave_config_, slave_io::shipped_arm().home,
          [this](std::size_t j, simulated_drive::DriveOptions& drive) { wire_switch(j, drive); });
    start_master();
    start_slave();
  }
  /// A person presses the stop of the page: for both sides, as far as they are there and reached.
  void stop() {
    if (master_life != Life::kGone && !person_off_master) master_inbox_->stops.stop();
    if (slave_life != Life::kGone && !person_off_slave) slave_inbox_->stops.stop();
  }
  /// Stops one side alone, as a signal to its process does.
  void signal_master() { master_inbox_->stops.stop(); }
  void signal_slave() { slave_inbox_->stops.stop(); }
  /// A person resets what is seen to be stopped.
  void reset() {
    if (trace != nullptr) trace->put_reset(seen_master_stop_, seen_slave_stop_);
    if (master_life != Life::kGone && !person_off_master)
      master_inbox_->stops.reset({.own = seen_master_stop_, .partner = seen_slave_stop_});
    if (slave_life != Life::kGone && !person_off_slave)
      slave_inbox_->stops.reset({.own = seen_slave_stop_, .partner = seen_master_stop_});
  }
  /// A new process in the place of one that is gone.
  void start_master() {
    settings.percept_gain = master_config_.percept_gain;
    settings.law = master_config_.feedback.law;
    // A master comes up where its device is; the hand holds it there.
    const auto where = master_ ? master_now.position : master_io::shipped_arm().home;
    master_inbox_ = std::make_unique<master_io::Inbox>();
    master_device_ = std::make_unique<master_io::SimulatedDevice>(master_config_, where);
    master_ = std::make_unique<master_io::Servo>(master_config_, where, *master_device_, *master_inbox_,
                                                 ++session_, master_stops);
    master_numbers_ = {++session_, 0};
    slave_heard_.emplace();
    drag_heard_.emplace();
    master_life = Life::kRuns;
  }
  void start_slave() {
    auto model = slave_io::shipped_arm();
    if (slave_) model.home = slave_now.position;
    slave_.reset();
    slave_arm_.reset();  // its places on the buses are free again
    slave_model_ = std::make_unique<slave_io::ArmModel>(model);
    slave_inbox_ = std::make_unique<slave_io::Inbox>();
    if (rig) {
      slave_arm_ = std::make_unique<slave_io::CanArm>(*slave_model_, slave_config_, rig->connect());
    } else {
      slave_arm_ = std::make_unique<slave_io::SimulatedArm>(*slave_model_, slave_config_, nothing_);
    }
    slave_ = std::make_unique<slave_io::Servo>(*slave_model_, slave_config_, *slave_arm_, *slave_inbox_,
                                               ++session_, slave_stops);
    slave_numbers_ = {++session_, 0};
    master_heard_.emplace();
    slave_life = Life::kRuns;
  }
  /// What the input device of the master's enabling switch says.
  core::Snapshot<runtime::SwitchReading>& master_switch() { return master_->enabling.input; }
  void step() {
    now_ns += kTick_ns;
    if (master_life == Life::kRuns) tick_master();
    if (slave_life == Life::kRuns && now_ns % slave_period_ns() == 0) tick_slave();
    if (rig) rig->pass(now_ns, kTick_ns);
    if (phantom_life == Life::kRuns) tick_phantom();
  }
  teleop::LinkState master_state() const { return master_now.outputs.state; }
  teleop::LinkState slave_state() const { return slave_now.outputs.state; }

  static const master_io::Config& master_config() {
    static const auto config = [] {
      auto made = master_io::shipped_config();
      made.script.first_wait_s = 0.2;  // soon under way
      return made;
    }();
    return config;
  }
  const slave_io::Config& slave_config() const { return slave_config_; }
  core::ActuatorHealth slave_drives() { return slave_arm_->health(); }

  core::Nanoseconds now_ns = core::kNsPerSecond;
  master_io::MasterReport master_now;
  slave_io::SlaveReport slave_now;
  std::unique_ptr<slave_io::DriveRig> rig;  ///< none: the arm is simulated
  LinkTrace* trace = nullptr;               ///< takes what both say; null: nobody does

 private:
  struct Numbers {
    std::uint64_t session = 0, last = 0;
    msg::Stamp next(core::Nanoseconds now_ns) {
      msg::Stamp stamp;
      stamp.session(session);
      stamp.sequence_number(++last);
      stamp.monotonic_ns(now_ns);
      return stamp;
    }
  };

  // The slave's enabling switch, if one is configured, is on the terminals of its drive.
  void wire_switch(std::size_t joint, simulated_drive::DriveOptions& drive) const {
    if (!slave_config_.can->group.axes[joint].digital_inputs) return;
    const auto& wired = slave_config_.enabling_switch.value();
    for (const auto& contact : {wired.first, wired.second})
      if (contact.bit >= 0) drive.enabling_inputs |= 1U << static_cast<unsigned>(contact.bit);
  }
  bool takes(std::optional<dds::SourceGuard>& guard, const msg::Stamp& stamp) const {
    return guard->assess(stamp, now_ns) == dds::SourceGuard::Verdict::kAccepted;
  }

  void tick_master() {
    down.receive(now_ns, [&](const msg::SlaveState& message) {
      const auto state = messages::from_idl(message, bounds_);
      if (!state || !takes(slave_heard_, message.stamp())) return;
      master_inbox_->slave.write({*state, state->master_echo, now_ns, master_numbers_.session});
    });
    drag.receive(now_ns, [&](const msg::DragField& message) {
      const auto field = messages::from_idl(message, bounds_);
      if (!field || !takes(drag_heard_, message.stamp())) return;
      master_inbox_->drag.write({*field, field->master_echo, now_ns, master_numbers_.session});
    });
    master_inbox_->settings.write(settings);
    master_->tick(kTick_s, now_ns);
    master_->outbox.read(master_now);
    auto message = messages::to_idl(master_now);
    if (wrong_joints) message.joint_count(6);
    message.stamp(master_numbers_.next(now_ns));
    if (person_looks && !person_off_master) seen_master_stop_ = message.stop();
    if (trace != nullptr) trace->put(message);
    if (spoil_master) message.position_rad()[3] = std::numeric_limits<double>::quiet_NaN();
    up.send(message, now_ns);
    if (!second_master) return;
    message.stamp(second_master_numbers_.next(now_ns));
    message.position_rad()[3] += 0.3;
    up.send(message, now_ns);
  }
  void tick_slave() {
    up.receive(now_ns, [&](const msg::MasterState& message) {
      const auto state = messages::from_idl(message, bounds_);
      if (!state || !takes(master_heard_, message.stamp())) return;
      slave_inbox_->master.write({*state, state->slave_echo, now_ns, slave_numbers_.session});
    });
    slave_->tick(slave_config_.period_s, now_ns);
    if (!slave_->outbox.read(slave_now)) return;  // where the arm is is not known yet
    auto message = messages::to_idl(slave_now);
    if (wrong_joints) message.joint_count(6);
    message.stamp(slave_numbers_.next(now_ns));
    if (person_looks && !person_off_slave) seen_slave_stop_ = message.stop();
    if (trace != nullptr) trace->put(message);
    if (spoil_slave) message.position_rad()[3] = std::numeric_limits<double>::infinity();
    down.send(message, now_ns);
    if (!second_slave) return;
    message.stamp(second_slave_numbers_.next(now_ns));
    message.position_rad()[3] += 0.3;
    down.send(message, now_ns);
  }
  // Some drag everywhere, so that its loss is felt.
  void tick_phantom() {
    msg::DragField field;
    field.stamp(phantom_numbers_.next(now_ns));
    field.joint_count(static_cast<std::uint32_t>(wrong_joints ? 6 : kJoints));
    field.master_echo(dds::echo_of(slave_now.master_echo));
    field.valid(true);
    field.coefficient_plus().fill(0.05);
    field.coefficient_minus().fill(0.05);
    if (spoil_drag) field.coefficient_plus()[3] = std::numeric_limits<double>::quiet_NaN();
    drag.send(field, now_ns);
  }

  core::Nanoseconds slave_period_ns() const { return core::from_seconds(slave_config_.period_s); }

  master_io::Config master_config_ = master_config();
  slave_io::Config slave_config_;
  simulation::HalfSpace nothing_{Eigen::Vector3d::UnitZ(), -50.0};
  messages::ArmBounds bounds_ = messages::bounds_of(master_io::shipped_arm().arm);
  std::uint64_t session_ = 0;
  Numbers master_numbers_, slave_numbers_, phantom_numbers_{1000, 0};
  Numbers second_master_numbers_{2000, 0}, second_slave_numbers_{3000, 0};
  std::optional<dds::SourceGuard> slave_heard_, drag_heard_, master_heard_;
  teleop::StopId seen_master_stop_ = 0, seen_slave_stop_ = 0;  // by the person
  std::unique_ptr<master_io::Inbox> master_inbox_;
  std::unique_ptr<master_io::SimulatedDevice> master_device_;
  std::unique_ptr<master_io::Servo> master_;
  std::unique_ptr<slave_io::ArmModel> slave_model_;
  std::unique_ptr<slave_io::Inbox> slave_inbox_;
  std::unique_ptr<slave_io::ArmDriver> slave_arm_;
  std::unique_ptr<slave_io::Servo> slave_;
};

}  // namespace phantom::faults
