#pragma once

#include "common/core/snapshot.hpp"
#include "common/runtime/wake_signal.hpp"
#include "common/simulation/operator_model.hpp"
#include "common/simulation/reach_script.hpp"
#include "components/master_io/dds_adapter.hpp"
#include "components/master_io/desk.hpp"
#include "components/master_io/device.hpp"
#include "components/master_io/reach_log.hpp"

namespace phantom::master_io {

/// The servo thread's work: newest inputs from the inbox, script, controller, hand and device, outputs to the
/// outbox. It never calls DDS, allocates or waits.
class Servo {
 public:
  /// `device`, `inbox` and `stops` must outlive it. `home`: where a simulated hand begins. `seed`: random,
  /// for the names of stops; `stops`: keeps the stop in force, and has the one of the process before this
  /// one.
  Servo(const Config& config, const core::JointArray& home, Device& device, Inbox& inbox, std::uint64_t seed,
        teleop::StopStore& stops);

  /// One tick of `dt_s`, a whole multiple of the period, at `now_ns` on the monotonic clock. Periods that the
  /// loop missed are made up for, up to teleop::kMostMadeUp, so that a simulated hand keeps real time; real
  /// drives get one command for all of them. Nothing is published before the device is known. Real-time safe:
  /// yes.
  void tick(double dt_s, core::Nanoseconds now_ns) noexcept;

  core::Snapshot<DeskState> desk;                            ///< writer: the desk's input, if there is one
  core::Snapshot<MasterReport> outbox;                       ///< reader: the thread that publishes
  runtime::WakeSignal published;                             ///< raised after each tick
  const ReachLog& reaches() const noexcept { return log_; }  ///< once the servo thread has ended

 private:
  void read_inbox(core::Nanoseconds now_ns) noexcept;
  bool step(MasterReport& report, double dt_s, core::Nanoseconds now_ns) noexcept;
  const core::JointArray& hand_torque(bool go, const DeviceSense& sense, double dt_s) noexcept;

  std::uint32_t joint_count_;
  Inbox& inbox_;
  double period_s_, staleness_s_;
  MasterInputs inputs_;
  bool drag_is_new_ = false;
  teleop::LinkState state_ = teleop::LinkState::kInit;
  MasterIo controller_;
  Device& device_;
  Driver driver_;
  teleop::StopExchange stops_;
  core::JointArray no_torque_{};
  DeskState desk_now_;
  DeskHand desk_hand_;
  simulation::OperatorModel hand_;
  simulation::ReachScript script_;
  ReachLog log_;
};

}  // namespace phantom::master_io
