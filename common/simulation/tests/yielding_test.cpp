// Fluids and soft bodies round the simulated arm, against statics, dynamics and sums worked out by hand.
#include "common/simulation/yielding.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/simulation/mesh_world.hpp"
#include "common/simulation/slave_plant.hpp"
#include "common/simulation/tests/half_space.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::simulation::yielding_test {
namespace {

using core::JointArray;

constexpr double kStep_s = 0.001;
constexpr double kRadius_m = 0.05, kLength_m = 0.2;
constexpr double kTube_m2 = 2.0 * std::numbers::pi * kRadius_m * kLength_m;
constexpr double kMass_kg = 2.0, kRotor_kg = 0.5;

/// Slides along x, y and z; the last carries a tube or a pad.
const robot::SerialArm& gantry() {
  using namespace robot::test_arms;
  static const robot::SerialArm arm =
      load(link("base", 0, "0 0 0") + link("l1", 0, "0 0 0") + link("l2", 0, "0 0 0") +
               link("l3", kMass_kg, "0 0 0") +
               moving_joint("j1", "prismatic", "base", "l1", "0 0 0", "0 0 0", "1 0 0", 100) +
               moving_joint("j2", "prismatic", "l1", "l2", "0 0 0", "0 0 0", "0 1 0", 100) +
               moving_joint("j3", "prismatic", "l2", "l3", "0 0 0", "0 0 0", "0 0 1", 100),
           "l3");
  return arm;
}

robot::SkinLayout lay_out(const robot::SerialArm& arm, const std::vector<robot::LinkSkin>& skin,
                          double pitch_m) {
  auto made = robot::lay_out_skin(arm, skin, {.voxel_size_m = pitch_m});
  if (!made) throw std::runtime_error(made.status().message());
  return *std::move(made);
}
robot::LinkSkin part(const std::string& link, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m,
                     double from_radius_m, double to_radius_m) {
  robot::SkinSegment segment;
  segment.from_m = from_m, segment.to_m = to_m;
  segment.from_radius_m = from_radius_m, segment.to_radius_m = to_radius_m;
  return {link, {segment}, {}, {}};
}
robot::SkinLayout tube() {
  return lay_out(gantry(), {part("l3", {0, 0, 0}, {0, 0, kLength_m}, kRadius_m, kRadius_m)}, 0.01);
}
/// A disc that looks down: its rim 10 µm higher than its middle.
robot::SkinLayout pad() {
  return lay_out(gantry(), {part("l3", {0, 0, 1e-5}, {0, 0, 0}, 0.01, 1e-4)}, 0.002);
}
constexpr double kPad_m2 = std::numbers::pi * (1e-4 - 1e-8);
constexpr double kViscous = 2e5;  // Pa·s/m: the gantry behind the pad comes to rest within a second

SlavePlantParameters frictionless(const robot::SerialArm& arm) {
  SlavePlantParameters made;
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    made.rotor[j] = kRotor_kg;
    made.joints[j] = {.viscous = 0.0, .coulomb = 0.0, .lower = -100.0, .upper = 100.0};
    made.encoder_resolution[j] = 1e-9;
  }
  return made;
}

const HalfSpace kFar(Eigen::Vector3d::UnitX(), -1000);

/// The gantry among what gives way.
SlavePlant plant_with(robot::SkinLayout skin, const robot::Medium& medium,
                      const std::vector<SoftSolid>& bodies, const JointArray& start = {}) {
  return {gantry(), frictionless(gantry()),
          {},       kFar,
          start,    {0, 0, 0},
          {},       std::make_unique<Yielding>(std::move(skin), medium, bodies)};
}

/// A block with its upper face at z = 0.
SoftSolid block(std::uint16_t id, std::vector<SoftLayer> layers) {
  geometry::Pose X_WO;
  X_WO.translation_m = {0, 0, -0.1};
  return {id, geometry::make_box({0.4, 0.4, 0.2}).transformed(X_WO), std::move(layers)};
}

double power(const JointArray& torque, const JointArray& v, std::size_t count) {
  double sum = 0.0;
  for (std::size_t j = 0; j < count; ++j) sum += torque[j] * v[j];
  return sum;
}

