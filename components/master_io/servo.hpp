#pragma once

#include <optional>

#include "common/core/snapshot.hpp"
#include "common/runtime/process/wake_signal.hpp"
#include "common/runtime/servo/enabling_switch.hpp"
#include "common/simulation/operator_model.hpp"
#include "common/simulation/reach_script.hpp"
#include "components/master_io/dds_adapter.hpp"
#include "components/master_io/devices/desk.hpp"
#include "components/master_io/devices/device.hpp"
#include "components/master_io/reaches/reach_log.hpp"

namespace phantom::master_io {

/// Work of the servo thread: reads the newest inputs from the inbox, runs script, controller, hand and
/// device, and writes the outputs to the outbox. It never calls DDS, allocates memory or waits.
class Servo {
 public:
  /// `device`, `inbox` and `stops` must outlive the servo. `home`: initial pose of a simulated hand. `seed`:
  /// random, for the ids of stops. `stops` stores the stop in force and holds that of the previous process.
  Servo(const Config& config, const core::JointArray& home, Device& device, Inbox& inbox, std::uint64_t seed,
        teleop::StopStore& stops);

  /// Runs one tick of `dt_s`, a whole multiple of the period, at `now_ns` on the monotonic clock. Makes up
  /// for up to teleop::kMaxMadeUp missed periods, so that a simulated hand keeps real time; real drives get
  /// one command for all of them. Publishes nothing before the device's position is known. Real-time safe:
  /// yes.
  void tick(double dt_s, core::Nanoseconds now_ns) noexcept;

  runtime::SwitchReader enabling;                            ///< this side's enabling switch
  core::Snapshot<DeskState> desk;                            ///< written by the desk's input, if there is one
  core::Snapshot<MasterReport> outbox;                       ///< read by the publishing thread
  runtime::WakeSignal published;                             ///< raised after each tick
  const ReachLog& reaches() const noexcept { return log_; }  ///< valid once the servo thread has ended

 private:
  void read_inbox(core::Nanoseconds now_ns) noexcept;
  bool step(MasterReport& report, double dt_s, core::Nanoseconds now_ns) noexcept;
  void notice(const MasterReport& report) noexcept;
  const core::JointArray& hand_torque(bool go, const DeviceSense& sense, double dt_s) noexcept;

  std::uint32_t joint_count_;
  Inbox& inbox_;
  double period_s_, staleness_s_;
  MasterInputs inputs_;
  bool drag_is_new_ = false;
  teleop::LinkState state_ = teleop::LinkState::kInit;
  MasterIo controller_;
  Device& device_;
  std::optional<teleop::JointMapping> mapping_;  // of a master with fewer joints than the arm
  teleop::LoopGuard loop_guard_;
  Driver driver_;
  bool held_by_person_, desk_leads_, scripted_;
  teleop::StopExchange stops_;
  core::JointArray no_torque_{};
  DeskState desk_now_;
  SeenView view_;
  DeskHand desk_hand_;
  simulation::OperatorModel hand_;
  simulation::ReachScript script_;
  ReachLog log_;
};

}  // namespace phantom::master_io
