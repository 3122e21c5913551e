#pragma once

#include <optional>

#include "common/core/snapshot.hpp"
#include "common/runtime/process/wake_signal.hpp"
#include "common/runtime/servo/enabling_switch.hpp"
#include "common/runtime/servo/periodic_loop.hpp"
#include "components/slave_io/arm_driver.hpp"
#include "components/slave_io/model.hpp"
#include "components/slave_io/wrist_input.hpp"

namespace phantom::slave_io {

/// Work of the servo thread: reads the newest inputs from the inbox, runs controller and arm, and writes the
/// outputs to the outbox. It never calls DDS, allocates memory or waits.
class Servo {
 public:
  /// `arm`, `inbox`, `stops`, `gripper` and `wrist` must outlive the servo; null: there is no gripper, or no
  /// sensor at the wrist. `seed`: random, for the ids of stops. `stops` stores the stop in force and holds
  /// that of the previous process.
  Servo(const ArmModel& model, const Config& config, ArmDriver& arm, Inbox& inbox, std::uint64_t seed,
        teleop::StopStore& stops, GripperDriver* gripper = nullptr, WristInput* wrist = nullptr);

  /// Runs one tick of `dt_s`, a whole multiple of the period, at `now_ns` on the monotonic clock. Makes up
  /// for up to teleop::kMaxMadeUp missed periods, so that a simulated arm keeps real time; real drives get
  /// one command for all of them. Publishes nothing before the arm's position is known. Real-time safe: yes.
  void tick(double dt_s, core::Nanoseconds now_ns) noexcept;

  runtime::SwitchReader enabling;      ///< this side's enabling switch
  core::Snapshot<SlaveReport> outbox;  ///< read by the publishing thread
  runtime::WakeSignal published;       ///< raised after each tick

 private:
  std::uint32_t joint_count_;
  Inbox& inbox_;
  double period_s_;
  SlaveInputs inputs_;
  bool force_measured_ = false;     // in the tick before
  core::JointArray external_Nm_{};  // F_e then
  bool contact_ = false;            // likewise
  double contact_force_N_ = -1.0;
  std::uint16_t contact_object_ = 0;
  robot::Payload payload_;
  BoundedPlaces places_;
  SlaveIo controller_;
  ArmDriver& arm_;
  std::optional<Gripper> gripper_;
  WristInput* wrist_;
  teleop::LoopGuard loop_guard_;
  teleop::StopExchange stops_;
};

}  // namespace phantom::slave_io
