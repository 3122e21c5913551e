#include "common/teleop/coupling/cartesian_hand.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/robot/tests/test_arms.hpp"
#include "common/teleop/rendering/wrench_slew.hpp"
#include "common/teleop/tests/period.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

using robot::test_arms::suspended;

constexpr core::JointArray kBent{0.0, 0.4, 0.5, 0.9, 0.3, 0.8, -0.2};

CartesianHandParameters led_hand() {
  CartesianHandParameters p;
  p.map = {.joint_count = 7, .mass_kg = 1.0, .inertia_kg_m2 = 0.02};
  p.map.inertia = {0.3, 0.006, 0.006, 0.006, 0.003, 0.003, 0.002};
  p.max_speed = {0.4, 1.2, 1.2, 1.2, 1.4, 1.4, 1.5};
  return p;
}

/// A hand that moves as it is asked to, with its pose true to its twist.
struct Rig {
  explicit Rig(const CartesianHandParameters& chosen = led_hand(), const core::JointArray& start = kBent)
      : p(chosen), hand(arm, p, start) {
    state.valid = state.clutch = true;
  }

  void tick(const Spatial& twist, const core::JointArray& torque_Nm = {}) {
    state.twist = twist;
    before = hand.position();
    {
      const test::HeapGuard guard;
      hand.sense(state, view ? &*view : nullptr);
      wrench = hand.wrench(torque_Nm);
    }
    velocity = hand.velocity();
    power_at_joints_W = 0.0;
    for (std::size_t j = 0; j < 7; ++j) power_at_joints_W += torque_Nm[j] * velocity[j];
    const test::HeapGuard guard;
    hand.advance(coupled, kDt);
    state.pose.translation_m += kDt * twist.head<3>();
    state.pose.rotation = geometry::rotation_from_vector(kDt * twist.tail<3>()) * state.pose.rotation;
  }
  void run(double duration_s, const Spatial& twist) {
    for (double t = 0; t < duration_s; t += kDt) tick(twist);
  }

  robot::SerialArm arm = suspended();
  CartesianHandParameters p;
  CartesianHand hand;
  HandState state;
  std::optional<Eigen::Matrix3d> view;
  bool coupled = true;
  Spatial wrench = Spatial::Zero();
  core::JointArray velocity{}, before{};
  double power_at_joints_W = 0.0;
};

Spatial twist(double x, double y, double z, double roll = 0.0, double pitch = 0.0, double yaw = 0.0) {
  Spatial v;
  v << x, y, z, roll, pitch, yaw;
  return v;
}

/// Smooth wandering of a hand, fast enough to meet every limit.
struct Wanderer {
  std::mt19937 random{11};
  std::array<double, 12> phase{};
  Wanderer() {
    for (double& one : phase) one = std::uniform_real_distribution(0.0, 6.28)(random);
  }
  Spatial at(double t) const {
    Spatial v;
    for (std::size_t i = 0; i < 6; ++i)
      v[static_cast<int>(i)] =
          (i < 3 ? 0.35 : 0.9) * (std::sin(0.7 * (1.0 + 0.21 * static_cast<double>(i)) * t + phase[i]) +
                                  0.5 * std::sin(2.3 * t + phase[i + 6]));
    return v;
  }
};

TEST(CartesianHand, ToolFollowsTheHandScaledAndTheHandFeelsTheTransposedInverse) {
  auto p = led_hand();
  p.scale = 1.5;
  p.rotation_scale = 0.5;
  Rig rig(p);
  rig.run(0.2, Spatial::Zero());
  const auto start = rig.hand.tool_pose();
  ASSERT_GE(rig.hand.least_followed(), 1.0);
  for (int i = 0; i < 200; ++i) rig.tick(twist(0.05, -0.02, 0.03, 0.1, 0.0, -0.2));
  rig.run(2.0, Spatial::Zero());
  const auto R_WB = rig.arm.base_pose().rotation;
  const Eigen::Vector3d moved = rig.hand.tool_pose().translation_m - start.translation_m;
  EXPECT_LT((moved - 0.2 * 1.5 * (R_WB * Eigen::Vector3d(0.05, -0.02, 0.03))).norm(), 2e-5);
  const Eigen::Vector3d turned =
      geometry::rotation_vector(rig.hand.tool_pose().rotation * start.rotation.transpose());
  EXPECT_LT((turned - 0.2 * 0.5 * (R_WB * Eigen::Vector3d(0.1, 0.0, -0.2))).norm(), 2e-5);
}

