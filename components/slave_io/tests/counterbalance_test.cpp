// Rows b1 and b2 of Table 6.1 in closed loop: what stands in F_as of an arm that no counterweights balance,
// with and without automatic counterbalancing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/robot/kinematics/arm_dynamics.hpp"
#include "common/simulation/tests/half_space.hpp"
#include "common/teleop/tests/servo_rig.hpp"
#include "components/slave_io/servo.hpp"
#include "components/slave_io/simulated_arm.hpp"
#include "components/slave_io/tests/arm_bench.hpp"
#include "components/slave_io/tests/fixture.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::slave_io {
namespace {

using teleop::Counterbalance;
using teleop::LinkState;
constexpr double kTick_s = 0.001;
constexpr std::size_t kJointsOfArm = 7;

Config heavy_config(bool counterbalanced) {
  Config config = shipped_config();
  config.plant.balanced = false;
  config.gravity_feed_forward = counterbalanced;
  return config;
}

double potential_J(const robot::SerialArm& arm, const core::JointArray& q) {
  robot::LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  double energy_J = 0.0;
  for (std::size_t link = 0; link < arm.links().size(); ++link) {
    const auto& body = arm.links()[link];
    energy_J += 9.80665 * body.mass_kg * (X_WL[link] * body.centre_of_mass_m).z();
  }
  return energy_J;
}

/// The torques that hold the arm: the gradient of its potential energy, by finite differences.
core::JointArray weight_at(const core::JointArray& q) {
  constexpr double kStep = 1e-5;
  core::JointArray torque_Nm{};
  for (std::size_t j = 0; j < kJointsOfArm; ++j) {
    core::JointArray above = q, below = q;
    above[j] += kStep;
    below[j] -= kStep;
    torque_Nm[j] =
        (potential_J(shipped_arm().arm, above) - potential_J(shipped_arm().arm, below)) / (2 * kStep);
  }
  return torque_Nm;
}

ArmModel standing_at(const core::JointArray& q) {
  ArmModel model = shipped_arm();
  model.home = q;
  return model;
}

/// The shipped arm in water, with links as heavy as aluminium.
ArmModel in_water() {
  ArmModel model = shipped_arm();
  robot::MediumRegion water;
  water.density_kg_per_m3 = 1000.0;
  robot::DisplacedParts parts;
  for (std::size_t link = 1; link <= kJointsOfArm; ++link) {
    const robot::Link& body = model.arm.links()[link];
    parts[link] = {{body.centre_of_mass_m, body.mass_kg / 2700.0, 0.1}};
  }
  model.buoyancy = {parts, {water}};
  return model;
}

/// The servo with an arm whose weight acts, and a master that leads it from `start`.
struct HeavyRig : teleop::ServoRig<Inbox, SlaveReport> {
  explicit HeavyRig(const Config& with, const core::JointArray& start = shipped_arm().home)
      : HeavyRig(with, standing_at(start)) {}
  HeavyRig(const Config& with, ArmModel arm_model) : config(with), model(std::move(arm_model)) {
    const core::JointArray& start = model.home;
    master.position = start;
    master.state = LinkState::kCoupled;
  }
  void tick() {
    now_ns += core::from_seconds(kTick_s);
    renew(master);
    inbox.master.write(master);
    ServoRig::tick(servo, kTick_s);
  }
  void run(double duration_s) {
    for (double t = 0; t < duration_s; t += kTick_s) tick();
  }
  /// What friction may hold of a joint that rests.
  double rest_Nm(std::size_t j) const {
    return config.plant.joints[j].coulomb + 0.003 * shipped_arm().arm.joints()[j].max_effort;
  }
  /// The same of one that moves, with what accelerates it.
  double moving_Nm(std::size_t j) const {
    const auto& joint = config.plant.joints[j];
    return joint.coulomb + joint.viscous * std::abs(last.velocity[j]) +
           0.02 * shipped_arm().arm.joints()[j].max_effort;
  }

  Config config;
  ArmModel model;
  simulation::HalfSpace floor{Eigen::Vector3d::UnitZ(), -50.0};
  SimulatedArm arm{model, config, floor};
  Servo servo{model, config, arm, inbox, 1, stops};
  MasterSample master;
};

/// Poses all over the arm's joint space.
std::vector<core::JointArray> poses(std::size_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0.1, 0.9);
  std::vector<core::JointArray> all(count);
  for (core::JointArray& q : all) {
    for (std::size_t j = 0; j < kJointsOfArm; ++j) {
      const auto& joint = shipped_arm().arm.joints()[j];
      q[j] = joint.lower + share(random) * (joint.upper - joint.lower);
    }
  }
  return all;
}

