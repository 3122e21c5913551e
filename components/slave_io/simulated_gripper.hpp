#pragma once

#include "common/simulation/slave_plant.hpp"
#include "components/slave_io/gripper.hpp"

namespace phantom::slave_io {

/// The gripper of a simulated arm, open at the start.
class SimulatedGripper final : public GripperDriver {
 public:
  /// `arm` has a gripper and must outlive it.
  explicit SimulatedGripper(simulation::SlavePlant& arm) : arm_(arm) {}

  teleop::GripperSense sense() noexcept override {
    const simulation::GripperPlant& plant = *arm_.gripper();
    return {true, plant.width_m(), plant.velocity_m_s(), plant.drive_force_N(), true, false};
  }
  HomingRequest::State homing() const noexcept override { return HomingRequest::State::kNotNeeded; }
  /// In force from the arm's next step on, with which the fingers move.
  void move(const GripperCommand& command, double, core::Nanoseconds) noexcept override {
    arm_.grip(command.demand.width_m, command.demand.force_N);
  }
  core::ActuatorHealth health() override { return {}; }

 private:
  simulation::SlavePlant& arm_;
};

}  // namespace phantom::slave_io