// The J⁻ᵀ: with as many joints as directions, away from singularities and limits, exactly that.
TEST(CartesianHand, WrenchIsThatOfTheInverseTransposedJacobian) {
  Rig rig;
  rig.run(0.3, Spatial::Zero());
  robot::LinkPoses X_WL;
  rig.arm.link_poses(rig.hand.position(), X_WL);
  const robot::Jacobian J = robot::tool_jacobian(rig.arm, X_WL);
  // Torques that a wrench at the tool makes on the joints.
  const Spatial at_tool = twist(3.0, -1.0, 2.0, 0.1, -0.2, 0.15);
  core::JointArray torque{};
  for (int j = 0; j < 7; ++j) torque[static_cast<std::size_t>(j)] = J.col(j).dot(at_tool);
  rig.tick(Spatial::Zero(), torque);
  const auto R = rig.hand.rotation();
  EXPECT_LT((R * rig.wrench.head<3>() - at_tool.head<3>()).norm(), 1e-9);
  EXPECT_LT((R * rig.wrench.tail<3>() - at_tool.tail<3>()).norm(), 1e-9);
}

struct Wandering : testing::TestWithParam<HandFrame> {};
INSTANTIATE_TEST_SUITE_P(Frames, Wandering,
                         testing::Values(HandFrame::kBase, HandFrame::kView, HandFrame::kTool));

// The key property, wherever the hand drags the arm: through singular poses, onto limits, with the clutch in
// and out.
TEST_P(Wandering, PowerAtTheHandIsPowerAtTheJointsAndNothingJumps) {
  auto p = led_hand();
  p.frame = GetParam();
  p.R_FD = geometry::rotation_from_rpy(0.2, 1.1, -0.4);
  p.scale = 1.4;
  Rig rig(p);
  Wanderer wanderer;
  std::mt19937& random = wanderer.random;
  core::JointArray torque{};
  int at_limit = 0, singular = 0, slowed = 0, faded = 0, out = 0;
  Spatial before = Spatial::Zero();
  const WrenchSlewParameters rates{
      .force_cap_N = 20.0, .moment_cap_N_m = 1.0, .force_rate_N_per_s = 1000.0, .moment_rate_Nm_per_s = 50.0};
  WrenchSlew slew(rates);
  for (int i = 0; i < 240'000; ++i) {
    if (random() % 700 == 0) rig.state.clutch = !rig.state.clutch || random() % 2 == 0;
    if (random() % 4000 == 0) rig.coupled = !rig.coupled || random() % 2 == 0;
    if (random() % 100 == 0)
      rig.view = geometry::rotation_from_rpy(0.1 * static_cast<double>(random() % 60), 0.3, 0.0);
    // Torques change as a slew limit lets them.
    for (std::size_t j = 0; j < 7; ++j)
      torque[j] =
          2.0 * std::sin(0.9 * (1.0 + 0.3 * static_cast<double>(j)) * i * kDt + static_cast<double>(j));
    rig.tick(wanderer.at(i * kDt), torque);
    const double scale_W = rig.wrench.norm() * rig.state.twist.norm() + 1.0;
    ASSERT_NEAR(rig.wrench.dot(rig.state.twist), rig.power_at_joints_W, 1e-12 * scale_W) << i;
    bool limit = false;
    for (std::size_t j = 0; j < 7; ++j) {
      const auto& joint = rig.arm.joints()[j];
      ASSERT_LE(std::abs(rig.hand.position()[j] - rig.before[j]), p.max_speed[j] * kDt * (1 + 1e-9)) << i;
      ASSERT_GE(rig.hand.position()[j], joint.lower) << i;
      ASSERT_LE(rig.hand.position()[j], joint.upper) << i;
      limit = limit ||
              std::min(rig.hand.position()[j] - joint.lower, joint.upper - rig.hand.position()[j]) < 0.01;
    }
    at_limit += limit;
    singular += rig.hand.least_followed() < 0.1;
    slowed += rig.hand.speed_share() < 0.99;
    out += rig.hand.authority() == 0.0;
    faded += rig.hand.authority() > 0.0 && rig.hand.authority() < 1.0;
    // The last stage before the motors: what the clamp of a joint on its limit changes within a tick comes at
    // the rate, or falls.
    const Spatial felt = slew.step(rig.wrench, rig.state.twist, kDt), change = felt - before;
    ASSERT_LE(felt.dot(rig.state.twist), std::max(0.0, rig.power_at_joints_W) + 1e-9) << i;
    const bool rated = change.head<3>().norm() <= rates.force_rate_N_per_s * kDt + 1e-9 &&
                       change.tail<3>().norm() <= rates.moment_rate_Nm_per_s * kDt + 1e-9;
    if (!rated) {
      ASSERT_GT(before.dot(rig.state.twist), -0.1) << "only what would push falls";
      ASSERT_LE(felt.norm(), before.norm() + rates.force_rate_N_per_s * kDt) << i;
    }
    before = felt;
  }
  EXPECT_GT(at_limit, 2000);
  EXPECT_GT(singular, 2000);
  EXPECT_GT(slowed, 2000);
  EXPECT_GT(faded, 2000);
  EXPECT_GT(out, 2000);
}