TEST(Counterbalance, ItsWeightIsFeltOverTheWholeWorkspaceAndCounterbalancedItIsNot) {
  double greatest_Nm = 0.0, left = 0.0, most_moved = 0.0;
  for (const core::JointArray& q : poses(24)) {
    HeavyRig rig(heavy_config(false), q);
    rig.run(1.5);
    ASSERT_EQ(rig.state(), LinkState::kCoupled);
    EXPECT_EQ(rig.last.counterbalance, Counterbalance::kNone);
    const core::JointArray weight_Nm = weight_at(rig.last.position);
    for (std::size_t j = 0; j < kJointsOfArm; ++j) {
      EXPECT_NEAR(rig.last.loop_torque_Nm[j], weight_Nm[j], rig.rest_Nm(j)) << "b2, joint " << j;
      greatest_Nm = std::max(greatest_Nm, std::abs(weight_Nm[j]));
    }
    ASSERT_TRUE(rig.inbox.counterbalance.ask(true));
    const core::JointArray before = rig.last.position;
    rig.run(2.0);
    EXPECT_EQ(rig.last.counterbalance, Counterbalance::kAutomatic);
    EXPECT_EQ(rig.state(), LinkState::kCoupled);
    for (std::size_t j = 0; j < kJointsOfArm; ++j) {
      EXPECT_LE(std::abs(rig.last.loop_torque_Nm[j]), rig.rest_Nm(j)) << "counterbalanced, joint " << j;
      left = std::max(left, std::abs(rig.last.loop_torque_Nm[j]) / shipped_arm().arm.joints()[j].max_effort);
      most_moved = std::max(most_moved, std::abs(rig.last.position[j] - before[j]));
    }
  }
  EXPECT_GT(greatest_Nm, 20.0) << "else there is nothing to feel";
  std::cout << "weight up to " << greatest_Nm << " N·m; counterbalanced, up to " << 100.0 * left
            << " % of a joint's effort is left, and the arm moved by up to " << 1e3 * most_moved << " mrad\n";
}

TEST(Counterbalance, UnderWaterOnlyTheWeightLessTheLiftIsFeltAndCounterbalancedNothing) {
  HeavyRig rig(heavy_config(false), in_water());
  rig.run(1.5);
  ASSERT_EQ(rig.state(), LinkState::kCoupled);
  const double share = 1.0 - 1000.0 / 2700.0;
  double lift_Nm = 0.0;
  const core::JointArray weight_Nm = weight_at(rig.last.position);
  for (std::size_t j = 0; j < kJointsOfArm; ++j) {
    EXPECT_NEAR(rig.last.loop_torque_Nm[j], share * weight_Nm[j], rig.rest_Nm(j)) << "b2, joint " << j;
    lift_Nm = std::max(lift_Nm, std::abs((1.0 - share) * weight_Nm[j]) - 2.0 * rig.rest_Nm(j));
  }
  EXPECT_GT(lift_Nm, 0.0) << "no joint feels the lift: this shows nothing";
  ASSERT_TRUE(rig.inbox.counterbalance.ask(true));
  const core::JointArray before = rig.last.position;
  rig.run(2.0);
  EXPECT_EQ(rig.last.counterbalance, Counterbalance::kAutomatic);
  for (std::size_t j = 0; j < kJointsOfArm; ++j) {
    EXPECT_LE(std::abs(rig.last.loop_torque_Nm[j]), rig.rest_Nm(j)) << "counterbalanced, joint " << j;
    EXPECT_NEAR(rig.last.position[j], before[j], 0.01) << j;
  }
}

TEST(Counterbalance, SwitchingItMovesTheArmSlowlyAndNeverJoltsTheHand) {
  HeavyRig rig(heavy_config(false));
  rig.run(1.5);
  double fastest = 0.0, steepest_Nm = 0.0;
  for (const bool on : {true, false, true}) {
    ASSERT_TRUE(rig.inbox.counterbalance.ask(on));
    core::JointArray before_Nm = rig.last.loop_torque_Nm;
    for (int i = 0; i < 1500; ++i) {
      rig.tick();
      for (std::size_t j = 0; j < kJointsOfArm; ++j) {
        const double effort = shipped_arm().arm.joints()[j].max_effort;
        fastest = std::max(fastest, std::abs(rig.last.velocity[j]));
        steepest_Nm = std::max(steepest_Nm, std::abs(rig.last.loop_torque_Nm[j] - before_Nm[j]) / effort);
      }
      before_Nm = rig.last.loop_torque_Nm;
    }
    EXPECT_EQ(rig.last.counterbalance, on ? Counterbalance::kAutomatic : Counterbalance::kNone);
  }
  EXPECT_LT(fastest, 0.05) << "rad/s";
  EXPECT_LT(steepest_Nm, 0.01) << "of a joint's effort in a tick";
}

