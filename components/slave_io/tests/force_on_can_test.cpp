// F_e and contact from the drives' torque: simulated drives that meet walls, on buses in this process.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "common/teleop/rendering/feedback_rendering.hpp"
#include "components/slave_io/can_arm.hpp"
#include "components/slave_io/tests/arm_bench.hpp"

namespace phantom::slave_io {
namespace {

using can::DriveMode;
using teleop::LinkState;

constexpr std::size_t kCount = 7, kElbow = 3;

/// The shipped drives, whose elbow meets a wall 0.1 rad from home. Their friction differs from the model's.
void with_wall(std::size_t j, simulated_drive::DriveOptions& options) {
  if (j == kElbow)
    options.motor.wall = {
        .at_rad = options.motor.start_rad + 0.1, .stiffness_Nm_per_rad = 5000.0, .damping_Nms_per_rad = 20.0};
}

struct WalledBench : ArmBench {
  explicit WalledBench(Config with = can_config())
      : ArmBench(std::move(with), shipped_arm().home, with_wall) {}

  /// The master leads a joint on at `speed` for `duration_s`.
  void lead(std::size_t j, double speed, double duration_s) {
    master.velocity[j] = speed;
    for (double t = 0; t < duration_s; t += config.period_s) {
      master.position[j] += speed * config.period_s;
      tick();
      ++ticks;
      felt_contact += last.contact ? 1 : 0;
      unmeasured += last.force_measured ? 0 : 1;
    }
    master.velocity[j] = 0.0;
  }
  double wall_Nm() const { return drives[kElbow]->motor().wall_torque_Nm(); }
  double soft(double torque_Nm) const {
    const double threshold_Nm = config.force_observer->threshold_Nm[kElbow];
    return torque_Nm - std::clamp(torque_Nm, -threshold_Nm, threshold_Nm);
  }
  /// What the elbow's friction at rest may hide, and the resolution of the drive's torque.
  double hidden_Nm() const { return drives[kElbow]->motor().parameters().joint.coulomb + 0.3; }