TEST(CartesianHand, NothingMovesAndNothingIsFeltWhileTheClutchIsOut) {
  Rig rig;
  rig.run(0.5, twist(0.05, 0.0, 0.0));
  rig.state.clutch = false;
  core::JointArray torque{};
  torque.fill(1.0);
  for (int i = 0; i < 200; ++i) rig.tick(twist(-0.1, 0.0, 0.0, 0.0, 0.3), torque);
  const auto there = rig.hand.position();
  for (int i = 0; i < 500; ++i) {
    rig.tick(twist(-0.1, 0.0, 0.0, 0.0, 0.3), torque);
    ASSERT_EQ(rig.hand.position(), there);
    ASSERT_EQ(rig.wrench.norm(), 0.0);
  }
  // In again, elsewhere: the tool goes on from where it is, and does what the hand does from here on.
  rig.state.clutch = true;
  const auto before = rig.hand.tool_pose();
  rig.run(0.3, Spatial::Zero());
  EXPECT_LT((rig.hand.tool_pose().translation_m - before.translation_m).norm(), 1e-9);
  rig.run(0.5, twist(0.0, 0.04, 0.0));
  EXPECT_NEAR((rig.hand.tool_pose().translation_m - before.translation_m).norm(), 0.02, 2e-4);
}

TEST(CartesianHand, ARoundTripOfTheHandIsOneOfTheTool) {
  Rig rig;
  rig.run(0.3, Spatial::Zero());
  const auto start = rig.hand.tool_pose();
  for (int i = 0; i < 60'000; ++i) {
    const double angle = 2.0 * std::numbers::pi * i * kDt / 3.0;
    rig.tick(twist(0.2 * std::cos(angle), 0.2 * std::sin(angle), 0.0, 0.0, 0.3 * std::sin(angle), 0.0));
  }
  rig.run(2.0, Spatial::Zero());
  const Eigen::Vector3d hand = rig.arm.base_pose().rotation * rig.state.pose.translation_m;
  EXPECT_LT((rig.hand.tool_pose().translation_m - start.translation_m - hand).norm(), 1e-5)
      << "no drift after twenty rounds";
}

TEST(CartesianHand, AJointAtItsLimitLeavesTheWorkToTheOthersAndComesBackAtOnce) {
  core::JointArray start = kBent;
  start[0] = 0.4;
  Rig rig(led_hand(), start);
  rig.run(0.3, Spatial::Zero());
  const auto begin = rig.hand.tool_pose();
  rig.run(2.0, twist(0.1, 0.0, 0.0));
  const auto end = rig.hand.position();
  EXPECT_GT(end[0], 0.435);
  const Eigen::Vector3d wanted = rig.arm.base_pose().rotation * Eigen::Vector3d(0.2, 0.0, 0.0);
  EXPECT_LT((rig.hand.tool_pose().translation_m - begin.translation_m - wanted).norm(), 0.02)
      << "the others carry the tool on";
  const auto there = rig.hand.tool_pose();
  double back_s = 0.0;
  while (rig.hand.position()[0] > end[0] - 0.002 && back_s < 1.0) {
    rig.tick(twist(-0.1, 0.0, 0.0));
    back_s += kDt;
  }
  EXPECT_LT(back_s, 0.25) << "nothing was wound up";
  EXPECT_GT((rig.hand.tool_pose().translation_m - there.translation_m).norm(), 1e-3);
}