TEST(Counterbalance, AMovingArmIsCounterbalancedToo) {
  HeavyRig rig(heavy_config(true));
  rig.run(0.5);
  ASSERT_EQ(rig.state(), LinkState::kCoupled);
  const core::JointArray from = rig.last.position;
  double greatest_Nm = 0.0;
  for (int i = 0; i < 6000; ++i) {
    const double t_s = i * kTick_s, share = 0.5 - 0.5 * std::cos(t_s);  // there and back within 2π s
    for (std::size_t j = 1; j < kJointsOfArm; ++j) {
      const auto& joint = rig.model.arm.joints()[j];
      const double way = 0.5 * (from[j] > 0.5 * (joint.lower + joint.upper) ? -1.0 : 1.0);
      rig.master.position[j] = from[j] + way * share;
      rig.master.velocity[j] = way * 0.5 * std::sin(t_s);
    }
    rig.tick();
    for (std::size_t j = 0; j < kJointsOfArm; ++j)
      ASSERT_LE(std::abs(rig.last.loop_torque_Nm[j]), rig.moving_Nm(j)) << j << " at " << t_s;
    const core::JointArray weight_Nm = weight_at(rig.last.position);
    for (const double torque_Nm : weight_Nm) greatest_Nm = std::max(greatest_Nm, std::abs(torque_Nm));
  }
  EXPECT_GT(greatest_Nm, 20.0);
}

TEST(Counterbalance, ABalancedArmRefusesItAndSaysWhatIsAllowed) {
  Inbox starting;
  EXPECT_THAT(starting.counterbalance.ask(true).message(), testing::HasSubstr("still starting"));
  HeavyRig rig(shipped_config());
  rig.run(0.3);
  EXPECT_EQ(rig.last.counterbalance, Counterbalance::kMechanical);
  EXPECT_THAT(rig.inbox.counterbalance.ask(true).message(), testing::HasSubstr("allowed: off"));
  EXPECT_TRUE(rig.inbox.counterbalance.ask(false));
  rig.run(0.3);
  EXPECT_EQ(rig.last.counterbalance, Counterbalance::kMechanical);
}

TEST(Counterbalance, TheTickUsesNoHeap) {
  HeavyRig rig(heavy_config(false));
  rig.run(0.3);
  const test::HeapGuard guard;
  EXPECT_TRUE(rig.inbox.counterbalance.ask(true));
  rig.run(1.2);
}

TEST(Counterbalance, AFileThatCounterbalancesABalancedArmIsRefused) {
  EXPECT_THAT(problem_of_changed("gravity_feed_forward: false", "gravity_feed_forward: true"),
              testing::AllOf(testing::HasSubstr("servo.gravity_feed_forward"),
                             testing::HasSubstr("plant.balanced: false")));
  const auto file = changed("balanced: true", "balanced: false");
  EXPECT_FALSE(load_config(file, shipped_arm().arm, shipped_arm().home).plant.balanced);
}

class OnCan : public testing::TestWithParam<can::DriveMode> {};

// Drives that close the position loop themselves report all that they exert; they take the weight's torque as
// an offset (0x60B2), which is left out of F_as.
TEST_P(OnCan, TheWeightLeavesTheFedBackTorqueAndTheArmStaysWhereItIs) {
  Config config = can_config(GetParam());
  config.plant.balanced = false;
  const core::JointArray weight_Nm = weight_at(shipped_arm().home);
  core::JointArray coulomb_Nm{};
  ArmBench bench(config, shipped_arm().home, [&](std::size_t j, simulated_drive::DriveOptions& drive) {
    drive.motor.load_Nm = -weight_Nm[j];
    coulomb_Nm[j] = drive.motor.joint.coulomb;
  });
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  bench.run(2.0);
  const auto bound_Nm = [&](std::size_t j) {
    return coulomb_Nm[j] + 0.01 * shipped_arm().arm.joints()[j].max_effort;
  };
  for (std::size_t j = 0; j < kJointsOfArm; ++j)
    EXPECT_NEAR(bench.last.loop_torque_Nm[j], weight_Nm[j], bound_Nm(j)) << "b2, joint " << j;
  ASSERT_TRUE(bench.inbox.counterbalance.ask(true));
  bench.fastest = 0.0;
  bench.run(2.0);
  ASSERT_EQ(bench.state(), LinkState::kCoupled);
  EXPECT_EQ(bench.last.counterbalance, Counterbalance::kAutomatic);
  EXPECT_LT(bench.fastest, 0.05) << "of a joint's greatest speed";
  for (std::size_t j = 0; j < kJointsOfArm; ++j) {
    EXPECT_LE(std::abs(bench.last.loop_torque_Nm[j]), bound_Nm(j)) << "counterbalanced, joint " << j;
    EXPECT_NEAR(bench.joint(j), shipped_arm().home[j], 0.01) << j;
  }
}

