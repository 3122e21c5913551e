// A gripper's fingers are sensed where they are.
#include <gtest/gtest.h>

#include <cmath>

#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/teleop/rendering/torque_slew.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing {
namespace {

const runtime::CellConfig& gripper_bench() {
  static const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/gripper_bench/cell.yaml");
  return cell;
}

class FingersTest : public testing::Test {
 protected:
  /// The arm at home around a ball of 1 cm in the middle between its finger tips.
  StepInputs inputs(Fingers fingers = {}) const {
    StepInputs in;
    std::copy(gripper_bench().arms[0].home.begin(), gripper_bench().arms[0].home.end(), in.position.begin());
    in.dt_s = 0.001;
    in.workspace = {&world_, percept::greatest_neighbour_mu(world_)};
    in.fingers = fingers;
    in.state_valid = true;
    return in;
  }
  StepOutputs sensed(const StepInputs& in) {
    StepOutputs out;
    const test::HeapGuard guard;
    sensing_.step(in, out);
    return out;
  }
  static Eigen::Vector3d tool_W() {
    const auto arm = runtime::load_arm(gripper_bench().arms[0]);
    core::JointArray home{};
    std::copy(gripper_bench().arms[0].home.begin(), gripper_bench().arms[0].home.end(), home.begin());
    robot::LinkPoses X_WL;
    arm.link_poses(home, X_WL);
    const auto frame = *arm.find_frame("tool");
    return (X_WL[frame.first] * frame.second).translation_m;
  }
  static PhantomModel model_with(double finger_m) {
    runtime::CellConfig cell = gripper_bench();
    cell.arms[0].held_joints["finger_left"] = finger_m;
    cell.arms[0].gripper_closed.clear();
    return without_interest_points(load_model(cell, {}));
  }

  /// The skin alone: an interest point stands in the ball.
  static PhantomModel without_interest_points(PhantomModel model) {
    model.interest_points.clear();
    return model;
  }

  PhantomModel model_ = without_interest_points(load_model(gripper_bench(), {}));
  workspace::Workspace world_ = robot::test_worlds::make(
      [middle = tool_W()](const Eigen::Vector3d& p) {
        return robot::test_worlds::layer_code((p - middle).norm() - 0.01, 0.02);
      },
      tool_W(), 0.01,
      [middle = tool_W()](const Eigen::Vector3d& p, double radius_m) {
        return (p - middle).norm() - radius_m < 0.12;
      });
  PhantomSensing sensing_{model_, {}};
};

TEST_F(FingersTest, AreSensedAtTheirWidthAsAnArmThatHoldsThemThere) {
  ASSERT_TRUE(model_.has_fingers());
  double before = 0.0;
  for (const double closed : {0.0, 0.3, 0.7, 1.0, 0.5, 0.0}) {
    SCOPED_TRACE(closed);
    const PhantomModel held = model_with(0.05 * (1.0 - closed));
    EXPECT_FALSE(held.has_fingers());
    PhantomSensing twin(held, {});
    StepOutputs expected;
    twin.step(inputs(), expected);
    const StepOutputs out = sensed(inputs({.closed = closed}));
    for (std::size_t j = 0; j < model_.arm.joint_count(); ++j)
      EXPECT_NEAR(out.drag.plus[j], expected.drag.plus[j], 0.02 * expected.drag.plus[j] + 1e-9) << j;
    EXPECT_EQ(out.percept.mu, expected.percept.mu);
    EXPECT_LT((out.percept.position_W_m - expected.percept.position_W_m).norm(), 0.02);
    EXPECT_NE(out.drag.plus[0], before) << "closing is felt";
    before = out.drag.plus[0];
  }
}

TEST_F(FingersTest, TheSameWidthGivesTheSameBitsWhateverCameBefore) {
  const StepOutputs first = sensed(inputs({.closed = 0.4}));
  for (const double closed : {0.9, 0.0, 0.1, 0.4}) sensed(inputs({.closed = closed}));
  EXPECT_EQ(sensed(inputs({.closed = 0.4})).drag, first.drag);
}

TEST_F(FingersTest, AtRestTheirOwnMotionIsPerceivedAndDragsNoJoint) {
  const double rate_per_s = 2.0;  // 10 cm/s of each finger
  const StepOutputs still = sensed(inputs({.closed = 0.3}));
  EXPECT_EQ(still.percept.velocity_W_m_s.norm(), 0.0);
  EXPECT_EQ(still.percept.rule, percept::HitRule::kNone);
  const StepOutputs out = sensed(inputs({.closed = 0.3, .closing_per_s = rate_per_s}));
  EXPECT_EQ(out.percept.drag_torque, core::JointArray{}) << "drag vanishes at rest";
  EXPECT_EQ(out.drag, still.drag) << "coefficients are those of the joints' motion";
  EXPECT_NEAR(out.percept.velocity_W_m_s.norm(), 0.1, 1e-9);
  EXPECT_EQ(out.percept.motion, percept::MotionClass::kDangerous) << "it closes upon the ball";
  EXPECT_EQ(out.percept.rule, percept::HitRule::kModerateMoving);
  const StepOutputs opening = sensed(inputs({.closed = 0.3, .closing_per_s = -rate_per_s}));
  EXPECT_EQ(opening.percept.motion, percept::MotionClass::kSafe);
  // The velocity is that of the sensor's place.
  const std::size_t sensor = out.percept.sensor;
  const double dt_s = 1e-6;
  robot::LinkPoses X_WL;
  model_.arm.link_poses(inputs().position, X_WL);
  const Eigen::Vector3d moved =
      X_WL[out.percept.link] * model_.skin.position(sensor, 0.3 + rate_per_s * dt_s) -
      X_WL[out.percept.link] * model_.skin.position(sensor, 0.3);
  EXPECT_LT((moved / dt_s - out.percept.velocity_W_m_s).norm(), 1e-6);
}

TEST_F(FingersTest, AWidthThatJumpsMakesNoStepOfTheTorqueAboveTheSlew) {
  constexpr double kRate = 5.0, kDt_s = 0.001;
  teleop::TorqueSlewParameters p{.joint_count = model_.arm.joint_count()};
  p.percept_cap_Nm.fill(50.0);
  p.limit_Nm.fill(50.0);
  p.rate_Nm_per_s.fill(kRate);
  teleop::TorqueSlew slew(p);
  StepInputs in = inputs();
  in.velocity[0] = 0.5;
  core::JointArray before{};
  double least = 1e9, greatest = 0.0;
  for (int i = 0; i < 2000; ++i) {
    in.fingers.closed = i / 50 % 2 == 0 ? 0.0 : 1.0;  // as where gripper_state goes stale and comes back
    const StepOutputs out = sensed(in);
    least = std::min(least, out.drag.plus[0]);
    greatest = std::max(greatest, out.drag.plus[0]);
    const core::JointArray drag = out.percept.drag_torque;
    const core::JointArray felt = slew.step(drag, {}, in.velocity, kDt_s).motor_Nm;
    for (std::size_t j = 0; j < p.joint_count; ++j)
      ASSERT_LE(std::abs(felt[j] - before[j]), kRate * kDt_s + 1e-12) << i;
    before = felt;
  }
  EXPECT_GT(greatest - least, kRate * kDt_s) << "else there is no step to bound";
}

}  // namespace
}  // namespace phantom::phantom_sensing