TEST(Yielding, DragTakesPowerFromTheVelocityRelativeToTheFluid) {
  const robot::MediumRegion water{.mu_Pa_s_per_m = 30.0, .current_m_s = {0.1, -0.2, 0.05}};
  Yielding yielding(tube(), {water}, {});
  std::mt19937 random(4);
  std::uniform_real_distribution<double> speed(-0.5, 0.5);
  for (int i = 0; i < 200; ++i) {
    const JointArray v{speed(random), speed(random), speed(random)};
    robot::LinkPoses X_WL;
    gantry().link_poses({}, X_WL);
    yielding.sense(gantry(), X_WL, {}, v, 0.0);
    ASSERT_TRUE(yielding.joints().some);
    const JointArray relative{v[0] - 0.1, v[1] + 0.2, v[2] - 0.05};
    const JointArray drag = yielding.joints().torque({}, v);
    for (std::size_t j = 0; j < 3; ++j) ASSERT_NEAR(drag[j], -30.0 * kTube_m2 * relative[j], 1e-9);
    ASSERT_LE(power(drag, relative, 3), 0.0);
  }
}

// Literal twin: every sensor by itself, its force brought to the joints by the arm's own Jᵀ.
TEST(Yielding, IsTheSumOfItsSensorsAlsoForAnArmOfSevenJointsPartlyUnderWater) {
  const robot::SerialArm arm = robot::test_arms::suspended();
  const auto skin = lay_out(
      arm,
      {part("l3", {0, 0, 0}, {0, 0, -0.4}, 0.06, 0.04), part("l5", {0, 0, 0}, {0.1, 0, -0.1}, 0.03, 0.05),
       part("l7", {0, 0, 0}, {0, 0, -0.1}, 0.02, 0.02)},
      0.02);
  const robot::Medium still{{.mu_Pa_s_per_m = 20.0, .max_m = {10, 10, 1.0}}};
  robot::Medium flowing = still;
  flowing[0].current_m_s = {0.3, 0.1, -0.2};
  Yielding in_still(skin, still, {}), in_flow(skin, flowing, {});
  std::mt19937 random(5);
  std::uniform_real_distribution<double> speed(-1.0, 1.0);
  int wet = 0;
  for (int i = 0; i < 100; ++i) {
    const JointArray q = robot::test_arms::random_joints(arm, random, 1.0);
    JointArray v{}, expected{};
    for (std::size_t j = 0; j < 7; ++j) v[j] = speed(random);
    robot::LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    in_still.sense(arm, X_WL, q, v, 0.0);
    in_flow.sense(arm, X_WL, q, v, 0.0);
    for (std::size_t s = 0; s < skin.size(); ++s) {
      const std::size_t link = skin.link_of(s);
      const Eigen::Vector3d p_W_m = X_WL[link] * skin.position(s);
      if (!flowing[0].contains(p_W_m)) continue;
      const Eigen::Vector3d relative = arm.point_velocity_W(link, p_W_m, X_WL, v) - flowing[0].current_m_s;
      arm.add_force(link, p_W_m, -20.0 * skin.area_m2[s] * relative, X_WL, expected);
      ++wet;
    }
    const JointArray drag = in_flow.joints().torque(q, v);
    for (std::size_t j = 0; j < 7; ++j) ASSERT_NEAR(drag[j], expected[j], 1e-9) << "joint " << j;
    ASSERT_LE(power(in_still.joints().torque(q, v), v, 7), 0.0);
  }
  EXPECT_GT(wet, 1000);
}

TEST(Yielding, AnArmThatIsPushedComesToTheSpeedAtWhichTheDragHoldsThePush) {
  const double mu = 100.0, current = 0.05, push_N = 3.0, mass = kMass_kg + kRotor_kg;
  const double drag = mu * kTube_m2, last = current + push_N / drag;
  auto plant = plant_with(tube(), {{.mu_Pa_s_per_m = mu, .current_m_s = {current, 0, 0}}}, {});
  for (int i = 1; i <= 4000; ++i) {
    plant.step({push_N}, kStep_s);
    const double expected = last * (1.0 - std::exp(-drag / mass * i * kStep_s));
    ASSERT_NEAR(plant.true_velocity()[0], expected, 1e-3 * last) << i;
  }
  for (int i = 0; i < 6000; ++i) plant.step({push_N}, kStep_s);
  EXPECT_NEAR(plant.true_velocity()[0], last, 1e-9);
  EXPECT_NEAR(plant.contact().joint_torque_Nm[0], -push_N, 1e-9) << "the force from outside";
  EXPECT_FALSE(plant.contact().contact) << "water is nothing to be hit";
  for (int i = 0; i < 12000; ++i) plant.step({}, kStep_s);
  EXPECT_NEAR(plant.true_velocity()[0], current, 1e-6) << "let go, it drifts with the water";
}

