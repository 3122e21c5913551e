#pragma once

#include "common/simulation/gripper_plant.hpp"
#include "components/slave_io/gripper.hpp"

namespace phantom::slave_io {

/// A gripper without hardware, open at the start, with an object of stated width between its fingers.
class SimulatedGripper final : public GripperDriver {
 public:
  explicit SimulatedGripper(const simulation::GripperPlantParameters& parameters)
      : plant_(parameters, parameters.widest_m) {}

  teleop::GripperSense sense() noexcept override {
    return {true, plant_.width_m(), plant_.velocity_m_s(), plant_.drive_force_N(), true, false};
  }
  HomingRequest::State homing() const noexcept override { return HomingRequest::State::kNotNeeded; }
  void move(const GripperCommand& command, double dt_s, core::Nanoseconds) noexcept override {
    plant_.step(command.demand.width_m, command.demand.force_N, dt_s);
  }
  core::ActuatorHealth health() override { return {}; }

  const simulation::GripperPlant& plant() const noexcept { return plant_; }

 private:
  simulation::GripperPlant plant_;
};

}  // namespace phantom::slave_io
