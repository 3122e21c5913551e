#include "common/teleop/rendering/reaction_rendering.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "common/teleop/rendering/feedback_rendering.hpp"
#include "common/teleop/tests/period.hpp"

namespace phantom::teleop::reaction_rendering_test {
namespace {

ReactionParameters one_joint() {
  ReactionParameters p{.joint_count = 1};
  p.stiffness_limit[0] = 1000.0;
  return p;
}

/// A body that fills q > 0: 100 N·m/rad.
robot::JointReaction wall(double q, double stiffness = 100.0) {
  robot::JointReaction reaction;
  reaction.position[0] = q;
  if (q > 0.0) reaction.torque[0] = -stiffness * q, reaction.stiffness[0] = stiffness;
  return reaction;
}

double settle(ReactionRenderer& renderer, const robot::JointReaction& reaction, double q, bool fresh = true) {
  core::JointArray torque{};
  for (int i = 0; i < 1000; ++i) torque = renderer.step(reaction, fresh, {q}, kDt);
  return torque[0];
}

TEST(ReactionRendering, TheSpringIsClosedAtTheMastersOwnPosition) {
  ReactionRenderer renderer(one_joint());
  EXPECT_NEAR(settle(renderer, wall(0.01), 0.01), -1.0, 1e-9);
  EXPECT_NEAR(renderer.step(wall(0.01), true, {0.013}, kDt)[0], -1.3, 1e-9) << "at once";
  EXPECT_NEAR(renderer.step(wall(0.01), true, {0.002}, kDt)[0], -0.2, 1e-9);
  EXPECT_EQ(renderer.step(wall(0.01), true, {-0.002}, kDt)[0], 0.0) << "a body does not pull in";
}

TEST(ReactionRendering, GainAndStiffnessLimitHold) {
  auto p = one_joint();
  p.gain = 2.0;
  p.stiffness_limit[0] = 50.0;
  ReactionRenderer renderer(p);
  EXPECT_NEAR(settle(renderer, wall(0.01), 0.01), -2.0, 1e-9);
  EXPECT_NEAR(renderer.step(wall(0.01), true, {0.012}, kDt)[0], -2.0 - 50.0 * 0.002, 1e-9);
}

TEST(ReactionRendering, StaleOrUnsoundItFadesOutWithoutAJump) {
  const double bad = std::numeric_limits<double>::quiet_NaN();
  auto no_torque = wall(0.01), no_place = wall(0.01), no_stiffness = wall(0.01);
  no_torque.torque[0] = bad, no_place.position[0] = bad, no_stiffness.stiffness[0] = -1.0;
  for (const auto& given : {wall(0.01), no_torque, no_place, no_stiffness}) {
    ReactionRenderer renderer(one_joint());
    double before = settle(renderer, wall(0.01), 0.01);
    const bool fresh =
        given.torque[0] != wall(0.01).torque[0] || given.position[0] != 0.01 || given.stiffness[0] < 0;
    for (int i = 0; i < 101; ++i) {
      const double now = renderer.step(given, fresh, {0.01}, kDt)[0];
      ASSERT_LE(std::abs(now - before), 1.1 * 1.0 * kDt / 0.1);
      before = now;
    }
    EXPECT_EQ(before, 0.0);
  }
}

TEST(ReactionRendering, NothingSoftIsPressedAndNothingIsFelt) {
  ReactionRenderer renderer(one_joint());
  EXPECT_EQ(settle(renderer, wall(-0.1), 0.3), 0.0);
}

TEST(ReactionRendering, ABodyThatIsReachedComesInOverTheSmoothingTime) {
  ReactionRenderer renderer(one_joint());
  settle(renderer, wall(-0.001), -0.001);
  const double first = renderer.step(wall(0.01), true, {0.01}, kDt)[0];
  EXPECT_LT(first, 0.0);
  EXPECT_GT(first, -0.5);
}

/// A free mass between two soft walls, whose reactions come over a network that is late both ways; it is felt
/// through the feedback with its passivity guard, as on the master.
double most_energy_J(double stiffness, int late_ticks, bool guard) {
  constexpr double kMass = 0.05, kGap_rad = 0.02, kAllowance_J = 0.002;
  auto p = one_joint();
  p.ramp_up_s = p.ramp_down_s = 1e-3;
  ReactionRenderer renderer(p);
  FeedbackParameters f{.joint_count = 1, .law = BilateralLaw::kPf};
  f.torque_cap_Nm[0] = 100.0;
  f.ramp_up_s = 1e-3;
  f.passivity = {.joint_count = 1, .enabled = guard, .allowance_J = {kAllowance_J}, .store_J = {0.02}};
  f.passivity.damping_limit[0] = 10.0;
  FeedbackRenderer feedback(f);
  double q = 0.0, v = 0.5, most = 0.0;
  std::deque<double> on_the_way(static_cast<std::size_t>(late_ticks), 0.0);
  for (int i = 0; i < 10000; ++i) {
    on_the_way.push_back(q);
    const double slave = on_the_way.front();
    on_the_way.pop_front();
    robot::JointReaction reaction;
    reaction.position[0] = slave;
    if (std::abs(slave) > kGap_rad) {
      reaction.torque[0] = -stiffness * (slave - std::copysign(kGap_rad, slave));
      reaction.stiffness[0] = stiffness;
    }
    FeedbackInputs in{.law = BilateralLaw::kPf, .coupled = true};
    in.master.position[0] = q;
    in.master.velocity[0] = v;
    in.reaction_Nm = renderer.step(reaction, true, {q}, kDt);
    const double torque = feedback.step(in, kDt).torque_Nm[0];
    v += kDt * torque / kMass;
    q += kDt * v;
    if (std::abs(q) < kGap_rad) most = std::max(most, 0.5 * kMass * v * v);
  }
  return most;
}

TEST(ReactionRendering, LateSoftWallsGiveTheHandNoMoreThanTheGuardsAllowance) {
  const double start_J = 0.5 * 0.05 * 0.25;
  for (const double stiffness : {20.0, 100.0, 300.0}) {
    EXPECT_LE(most_energy_J(stiffness, 10, true), start_J + 0.002 + 0.15 * start_J) << stiffness;
  }
  EXPECT_GT(most_energy_J(100.0, 10, false), 2.0 * start_J) << "without the guard the walls would drive it";
}

}  // namespace
}  // namespace phantom::teleop::reaction_rendering_test
