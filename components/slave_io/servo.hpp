#pragma once

#include "common/core/snapshot.hpp"
#include "common/runtime/periodic_loop.hpp"
#include "common/runtime/wake_signal.hpp"
#include "components/slave_io/arm_driver.hpp"
#include "components/slave_io/model.hpp"

namespace phantom::slave_io {

/// The servo thread's work: newest inputs from the inbox, controller, arm, outputs to the outbox. It never
/// calls DDS, allocates or waits.
class Servo {
 public:
  /// `arm`, `inbox` and `stops` must outlive it. `seed`: random, for the names of stops; `stops`: keeps the
  /// stop in force, and has the one of the process before this one.
  Servo(const ArmModel& model, const Config& config, ArmDriver& arm, Inbox& inbox, std::uint64_t seed,
        teleop::StopStore& stops);

  /// One tick of `dt_s`, a whole multiple of the period, at `now_ns` on the monotonic clock. Periods that the
  /// loop missed are made up for, up to teleop::kMostMadeUp, so that a simulated arm keeps real time; real
  /// drives get one command for all of them. Nothing is published before the arm is known. Real-time safe:
  /// yes.
  void tick(double dt_s, core::Nanoseconds now_ns) noexcept;

  core::Snapshot<SlaveReport> outbox;  ///< reader: the thread that publishes
  runtime::WakeSignal published;       ///< raised after each tick

 private:
  std::uint32_t joint_count_;
  Inbox& inbox_;
  double period_s_;
  SlaveInputs inputs_;
  SlaveIo controller_;
  ArmDriver& arm_;
  teleop::StopExchange stops_;
};

}  // namespace phantom::slave_io