  int ticks = 0, felt_contact = 0, unmeasured = 0;
};

class ForceInEachMode : public testing::TestWithParam<DriveMode> {};

TEST_P(ForceInEachMode, FreeMotionIsNoContactAndAWallIsFeltAsItPushes) {
  WalledBench bench(can_config(GetParam()));
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  bench.run(0.1);
  bench.lead(0, 0.2, 0.5);
  bench.lead(1, 0.6, 0.5);
  bench.lead(1, -0.6, 0.5);
  bench.lead(kElbow, 0.15, 0.5);
  bench.lead(5, -0.5, 0.5);
  bench.run(0.5);
  EXPECT_EQ(bench.felt_contact, 0);
  EXPECT_EQ(bench.unmeasured, 0);
  EXPECT_EQ(bench.last.external_torque_Nm, core::JointArray{});
  EXPECT_EQ(bench.wall_Nm(), 0.0);

  bench.lead(kElbow, 0.2, 0.18);  // some 10 mrad into the wall
  bench.run(1.0);
  EXPECT_LT(bench.wall_Nm(), -15.0);
  EXPECT_TRUE(bench.last.contact);
  EXPECT_EQ(bench.last.contact_force_N, -1.0) << "torques say nothing of where it is";
  EXPECT_EQ(bench.last.contact_object, 0);
  for (std::size_t j = 0; j < kCount; ++j) {
    const double expected_Nm = j == kElbow ? bench.soft(bench.wall_Nm()) : 0.0;
    EXPECT_NEAR(bench.last.external_torque_Nm[j], expected_Nm, j == kElbow ? bench.hidden_Nm() : 0.0) << j;
  }
  bench.lead(kElbow, -0.2, 0.5);
  bench.run(0.5);
  EXPECT_FALSE(bench.last.contact);
  EXPECT_EQ(bench.last.external_torque_Nm[kElbow], 0.0);
}

TEST_P(ForceInEachMode, SR22_PressesOnAWallNoHarderThanItMay) {
  constexpr double kBound_Nm = 20.0;
  const auto bounded_by = [](double bound_Nm) {
    Config config = can_config(GetParam());
    config.contact_limit.torque_Nm.fill(bound_Nm);
    return config;
  };
  WalledBench unbounded(bounded_by(0.0));
  ASSERT_TRUE(unbounded.reaches(LinkState::kCoupled)) << unbounded.arm->health().message;
  double greatest_Nm = 0.0;
  for (int i = 0; i < 100; ++i) {  // 0.1 rad into the wall, unless a drive gives up
    unbounded.lead(kElbow, 0.2, 0.01);
    greatest_Nm = std::max(greatest_Nm, -unbounded.wall_Nm());
  }
  EXPECT_GT(greatest_Nm, 1.5 * kBound_Nm);

  WalledBench bench(bounded_by(kBound_Nm));
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  bench.lead(kElbow, 0.2, 1.0);
  bench.run(2.0);
  EXPECT_EQ(bench.last.outputs.pressing_joint, static_cast<int>(kElbow));
  // The observer's threshold softens what is felt, and friction at rest hides some of it.
  const double unfelt_Nm = bench.config.force_observer->threshold_Nm[kElbow] + bench.hidden_Nm();
  EXPECT_LT(-bench.wall_Nm(), kBound_Nm + unfelt_Nm + 1.0);
  EXPECT_GT(-bench.wall_Nm(), kBound_Nm - 1.0);
  bench.lead(kElbow, -0.2, 1.0);
  bench.run(0.5);
  EXPECT_EQ(bench.wall_Nm(), 0.0) << "it comes away";
}

INSTANTIATE_TEST_SUITE_P(Modes, ForceInEachMode,
                         testing::Values(DriveMode::kTorque, DriveMode::kVelocity, DriveMode::kPosition));

/// How hard the wall is pressed after the elbow was led 0.1 rad into it, with a gauge that bears 15 N there.
/// The arm does not know what it touches.
double pressed_Nm_with_gauge_at(const geometry::Pose& X_WO, SlaveOutputs& out) {
  Config config = can_config();
  config.contact_limit.torque_Nm.fill(0.0);
  const Eigen::Vector3d half_m = Eigen::Vector3d::Constant(0.05);
  config.object_bounds = {{3, "gauge", 15.0, 0.0, {-half_m, half_m}, X_WO}};
  config.link_boxes = link_boxes(shipped_arm().arm, shipped_arm().skin, 0.005);
  WalledBench bench(std::move(config));
  EXPECT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  double greatest_Nm = 0.0;
  for (int i = 0; i < 100; ++i) {
    bench.lead(kElbow, 0.2, 0.01);
    greatest_Nm = std::max(greatest_Nm, -bench.wall_Nm());
    if (bench.last.outputs.pressing_object) out = bench.last.outputs;
  }
  return greatest_Nm;
}

TEST(ForceOnCan, SR22_WhatItMayTouchBoundsTheForce) {
  robot::LinkPoses X_WL;
  shipped_arm().arm.link_poses(shipped_arm().home, X_WL);
  const geometry::Pose at_tool{Eigen::Matrix3d::Identity(), X_WL[kCount].translation_m};
  geometry::Pose elsewhere = at_tool;
  elsewhere.translation_m.z() -= 5.0;
  SlaveOutputs near, far;
  const double bounded_Nm = pressed_Nm_with_gauge_at(at_tool, near);
  const double unbounded_Nm = pressed_Nm_with_gauge_at(elsewhere, far);
  EXPECT_LT(bounded_Nm, 0.6 * unbounded_Nm);
  ASSERT_TRUE(near.pressing_object);
  EXPECT_EQ(near.pressed_object, 3);
  EXPECT_FALSE(near.touches_it) << "torques do not tell what it is";
  EXPECT_FALSE(far.pressing_object);
}

// Cycle by cycle F_e is the wall's torque behind the observer's low-pass, now or as old as is stated at most.
TEST(ForceOnCan, LagsTheWallAsStated) {
  for (const int measure_every : {1, 4}) {
    Config config = can_config();
    config.can->group.timing.measure_every = measure_every;
    config.force_observer->lag_s = 0.02;
    WalledBench bench(config);
    ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
    bench.run(0.2);
    const double lag_s = config.force_observer->lag_s;
    const auto cycles = std::llround((force_lag_s(config) - lag_s) / config.period_s);
    std::deque<double> expected_Nm(1, 0.0);  // the newest last
    double low_pass_Nm = 0.0, worst_Nm = 0.0, most_Nm = 0.0;
    for (const double speed : {0.25, 0.0, -0.25}) {
      bench.master.velocity[kElbow] = speed;
      for (double t = 0; t < 0.5; t += config.period_s) {
        low_pass_Nm += config.period_s / (lag_s + config.period_s) * (bench.wall_Nm() - low_pass_Nm);
        expected_Nm.push_back(bench.soft(low_pass_Nm));
        if (expected_Nm.size() > static_cast<std::size_t>(cycles) + 1) expected_Nm.pop_front();
        bench.master.position[kElbow] += speed * config.period_s;
        bench.tick();
        const auto [least, most] = std::minmax_element(expected_Nm.begin(), expected_Nm.end());
        const double felt_Nm = bench.last.external_torque_Nm[kElbow];
        worst_Nm = std::max({worst_Nm, *least - felt_Nm, felt_Nm - *most});
        most_Nm = std::max(most_Nm, -low_pass_Nm);
      }
    }
    EXPECT_EQ(cycles, measure_every);
    EXPECT_GT(most_Nm, 50.0);
    // What the drive's torque does between two measurements is not known.
    const double between_Nm = (measure_every - 1) * config.period_s * 0.25 * 5000.0;
    EXPECT_LT(worst_Nm, 0.02 * most_Nm + bench.hidden_Nm() + between_Nm) << measure_every;
  }
}

// One answer may come late; a drive that leaves more of them out makes the force unknown, not old.
// Tries slave_io: a drive leaves more than one cycle unanswered
TEST(ForceOnCan, ADriveThatLeavesCyclesUnansweredMakesItUnknown) {
  WalledBench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  bench.run(0.2);
  bench.lead(kElbow, 0.25, 0.45);
  bench.run(0.3);
  ASSERT_TRUE(bench.last.force_measured && bench.last.contact);
  for (int cycles = 1; cycles <= 3; ++cycles) {
    bench.frozen[5] = true;
    for (int i = 0; i < cycles; ++i) bench.tick();
    bench.frozen[5] = false;
    bench.tick();
    EXPECT_EQ(bench.last.force_measured, cycles == 1) << cycles;
    EXPECT_EQ(bench.last.contact, cycles == 1) << cycles;
    EXPECT_EQ(bench.last.external_torque_Nm[kElbow] == 0.0, cycles > 1) << cycles;
    bench.run(0.3);
    EXPECT_TRUE(bench.last.force_measured && bench.last.contact) << cycles;
    EXPECT_NEAR(bench.last.external_torque_Nm[kElbow], bench.soft(bench.wall_Nm()), bench.hidden_Nm());
  }
  EXPECT_EQ(bench.state(), LinkState::kCoupled);
}

// Tries slave_io: does not follow
TEST(ForceOnCan, NothingIsKnownWhileTheDrivesDoNotFollow) {
  WalledBench bench;
  bench.heard = false;  // so that there is no power
  for (int i = 0; i < 1000; ++i) {
    bench.tick();
    ASSERT_FALSE(bench.last.force_measured);
  }
  bench.heard = true;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  bench.run(0.2);
  ASSERT_TRUE(bench.last.force_measured);
  bench.inbox.stops.stop();
  bench.run(0.1);
  EXPECT_FALSE(bench.last.force_measured || bench.last.contact);
}

// The laws that need F_e, as master_io renders them.
TEST(ForceOnCan, LawsCAndEPushTheHandBackFromTheWall) {
  for (const auto law : {teleop::BilateralLaw::kPfff, teleop::BilateralLaw::kPeff}) {
    teleop::FeedbackParameters parameters{.joint_count = kCount, .law = law};
    parameters.inverse_a[static_cast<std::size_t>(law)] = teleop::everywhere(0.05);
    parameters.torque_cap_Nm = teleop::everywhere(4.0);
    parameters.passivity.joint_count = kCount;
    parameters.passivity.enabled = false;
    teleop::FeedbackRenderer renderer(parameters);
    WalledBench bench;
    ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
    bench.run(0.2);
    teleop::RenderedFeedback felt;
    double free_Nm = 0.0;
    for (int i = 0; i < 400; ++i) {
      bench.lead(kElbow, i < 250 ? 0.25 : 0.0, bench.config.period_s);
      felt = renderer.step({.law = law,
                            .coupled = true,
                            .contact = bench.last.contact,
                            .force_measured = bench.last.force_measured,
                            .effort = {bench.last.loop_torque_Nm, bench.last.external_torque_Nm}},
                           bench.config.period_s);
      EXPECT_FALSE(felt.force_missing);
      if (bench.wall_Nm() == 0.0) free_Nm = std::max(free_Nm, std::abs(felt.torque_Nm[kElbow]));
    }
    EXPECT_EQ(free_Nm, 0.0);
    EXPECT_NEAR(felt.torque_Nm[kElbow], 0.05 * bench.soft(bench.wall_Nm()), 0.05 * bench.hidden_Nm());
    EXPECT_LT(felt.torque_Nm[kElbow], -1.0);
  }
}

TEST(ForceOnCan, StatusSaysLagAndThreshold) {
  WalledBench bench;
  const auto figures = bench.arm->health().figures;
  const auto of = [&](const std::string& name) {
    return std::find_if(figures.begin(), figures.end(), [&](const auto& f) { return f.name == name; })->value;
  };
  EXPECT_DOUBLE_EQ(of("force_lag"), 0.012);
  EXPECT_DOUBLE_EQ(of("force_threshold"), 0.05);
}

}  // namespace
}  // namespace phantom::slave_io