TEST(CartesianHand, TheViewIsTakenAsTheClutchGoesIn) {
  auto p = led_hand();
  p.frame = HandFrame::kView;
  Rig rig(p);
  rig.coupled = false;
  rig.view = geometry::rotation_from_rpy(0.0, 0.0, std::numbers::pi / 2);
  rig.run(0.1, Spatial::Zero());
  rig.coupled = true;
  rig.run(0.3, Spatial::Zero());
  auto before = rig.hand.tool_pose();
  rig.run(0.5, twist(0.04, 0.0, 0.0));
  EXPECT_LT(
      (rig.hand.tool_pose().translation_m - before.translation_m - Eigen::Vector3d(0.0, 0.02, 0.0)).norm(),
      1e-4);
  rig.view = Eigen::Matrix3d::Identity();
  before = rig.hand.tool_pose();
  rig.run(0.5, twist(0.04, 0.0, 0.0));
  EXPECT_LT(
      (rig.hand.tool_pose().translation_m - before.translation_m - Eigen::Vector3d(0.0, 0.02, 0.0)).norm(),
      1e-4)
      << "a view that turns does not turn the motion in hand";
  rig.state.clutch = false;
  rig.run(0.3, Spatial::Zero());
  rig.state.clutch = true;
  rig.run(0.3, Spatial::Zero());
  before = rig.hand.tool_pose();
  rig.run(0.5, twist(0.04, 0.0, 0.0));
  EXPECT_LT(
      (rig.hand.tool_pose().translation_m - before.translation_m - Eigen::Vector3d(0.02, 0.0, 0.0)).norm(),
      1e-4);
}

TEST(CartesianHand, AlongTheToolMeansAlongTheTool) {
  auto p = led_hand();
  p.frame = HandFrame::kTool;
  Rig rig(p);
  rig.run(0.3, Spatial::Zero());
  const auto before = rig.hand.tool_pose();
  rig.run(0.5, twist(0.0, 0.0, -0.04));
  const Eigen::Vector3d moved =
      before.rotation.transpose() * (rig.hand.tool_pose().translation_m - before.translation_m);
  EXPECT_LT((moved - Eigen::Vector3d(0.0, 0.0, -0.02)).norm(), 1e-4);
}

TEST(CartesianHand, WithoutOrientationTheHandTurnsFreelyAndFeelsNoMoment) {
  auto p = led_hand();
  p.map.orientation = false;
  Rig rig(p);
  rig.run(0.3, Spatial::Zero());
  const auto before = rig.hand.tool_pose();
  core::JointArray torque{};
  torque.fill(0.5);
  for (int i = 0; i < 500; ++i) rig.tick(twist(0.0, 0.04, 0.0, 1.0, -2.0, 1.0), torque);
  const Eigen::Vector3d wanted = rig.arm.base_pose().rotation * Eigen::Vector3d(0.0, 0.02, 0.0);
  EXPECT_LT((rig.hand.tool_pose().translation_m - before.translation_m - wanted).norm(), 1e-4);
  EXPECT_EQ(rig.wrench.tail<3>().norm(), 0.0);
}

TEST(CartesianHand, MeetsTheSlaveAtNoMoreThanItsSpeed) {
  Rig rig;
  rig.coupled = false;
  core::JointArray slave = kBent;
  slave[0] = 0.3;
  slave[3] = 0.1;
  for (int i = 0; i < 2000; ++i) {
    const auto before = rig.hand.position();
    rig.hand.sense(rig.state, nullptr);
    rig.hand.meet(slave, kDt);
    for (std::size_t j = 0; j < 7; ++j)
      ASSERT_LE(std::abs(rig.hand.position()[j] - before[j]), rig.p.max_speed[j] * kDt + 1e-12);
  }
  for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(rig.hand.position()[j], slave[j], 1e-9);
}

// Tries master_io: that of a Cartesian master
TEST(CartesianHand, NumbersThatAreNoneAndAHandThatIsGoneMoveNothing) {
  Rig rig;
  rig.run(0.5, twist(0.05, 0.0, 0.0));
  const auto there = rig.hand.position();
  for (int i = 0; i < 300; ++i) {
    rig.tick(twist(i % 2 == 0 ? std::nan("") : 1e301, 0.0, 0.0));
    rig.state.pose = {};
  }
  for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(rig.hand.position()[j], there[j], 2e-3);
  rig.state.valid = false;
  rig.run(0.3, twist(0.1, 0.0, 0.0));
  EXPECT_EQ(rig.hand.authority(), 0.0);
}

}  // namespace
}  // namespace phantom::teleop
