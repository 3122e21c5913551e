#pragma once

#include <optional>

#include "common/can/arm_drives.hpp"
#include "common/teleop/coupling/counterbalance.hpp"
#include "common/teleop/guards/feedback_observer.hpp"
#include "common/teleop/guards/momentum_observer.hpp"
#include "components/slave_io/arm_driver.hpp"
#include "components/slave_io/model.hpp"

namespace phantom::slave_io {

/// What would become of a request to home the drives, stops aside.
inline HomingRequest::State homing_of(const can::ArmDrivesSense& drives) noexcept {
  return drives.homing         ? HomingRequest::State::kRuns
         : drives.needs_homing ? HomingRequest::State::kPossible
         : drives.known        ? HomingRequest::State::kNotNeeded
                               : HomingRequest::State::kNotYet;
}

/// The arm's drives on their CAN buses. Each joint runs in the mode of its drive: torque (of the controller's
/// position loop), velocity (the reference's velocity plus k_p/k_v times the position error) or position (the
/// reference). The weight of what the arm carries, and the lift of both in a medium, is fed forward with the
/// links'; with the payload's inertia it counts for the observer. An emergency stop is the drives' quick
/// stop. With `force_sensor` and `force_observer` the external torques and contact come from the drives'
/// torque (MomentumObserver), while the drives follow. With `force_observer` a drive with a motion that its
/// torque cannot have caused (FeedbackObserver) is put into fault. Where the arm is touched and with which
/// force is unknown, as is the clearance.
class CanArm final : public ArmDriver {
 public:
  /// `config.can` must be set; `model` must outlive the arm. `buses`: one open bus per address.
  CanArm(const ArmModel& model, const Config& config, std::vector<std::unique_ptr<can::CanBus>> buses);

  const ArmSense& sense() noexcept override;
  void move(const ArmDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept override;
  void end(core::Nanoseconds now_ns) noexcept override { drives_.end(now_ns); }
  void carry(const robot::Payload& payload) noexcept override;
  void fill(messages::SlaveState& state) const noexcept override;
  bool makes_up_periods() const noexcept override { return false; }
  core::ActuatorHealth health() override;

  const can::DriveGroupReport& drives() const noexcept { return drives_.report(); }  ///< for the servo thread

 private:
  core::JointArray weight_Nm() noexcept;

  const ArmModel& model_;
  std::vector<can::AxisConfig> axes_;
  bool balanced_;
  std::array<teleop::HeldTorque, core::kMaxJoints> held_;
  core::JointArray velocity_per_error_{};
  can::ArmDrives drives_;
  ArmSense sense_;
  core::JointArray exerted_Nm_{}, weight_Nm_{};
  robot::LinkPoses X_WL_;
  robot::Payload payload_;
  bool payload_changed_ = false;
  teleop::PayloadWeight payload_weight_;
  std::optional<teleop::MomentumObserver> observer_;
  std::optional<teleop::FeedbackObserver> feedback_;
  teleop::UnexplainedEnergy unexplained_;
  teleop::ExternalTorque external_;
  core::Nanoseconds moved_ns_ = 0;  // when the last SYNC was sent
  bool punctual_ = false;           // it came a period after the one before
  double since_last_s_ = 0.0;       // from the last SYNC but one to the last, which the drives have answered
  std::vector<core::HealthFigure> force_figures_;
};

}  // namespace phantom::slave_io
