#pragma once

// The suspended arm among balls, with links that two other processes sense.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
  SensedShare share{helper.drag, static_cast<float>(helper.percept.mu), helper.percept.sensor,
                    helper.muted_sensors, helper.threats};
  share.reaction = helper.reaction;
  return share;
}

/// The balls as bodies that give way: all of each is boundary, under one pressure.
inline robot::SoftBody soft_balls() {
  robot::SoftBody soft;
  soft.object = 1;
  soft.pressure_Pa[static_cast<std::uint8_t>(workspace::kOrderBoundary)] = 500.0;
  soft.stiffness_Pa_per_m[static_cast<std::uint8_t>(workspace::kOrderBoundary)] = 1e5;
  return soft;
}

/// Expects that two reactions differ by the order of addition only. Returns whether there is one.
inline bool expect_same_reaction(const robot::JointReaction& a, const robot::JointReaction& b) {
  double greatest_torque = 0.0, greatest_stiffness = 0.0;
  for (std::size_t j = 0; j < core::kMaxJoints; ++j) {
    greatest_torque = std::max(greatest_torque, std::abs(b.torque[j]));
    greatest_stiffness = std::max(greatest_stiffness, b.stiffness[j]);
  }
  for (std::size_t j = 0; j < core::kMaxJoints; ++j) {
    EXPECT_NEAR(a.torque[j], b.torque[j], 1e-12 * greatest_torque) << j;
    EXPECT_NEAR(a.stiffness[j], b.stiffness[j], 1e-12 * greatest_stiffness) << j;
  }
  EXPECT_EQ(a.position, b.position);
  return greatest_torque > 0.0;
}

}  // namespace phantom::phantom_sensing::rig