// Drives that bear the arm in water: what lifts it stands in F_as where the model does not know of the water.
TEST_P(OnCan, UnderWaterTheLiftLeavesTheFedBackTorqueWhereItIsKnown) {
  Config config = can_config(GetParam());
  config.plant.balanced = false;
  config.gravity_feed_forward = true;
  const core::JointArray weight_Nm = weight_at(shipped_arm().home);
  const double lift_share = 1000.0 / 2700.0;
  for (const bool known : {true, false}) {
    core::JointArray coulomb_Nm{};
    const ArmModel model = known ? in_water() : shipped_arm();
    ArmBench bench(
        config, shipped_arm().home,
        [&](std::size_t j, simulated_drive::DriveOptions& drive) {
          drive.motor.load_Nm = -(1.0 - lift_share) * weight_Nm[j];
          coulomb_Nm[j] = drive.motor.joint.coulomb;
        },
        model);
    ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
    bench.run(3.0);
    double seen_Nm = 0.0;
    for (std::size_t j = 0; j < kJointsOfArm; ++j) {
      const double bound_Nm = coulomb_Nm[j] + 0.01 * shipped_arm().arm.joints()[j].max_effort;
      const double unknown_Nm = known ? 0.0 : -lift_share * weight_Nm[j];
      EXPECT_NEAR(bench.last.loop_torque_Nm[j], unknown_Nm, bound_Nm) << known << ", joint " << j;
      seen_Nm = std::max(seen_Nm, lift_share * std::abs(weight_Nm[j]) - 2.0 * bound_Nm);
    }
    EXPECT_GT(seen_Nm, 0.0) << "no joint feels the lift: this shows nothing";
  }
}

// It takes what floats: the drives bear nothing more, and nothing more is fed forward.
TEST_P(OnCan, UnderWaterACarriedThingThatFloatsWeighsNothing) {
  Config config = can_config(GetParam());
  config.plant.balanced = false;
  config.gravity_feed_forward = true;
  const core::JointArray weight_Nm = weight_at(shipped_arm().home);
  core::JointArray coulomb_Nm{};
  const ArmModel model = in_water();
  ArmBench bench(
      config, shipped_arm().home,
      [&](std::size_t j, simulated_drive::DriveOptions& drive) {
        drive.motor.load_Nm = -(1.0 - 1000.0 / 2700.0) * weight_Nm[j];
        coulomb_Nm[j] = drive.motor.joint.coulomb;
      },
      model);
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  robot::Payload floats;
  robot::add_body(floats, kJointsOfArm, 8.0, {0.1, 0.1, -0.1}, 0.01 * Eigen::Matrix3d::Identity());
  robot::add_displaced(floats, kJointsOfArm, 0.008, {0.1, 0.1, -0.1});
  bench.inbox.payload.write(floats);
  bench.run(3.0);
  core::JointArray in_air_Nm{};
  robot::LinkPoses X_WL;
  model.arm.link_poses(shipped_arm().home, X_WL);
  robot::add_weight(model.arm, floats, X_WL, in_air_Nm);
  double seen_Nm = 0.0;
  for (std::size_t j = 0; j < kJointsOfArm; ++j) {
    const double bound_Nm = coulomb_Nm[j] + 0.01 * shipped_arm().arm.joints()[j].max_effort;
    EXPECT_NEAR(bench.last.loop_torque_Nm[j], 0.0, bound_Nm) << j;
    seen_Nm = std::max(seen_Nm, std::abs(in_air_Nm[j]) - 2.0 * bound_Nm);
  }
  EXPECT_GT(seen_Nm, 0.0) << "no joint would bear it in air: this shows nothing";
}

INSTANTIATE_TEST_SUITE_P(Modes, OnCan,
                         testing::Values(can::DriveMode::kTorque, can::DriveMode::kVelocity,
                                         can::DriveMode::kPosition));

}  // namespace
}  // namespace phantom::slave_io