TEST(Yielding, AtRestItIsPressedInAsDeepAsTheForceByTheStiffness) {
  const double stiffness = 2e6, push_N = 5.0;
  auto plant = plant_with(pad(), {}, {block(7, {{1.0, stiffness, kViscous}})});
  for (int i = 0; i < 3000; ++i) plant.step({0, 0, -push_N}, kStep_s);
  EXPECT_NEAR(-plant.true_position()[2], push_N / (stiffness * kPad_m2), 1e-5);
  EXPECT_TRUE(plant.contact().contact);
  EXPECT_EQ(plant.contact().object, 7);
  EXPECT_NEAR(plant.contact().force_N, push_N, 1e-6);
  EXPECT_NEAR(plant.contact().joint_torque_Nm[2], push_N, 1e-6);
  EXPECT_NEAR(plant.contact().point_W_m.head<2>().norm(), 0.0, 1e-3) << "in the middle of the pad";
  EXPECT_EQ(plant.contact().clearance_m, 0.0);
}

TEST(Yielding, LayersAddUpToThePressure) {
  // 5 mm of 1 MPa/m, then 3 MPa/m, which goes on below the last layer: 5 kPa, 3 mm deeper.
  auto plant = plant_with(pad(), {}, {block(7, {{0.005, 1e6, kViscous}, {0.001, 3e6, kViscous}})});
  const double push_N = kPad_m2 * (5e3 + 3e6 * 0.003);
  for (int i = 0; i < 3000; ++i) plant.step({0, 0, -push_N}, kStep_s);
  EXPECT_NEAR(-plant.true_position()[2], 0.008, 1e-5);
}

TEST(Yielding, OfBodiesInOneAnotherTheOneThatPressesMostCounts) {
  geometry::Pose X_WO;
  X_WO.translation_m = {0, 0, -0.055};
  const SoftSolid nodule{8, geometry::make_box({0.1, 0.1, 0.1}).transformed(X_WO), {{1.0, 1e7, kViscous}}};
  auto plant = plant_with(pad(), {}, {block(7, {{1.0, 1e6, kViscous}}), nodule});
  // 1 MPa/m from 0, 10 MPa/m from 5 mm: as much at 5.556 mm.
  for (int i = 0; i < 3000; ++i) plant.step({0, 0, -kPad_m2 * 4e3}, kStep_s);
  EXPECT_NEAR(-plant.true_position()[2], 0.004, 1e-5);
  EXPECT_EQ(plant.contact().object, 7);
  for (int i = 0; i < 3000; ++i) plant.step({0, 0, -kPad_m2 * 3e4}, kStep_s);
  EXPECT_NEAR(-plant.true_position()[2], 0.008, 1e-5);
  EXPECT_EQ(plant.contact().object, 8);
}

TEST(Yielding, ASoftBodyNeverPullsAndBrakesToTheSide) {
  Yielding yielding(pad(), {}, {block(7, {{1.0, 1e6, 1e4}})});
  const JointArray q{0, 0, -0.002};
  robot::LinkPoses X_WL;
  gantry().link_poses(q, X_WL);
  for (const double out_m_s : {-1.0, 0.0, 0.1, 1.0, 10.0}) {
    const JointArray v{0.3, -0.4, out_m_s};
    yielding.sense(gantry(), X_WL, q, v, 0.0);
    const JointArray force = yielding.joints().torque(q, v);
    EXPECT_GE(force[2], -1e-12) << out_m_s;
    EXPECT_NEAR(force[0], -1e4 * kPad_m2 * 0.3, 1e-5);
    EXPECT_NEAR(force[1], 1e4 * kPad_m2 * 0.4, 1e-5);
  }
  yielding.sense(gantry(), X_WL, q, {0, 0, -0.5}, 0.0);
  EXPECT_NEAR(yielding.joints().torque(q, {0, 0, -0.5})[2], kPad_m2 * (1e6 * 0.002 + 1e4 * 0.5), 5e-3);
}

