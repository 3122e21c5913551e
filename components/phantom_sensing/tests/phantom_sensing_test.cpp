#include "components/phantom_sensing/phantom_sensing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <random>

#include "components/phantom_sensing/tests/rig.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing {
namespace {

using rig::hanging;

class Step : public testing::Test {
 protected:
  PhantomModel model_ = rig::suspended_model();
  PhantomSensing sensing_{model_, {}};
  StepOutputs out_;
};

void expect_nothing_felt(const StepOutputs& out) {
  for (std::size_t i = 0; i < core::kMaxJoints; ++i) {
    EXPECT_EQ(out.drag.plus[i], 0.0);
    EXPECT_EQ(out.drag.minus[i], 0.0);
    EXPECT_EQ(out.percept.drag_torque[i], 0.0);
  }
  for (const double entry : out.drag.coupled) EXPECT_EQ(entry, 0.0);
  EXPECT_EQ(out.percept.mu, 0.0);
  EXPECT_EQ(out.percept.closeness, 0.0);
  EXPECT_EQ(out.percept.velocity_W_m_s, Eigen::Vector3d::Zero());
  EXPECT_EQ(out.percept.motion, percept::MotionClass::kNone);
  EXPECT_EQ(out.percept.object, 0);
}

TEST_F(Step, FreeSpaceIsValidAndFeelsNothing) {
  sensing_.step(hanging(-0.4, 0.2), out_);
  EXPECT_TRUE(out_.valid);
  EXPECT_EQ(out_.workspace_version, 1U);
  expect_nothing_felt(out_);
}

TEST_F(Step, WithoutWorkspaceOrStateTheResultIsInvalidAndZero) {
  StepInputs inputs = hanging(0.2, 0.2);
  inputs.workspace = {};
  sensing_.step(inputs, out_);
  EXPECT_FALSE(out_.valid);
  EXPECT_EQ(out_.workspace_version, 0U);
  expect_nothing_felt(out_);
  inputs = hanging(0.2, 0.2);
  inputs.state_valid = false;
  sensing_.step(inputs, out_);
  EXPECT_FALSE(out_.valid);
  EXPECT_EQ(out_.workspace_version, 1U);
  expect_nothing_felt(out_);
}

TEST_F(Step, DragRisesTowardsTheWallAndOpposesTheMotion) {
  double before = 0.0;
  for (const double x : {0.12, 0.15, 0.18, 0.22, 0.26}) {
    sensing_.step(hanging(x, 0.1), out_);
    EXPECT_GT(out_.drag.plus[0], before) << x;
    EXPECT_DOUBLE_EQ(out_.percept.drag_torque[0], -0.1 * out_.drag.plus[0]);
    before = out_.drag.plus[0];
  }
}

TEST_F(Step, TellsWhereTheObjectIsAndHowTheMotionLiesToIt) {
  sensing_.step(hanging(0.18, 0.1), out_);
  const SkinPercept& percept = out_.percept;
  ASSERT_GT(percept.mu, 0.0);
  EXPECT_GT(percept.gradient.pgv_W_m.normalized().x(), 0.99);
  EXPECT_EQ(percept.motion, percept::MotionClass::kDangerous);
  EXPECT_TRUE(percept.velocity_W_m_s.isApprox(Eigen::Vector3d(0.1, 0, 0), 1e-12));
  EXPECT_DOUBLE_EQ(percept.closeness, percept.mu / 32.0);
  sensing_.step(hanging(0.18, -0.1), out_);
  EXPECT_EQ(out_.percept.motion, percept::MotionClass::kSafe);
  sensing_.step(hanging(0.18, 0.0), out_);
  EXPECT_EQ(out_.percept.motion, percept::MotionClass::kNone);
}

TEST_F(Step, DirectionalDragLetsGoWhenLeaving) {
  PerceptSettings settings;
  settings.directional.enabled = true;
  settings.directional.leaving_share = 0.25;
  PhantomSensing directional(model_, settings);
  sensing_.step(hanging(0.2, 0.1), out_);
  StepOutputs out;
  directional.step(hanging(0.2, 0.1), out);
  EXPECT_EQ(out.drag.plus[0], out_.drag.plus[0]);                  // nearing: full
  EXPECT_DOUBLE_EQ(out.drag.minus[0], 0.25 * out_.drag.minus[0]);  // leaving: what remains
}

TEST_F(Step, RaisesLatchesAndEndsAlerts) {
  sensing_.step(hanging(0.2, 0.3), out_);
  ASSERT_FALSE(out_.alerts.raised.empty());
  const auto raised = out_.alerts.raised;
  EXPECT_TRUE(raised.back().at.position_W_m.isApprox(out_.percept.position_W_m)) << "the most urgent last";
  for (const percept::Alert& alert : raised) EXPECT_EQ(alert.at.object, 1);
  StepInputs stale = hanging(0.2, 0.3);
  stale.state_valid = false;
  sensing_.step(stale, out_);
  ASSERT_EQ(out_.alerts.cleared.size(), raised.size())
      << "alerts on a state that is no longer known must end";
  for (const percept::Alert& alert : raised)
    EXPECT_EQ(std::ranges::count(out_.alerts.cleared, alert.number, &percept::Alert::number), 1);
  sensing_.step(stale, out_);
  EXPECT_TRUE(out_.alerts.cleared.empty());
}

/// Poses and speeds all over the range.
std::vector<StepInputs> wander(std::size_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<StepInputs> inputs;
  for (std::size_t i = 0; i < count; ++i) {
    StepInputs in = hanging(0.4 * unit(random), unit(random), 0.01);
    for (std::size_t j = 1; j < 7; ++j) in.position[j] = unit(random), in.velocity[j] = unit(random);
    in.state_valid = i % 10 != 9;
    inputs.push_back(in);
  }
  return inputs;
}

TEST_F(Step, AReplayGivesTheSameBitForBit) {
  PerceptSettings settings;
  settings.directional.enabled = true;
  PhantomSensing one(model_, settings), two(model_, settings);
  StepOutputs a, b;
  for (const StepInputs& inputs : wander(100)) {
    one.step(inputs, a);
    two.step(inputs, b);
    EXPECT_EQ(a.valid, b.valid);
    EXPECT_EQ(a.drag.plus, b.drag.plus);
    EXPECT_EQ(a.drag.minus, b.drag.minus);
    EXPECT_EQ(a.drag.coupled, b.drag.coupled);
    EXPECT_EQ(a.percept.sensor, b.percept.sensor);
    EXPECT_EQ(a.percept.gradient.pgv_W_m, b.percept.gradient.pgv_W_m);
    EXPECT_EQ(a.percept.drag_torque, b.percept.drag_torque);
    EXPECT_EQ(a.alerts.raised.size(), b.alerts.raised.size());
  }
}

TEST_F(Step, UsesNoHeap) {
  PerceptSettings settings;
  settings.directional.enabled = true;
  settings.mode = robot::DragMode::kCoupled;
  model_.medium = {{.mu_Pa_s_per_m = 2.0, .max_m = {9.0, 9.0, 1.0}, .current_m_s = {0.1, 0.0, 0.0}}};
  PhantomSensing sensing(model_, settings);
  const auto inputs = wander(50);
  std::size_t alerts = 0, drifts = 0;
  {
    const ::phantom::test::HeapGuard no_heap;
    for (const StepInputs& in : inputs) {
      sensing.step(in, out_);
      alerts += out_.alerts.raised.size();
      drifts += out_.drag.drift != core::JointArray{} ? 1U : 0U;
    }
  }
  EXPECT_GT(alerts, 0U);  // the walk went through all of it
  EXPECT_GT(drifts, 0U);
}

/// Weight of all sensors, m²: what a sliding joint at the base moves.
double skin_weight(const robot::SkinLayout& skin) {
  return std::accumulate(skin.weight.begin(), skin.weight.end(), 0.0);
}

TEST_F(Step, AMediumAddsItsDragAndChangesNothingElse) {
  PhantomModel wet = rig::suspended_model();
  wet.medium = {{.mu_Pa_s_per_m = 2.0, .current_m_s = {0.1, 0.0, 0.0}}};
  for (const bool directional : {false, true}) {
    PerceptSettings settings;
    settings.directional.enabled = directional;
    PhantomSensing dry_sensing(model_, settings), wet_sensing(wet, settings);
    for (const double v : {0.4, -0.4}) {
      StepOutputs in_water;
      dry_sensing.step(hanging(0.22, v), out_);
      wet_sensing.step(hanging(0.22, v), in_water);
      const double medium = 2.0 * skin_weight(wet.skin);
      EXPECT_NEAR(in_water.drag.plus[0], out_.drag.plus[0] + medium, 1e-9 * medium);
      EXPECT_NEAR(in_water.drag.minus[0], out_.drag.minus[0] + medium, 1e-9 * medium)
          << "letting go of an object does not let go of the water";
      EXPECT_NEAR(in_water.drag.drift[0] * in_water.drag.matrix(0, 0), 0.1 * medium, 1e-9 * medium);
      EXPECT_NEAR(in_water.percept.drag_torque[0],
                  -(v > 0 ? in_water.drag.plus[0] : in_water.drag.minus[0]) * (v - in_water.drag.drift[0]),
                  1e-9);
      EXPECT_EQ(in_water.percept.mu, out_.percept.mu);
      EXPECT_EQ(in_water.percept.closeness, out_.percept.closeness);
      EXPECT_EQ(in_water.percept.sensor, out_.percept.sensor);
      EXPECT_EQ(in_water.percept.velocity_W_m_s, out_.percept.velocity_W_m_s) << "seen from the object";
      EXPECT_EQ(in_water.percept.motion, out_.percept.motion);
      EXPECT_EQ(in_water.percept.rule, out_.percept.rule);
      EXPECT_EQ(in_water.active_sensors, out_.active_sensors);
    }
  }
}

TEST_F(Step, ASoftWallPushesBackAtRestAndAHardOneDoesNot) {
  sensing_.step(hanging(0.33, 0.0), out_);
  EXPECT_EQ(out_.reaction.torque, core::JointArray{});
  robot::SoftBody soft;  // the wall's boundary voxels are all that is in it
  soft.object = 1;
  soft.pressure_Pa[static_cast<std::uint8_t>(workspace::kOrderBoundary)] = 500.0;
  soft.stiffness_Pa_per_m[static_cast<std::uint8_t>(workspace::kOrderBoundary)] = 1e5;
  model_.soft_bodies = {soft};
  PhantomSensing sensing(model_, {});
  sensing.step(hanging(0.33, 0.0), out_);
  EXPECT_LT(out_.reaction.torque[0], 0.0) << "out of the wall, towards −x";
  EXPECT_GT(out_.reaction.stiffness[0], 0.0);
  EXPECT_EQ(out_.reaction.position, hanging(0.33, 0.0).position);
  EXPECT_EQ(out_.percept.drag_torque, core::JointArray{});
  sensing.step(hanging(-0.4, 0.0), out_);
  EXPECT_EQ(out_.reaction.torque, core::JointArray{});
  StepInputs stale = hanging(0.33, 0.0);
  stale.state_valid = false;
  sensing.step(stale, out_);
  EXPECT_EQ(out_.reaction, robot::JointReaction{});
}

TEST_F(Step, InAMediumAtRestThereIsNoDragAndInFreeWaterNoPercept) {
  model_.medium = {{.mu_Pa_s_per_m = 2.0, .current_m_s = {0.1, 0.0, 0.0}}};
  for (const robot::DragMode mode : {robot::DragMode::kSeparable, robot::DragMode::kCoupled}) {
    PerceptSettings settings;
    settings.mode = mode;
    PhantomSensing sensing(model_, settings);
    sensing.step(hanging(-0.4, 0.0), out_);
    EXPECT_EQ(out_.percept.drag_torque, core::JointArray{});
    EXPECT_EQ(out_.percept.mu, 0.0);
    EXPECT_EQ(out_.percept.object, 0);
    EXPECT_EQ(out_.active_sensors, 0U);
    EXPECT_GT(out_.drag.plus[0], 0.0);
    EXPECT_NEAR(out_.drag.drift[0], 0.1, 1e-5) << "the gantry would drift with the water";
  }
}

}  // namespace
}  // namespace phantom::phantom_sensing
