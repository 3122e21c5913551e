#pragma once

#include "common/simulation/handle_plant.hpp"
#include "common/simulation/indexing_hand.hpp"
#include "components/master_io/cartesian_lead.hpp"

namespace phantom::master_io {

/// A device with position and force in its own frame as master: a virtual replica of the arm's joints, led by
/// the hand's twist, whose torques go back to the hand as a wrench (teleop::CartesianHand). The device is
/// simulated: a handle of six axes, and a person who re-indexes it where its workspace ends.
///
/// Or a person pushes the handle, which then has no edges, with a space mouse or a gamepad: hand_velocity and
/// hand_Nm are then in the device's axes, and clutch_out of DeviceDemand is the clutch. A simulated person
/// works in the tool's coordinates (`tool_coordinates`): hand_position and hand_velocity of DeviceSense and
/// hand_Nm of DeviceDemand have six values, in the world's axes and in metres and radians of the hand.
class CartesianDevice final : public Device {
 public:
  /// `arm` must outlive the device.
  CartesianDevice(const Config& config, const robot::SerialArm& arm, const core::JointArray& start_q);

  const DeviceSense& sense(core::Nanoseconds) noexcept override;
  void move(const DeviceDemand& demand, double dt_s, core::Nanoseconds) noexcept override;
  void end(core::Nanoseconds) noexcept override {}  // its time ends with the loop's
  bool makes_up_periods() const noexcept override { return true; }
  core::ActuatorHealth health() override { return {}; }
  const CartesianFigures* cartesian_figures() const noexcept override { return &lead_.figures(); }

  /// Wrench on the hand, in the device's axes, of the last tick.
  const robot::Spatial& wrench() const noexcept { return lead_.wrench(); }
  const robot::Spatial& twist() const noexcept { return lead_.handle().twist; }

 private:
  CartesianConfig parameters_;
  Eigen::Matrix3d R_home_;
  CartesianLead lead_;
  simulation::HandlePlant plant_;
  simulation::IndexingHand person_;
  bool pushed_;  // by a space mouse or a gamepad
  bool clutch_out_;
  DeviceSense sense_;
};

}  // namespace phantom::master_io