TEST(Yielding, WhatIsThrownAtASoftBodyComesBackSlower) {
  for (const double viscosity : {0.0, 50.0, 1e9})
    for (const double stiffness : {1e5, 1e7, 1e13}) {
      auto plant = plant_with(pad(), {}, {block(7, {{1.0, stiffness, viscosity}})}, {0, 0, 0.01});
      for (int i = 0; i < 40; ++i) plant.step({0, 0, -5.0}, kStep_s);
      const double before = std::abs(plant.true_velocity()[2]);
      double fastest = 0.0, deepest = 0.0;
      for (int i = 0; i < 3000; ++i) {
        plant.step({}, kStep_s);
        fastest = std::max(fastest, std::abs(plant.true_velocity()[2]));
        deepest = std::min(deepest, plant.true_position()[2]);
      }
      EXPECT_LE(fastest, 1.001 * before) << viscosity << ' ' << stiffness;
      EXPECT_LT(deepest, 0.0);
      EXPECT_GT(deepest, -0.1);
    }
}

TEST(Yielding, WhatIsHardInASoftBodyIsMetThroughIt) {
  geometry::Pose X_WO;
  X_WO.translation_m = {0, 0, -0.06};
  const SoftSolid tissue = block(7, {{1.0, 1e6, kViscous}});
  const MeshWorld world({{tissue.mesh_W, 7}, {geometry::make_box({0.1, 0.1, 0.1}).transformed(X_WO), 9}}, 0.1,
                        {7});
  EXPECT_NEAR(world.distance_m({0, 0, 0.02}), 0.02, 1e-6) << "the distance is that of all bodies";
  EXPECT_EQ(world.query_rigid({0, 0, -0.005}).object, 9);
  // More points than bear force are deeper in the tissue, beside the bone.
  std::vector<ContactPoint> points{{3, {0, 0, 0}}};
  for (std::size_t i = 0; i <= SlavePlant::kMaxTouching; ++i)
    points.push_back({3, {0.08, 0.005 * static_cast<double>(i), -0.005}});
  SlavePlant plant(gantry(), frictionless(gantry()), points, world, {0, 0, 0.025}, {0, 0, 0}, {},
                   std::make_unique<Yielding>(pad(), robot::Medium(), std::vector<SoftSolid>{tissue}));
  EXPECT_NEAR(plant.contact().clearance_m, 0.02, 1e-6);
  const double push_N = 30.0;
  for (int i = 0; i < 6000; ++i) plant.step({0, 0, -push_N}, kStep_s);
  // 10 mm of tissue hold 3.1 N; the bone's contact, of 30 kN/m, the rest.
  const double tissue_N = kPad_m2 * 1e6 * -plant.true_position()[2];
  EXPECT_NEAR(-plant.true_position()[2], 0.01 + (push_N - tissue_N) / 30'000.0, 1e-4);
  EXPECT_EQ(plant.contact().object, 9);
  EXPECT_NEAR(plant.contact().joint_torque_Nm[2], push_N, 1e-3);
}

TEST(Yielding, ProfilesBecomeLayersInMetres) {
  workspace::LayerProfile profile;
  EXPECT_TRUE(soft_layers(profile, 0.001).empty());
  profile.mu_skin_Pa_s_per_m = 33.0F;
  profile.inside_thickness_vox = {2, 3};
  profile.mu_inside_Pa_s_per_m = {10.0F, 12.0F};
  profile.stiffness_inside_Pa_per_m = {5e5, 7e5};
  const auto layers = soft_layers(profile, 0.001);
  ASSERT_EQ(layers.size(), 3U);
  EXPECT_NEAR(layers[1].thickness_m, 0.003, 1e-12);
  EXPECT_EQ(layers[1].stiffness_Pa_per_m, 7e5);
  EXPECT_EQ(layers[1].viscosity_Pa_s_per_m, 12.0);
  EXPECT_EQ(layers[2].stiffness_Pa_per_m, 7e5) << "goes on inwards";
  EXPECT_EQ(layers[2].viscosity_Pa_s_per_m, 33.0);
}

TEST(Yielding, AllocatesNothing) {
  auto plant =
      plant_with(pad(), {{.mu_Pa_s_per_m = 5.0, .max_m = {10, 10, 0.1}}}, {block(7, {{1.0, 1e6, 50.0}})});
  const test::HeapGuard guard;
  for (int i = 0; i < 200; ++i) plant.step({0.1, 0, -1.0}, kStep_s);
}

}  // namespace
}  // namespace phantom::simulation::yielding_test
