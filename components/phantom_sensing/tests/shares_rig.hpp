#pragma once

// The suspended arm among balls, with links that two other processes sense.

#include <optional>
#include <random>

#include "components/phantom_sensing/tests/rig.hpp"

namespace phantom::phantom_sensing::rig {

inline const workspace::Workspace& balls() {
  static const workspace::Workspace world = robot::test_worlds::balls();
  return world;
}

/// The suspended arm, of which two other processes sense the links 2 and 4, and 6 and 7.
inline PhantomModel shared_model(std::optional<std::size_t> own_share = {}) {
  PhantomModel model = suspended_model();
  model.shares = {{"upper", {}}, {"hand", {}}};
  for (const std::size_t link : {2, 4}) model.shares[0].links[link] = true;
  for (const std::size_t link : {6, 7}) model.shares[1].links[link] = true;
  model.own_share = own_share;
  return model;
}

inline StepInputs random_inputs(const PhantomModel& model, std::mt19937& random) {
  StepInputs inputs;
  for (std::size_t j = 0; j < model.arm.joint_count(); ++j) {
    const robot::Joint& joint = model.arm.joints()[j];
    inputs.position[j] = std::uniform_real_distribution(joint.lower, joint.upper)(random);
    inputs.velocity[j] = std::uniform_real_distribution(-0.5, 0.5)(random);
  }
  inputs.dt_s = 0.6;  // alerts may follow each other
  inputs.workspace = {&balls(), percept::greatest_neighbour_mu(balls())};
  inputs.state_valid = true;
  return inputs;
}

inline SensedShare share_of(const StepOutputs& helper) {
  return {helper.drag, static_cast<float>(helper.percept.mu), helper.percept.sensor, helper.muted_sensors,
          helper.threats};
}

}  // namespace phantom::phantom_sensing::rig
