#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/robot/kinematics/arm_dynamics.hpp"
#include "common/robot/tests/kdl_arm.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/simulation/master_plant.hpp"
#include "common/simulation/reflected_inertia.hpp"
#include "common/simulation/slave_plant.hpp"
#include "common/simulation/tests/half_space.hpp"
#include "common/teleop/coupling/joint_servo.hpp"
#include "common/teleop/tests/period.hpp"

namespace phantom::simulation {
namespace {

using teleop::kDt;

SlavePlantParameters slave_parameters(const robot::SerialArm& arm) {
  SlavePlantParameters p;
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    p.rotor[j] = 0.5;
    p.joints[j] = {
        .viscous = 0.2, .coulomb = 0.1, .lower = arm.joints()[j].lower, .upper = arm.joints()[j].upper};
    p.encoder_resolution[j] = 1e-6;
  }
  return p;
}

std::vector<ContactPoint> tip_of_planar() { return {{2, {0.3, 0, 0}}, {2, {0.15, 0, 0}}, {1, {0.2, 0, 0}}}; }

TEST(JointMechanics, FrictionHoldsAtRestAndNeverReverses) {
  const JointMechanics joint{.inertia = 0.3, .viscous = 0.1, .coulomb = 0.5};
  double q = 0.2, v = 0.0;
  for (int i = 0; i < 1000; ++i) integrate(joint, 0.49, kDt, q, v);
  EXPECT_EQ(q, 0.2);
  v = 0.7;
  for (int i = 0; i < 5000; ++i) {
    const double before = v;
    integrate(joint, 0.0, kDt, q, v);
    ASSERT_LE(v, before);
    ASSERT_GE(v, 0.0);
  }
  EXPECT_EQ(v, 0.0);  // comes to rest, exactly
}

TEST(JointMechanics, CoastsAsTheAnalyticSolution) {
  const JointMechanics joint{.inertia = 2.0, .viscous = 0.8, .coulomb = 0.0};
  double q = 0.0, v = 1.0;
  for (int i = 0; i < 100000; ++i) integrate(joint, 0.0, 1e-5, q, v);
  EXPECT_NEAR(v, std::exp(-0.4), 1e-5);
  EXPECT_NEAR(q, 2.0 / 0.8 * (1 - std::exp(-0.4)), 1e-4);
}

TEST(JointMechanics, EndStopsHold) {
  const JointMechanics joint{.inertia = 0.3, .viscous = 0.0, .coulomb = 0.0, .lower = -0.1, .upper = 0.1};
  double q = 0.0, v = 0.0;
  for (int i = 0; i < 1000; ++i) integrate(joint, 50.0, kDt, q, v);
  EXPECT_EQ(q, 0.1);
  EXPECT_EQ(v, 0.0);
  for (int i = 0; i < 1000; ++i) integrate(joint, -50.0, kDt, q, v);
  EXPECT_EQ(q, -0.1);
}

TEST(Encoders, QuantisePositionAndFilterVelocity) {
  core::JointArray resolution{}, q{};
  resolution[0] = 0.01;
  Encoders encoders(1, resolution, 0.01);
  q[0] = 0.0449;
  encoders.sample(q, 0.0);
  EXPECT_NEAR(encoders.position()[0], 0.04, 1e-12);
  EXPECT_EQ(encoders.velocity()[0], 0.0);
  for (int i = 0; i < 3000; ++i) encoders.sample({q[0] += 0.5 * kDt}, kDt);
  double mean = 0.0;
  for (int i = 0; i < 2000; ++i) {
    encoders.sample({q[0] += 0.5 * kDt}, kDt);
    mean += encoders.velocity()[0] / 2000;
  }
  EXPECT_NEAR(mean, 0.5, 0.02);
}

TEST(ReflectedInertia, OfThePlanarArmIsThatOfItsPointMasses) {
  const auto arm = robot::test_arms::planar();
  core::JointArray rotor{}, q{};
  rotor[0] = 0.1, rotor[1] = 0.2;
  const auto straight = reflected_inertia(arm, q, rotor);
  EXPECT_NEAR(straight[0], 0.1 + 0.2 * 0.2 + 0.55 * 0.55, 1e-12);
  EXPECT_NEAR(straight[1], 0.2 + 0.15 * 0.15, 1e-12);
  q[1] = std::numbers::pi / 2;
  EXPECT_NEAR(reflected_inertia(arm, q, rotor)[0], 0.1 + 0.04 + 0.4 * 0.4 + 0.15 * 0.15, 1e-12);
}

TEST(SlavePlant, BalancedArmStaysUnbalancedArmFalls) {
  const auto arm = robot::test_arms::planar(
      {geometry::rotation_from_rpy(std::numbers::pi / 2, 0, 0), Eigen::Vector3d::Zero()});
  HalfSpace far(Eigen::Vector3d::UnitX(), -100);
  auto parameters = slave_parameters(arm);
  SlavePlant still(arm, parameters, tip_of_planar(), far, {}, {0.3, 0, 0});
  parameters.balanced = false;
  SlavePlant falling(arm, parameters, tip_of_planar(), far, {}, {0.3, 0, 0});
  for (int i = 0; i < 200; ++i) still.step({}, kDt), falling.step({}, kDt);
  for (const double q : still.true_position()) EXPECT_NEAR(q, 0.0, 1e-12);
  EXPECT_GT(std::abs(falling.true_position()[0]), 0.05);
  EXPECT_GT(std::abs(falling.gravity_Nm()[0]), 1.0);
  EXPECT_EQ(still.contact().clearance_m, -1.0);
}

TEST(SlavePlant, GravityFeedForwardHoldsAnUnbalancedArm) {
  const auto arm = robot::test_arms::planar(
      {geometry::rotation_from_rpy(std::numbers::pi / 2, 0, 0), Eigen::Vector3d::Zero()});
  HalfSpace far(Eigen::Vector3d::UnitX(), -100);
  auto parameters = slave_parameters(arm);
  parameters.balanced = false;
  SlavePlant plant(arm, parameters, tip_of_planar(), far, {}, {0.3, 0, 0});
  for (int i = 0; i < 500; ++i) plant.step(plant.gravity_Nm(), kDt);
  for (const double q : plant.true_position()) EXPECT_NEAR(q, 0.0, 1e-9);
}

// The payload's weight is on the joints also of a balanced arm; the model's gravity has no part of it.
TEST(SlavePlant, APayloadWeighsOnABalancedArm) {
  const auto arm = robot::test_arms::planar(
      {geometry::rotation_from_rpy(std::numbers::pi / 2, 0, 0), Eigen::Vector3d::Zero()});
  HalfSpace far(Eigen::Vector3d::UnitX(), -100);
  auto parameters = slave_parameters(arm);
  parameters.payload = {2.0, {0.3, 0, 0}, {}};
  SlavePlant falling(arm, parameters, tip_of_planar(), far, {}, {0.3, 0, 0});
  SlavePlant held(arm, parameters, tip_of_planar(), far, {}, {0.3, 0, 0});
  const core::JointArray lift{2.0 * robot::kGravity_m_s2 * 0.7, 2.0 * robot::kGravity_m_s2 * 0.3};
  for (int i = 0; i < 300; ++i) falling.step({}, kDt), held.step(lift, kDt);
  EXPECT_EQ(falling.gravity_Nm()[0], 0.0);
  EXPECT_GT(std::abs(falling.true_position()[0]), 0.02);
  EXPECT_NEAR(held.true_position()[0], 0.0, 1e-9);
}

// Links lighter than water: held by what the model knows of weight and lift the arm rests. Held as in air it
// rises, and so does an arm whose counterweights balance it in air.
TEST(SlavePlant, UnderWaterAnArmRestsWhereItsLiftIsKnownAndRisesWhereItIsNot) {
  const auto arm = robot::test_arms::planar(
      {geometry::rotation_from_rpy(std::numbers::pi / 2, 0, 0), Eigen::Vector3d::Zero()});
  HalfSpace far(Eigen::Vector3d::UnitX(), -100);
  robot::DisplacedParts parts;
  for (std::size_t link : {1U, 2U}) parts[link] = {{arm.links()[link].centre_of_mass_m, 1.5e-3, 0.1}};
  robot::MediumRegion water;
  water.mu_Pa_s_per_m = 2.0;
  water.density_kg_per_m3 = 1000.0;
  const robot::Buoyancy buoyancy(parts, {water});
  auto parameters = slave_parameters(arm);
  SlavePlant counterweighed(arm, parameters, tip_of_planar(), far, {}, {0.3, 0, 0}, {}, nullptr, &buoyancy);
  parameters.balanced = false;
  SlavePlant known(arm, parameters, tip_of_planar(), far, {}, {0.3, 0, 0}, {}, nullptr, &buoyancy);
  SlavePlant as_in_air(arm, parameters, tip_of_planar(), far, {}, {0.3, 0, 0}, {}, nullptr, &buoyancy);
  for (int i = 0; i < 500; ++i) {
    known.step(known.gravity_Nm(), kDt);
    if (i >= 200) continue;
    robot::LinkPoses X_WL;
    arm.link_poses(as_in_air.true_position(), X_WL);
    as_in_air.step(arm.gravity_torque(X_WL), kDt);
    counterweighed.step({}, kDt);
  }
  for (const double q : known.true_position()) EXPECT_NEAR(q, 0.0, 1e-9);
  for (const double torque : known.contact().joint_torque_Nm)
    EXPECT_EQ(torque, 0.0) << "no force from outside";
  // 1.5 l lift each link by half more than its 1 kg weighs, so gravity and lift are −½ of the weight.
  EXPECT_NEAR(known.gravity_Nm()[0], -0.5 * robot::kGravity_m_s2 * (0.2 + 0.55), 1e-9);
  EXPECT_GT(as_in_air.true_position()[0], 0.05);
  EXPECT_NEAR(as_in_air.true_position()[0], counterweighed.true_position()[0], 1e-3);
}

TEST(SlavePlant, WhatItCarriesIsLiftedWithIt) {
  const auto arm = robot::test_arms::planar(
      {geometry::rotation_from_rpy(std::numbers::pi / 2, 0, 0), Eigen::Vector3d::Zero()});
  HalfSpace far(Eigen::Vector3d::UnitX(), -100);
  robot::MediumRegion water;
  water.density_kg_per_m3 = 1000.0;
  const robot::Buoyancy buoyancy({}, {water});
  SlavePlant sinking(arm, slave_parameters(arm), tip_of_planar(), far, {}, {0.3, 0, 0}, {}, nullptr,
                     &buoyancy);
  SlavePlant floating(arm, slave_parameters(arm), tip_of_planar(), far, {}, {0.3, 0, 0}, {}, nullptr,
                      &buoyancy);
  robot::Payload payload;
  robot::add_body(payload, 2, 2.0, {0.3, 0, 0}, 1e-3 * Eigen::Matrix3d::Identity());
  sinking.carry(payload);
  robot::add_displaced(payload, 2, 2e-3, {0.3, 0, 0});
  floating.carry(payload);
  for (int i = 0; i < 300; ++i) sinking.step({}, kDt), floating.step({}, kDt);
  EXPECT_LT(sinking.true_position()[0], -0.02);
  EXPECT_NEAR(floating.true_position()[0], 0.0, 1e-9);
}

// The tip is pressed against a wall by a torque on the base joint: at rest, force × lever = torque −
// friction.
TEST(SlavePlant, RestsOnAWallWithTheForceThatTheTorqueGives) {
  const auto arm = robot::test_arms::planar();
  HalfSpace wall(-Eigen::Vector3d::UnitY(), -0.02);  // free below y = 0.02
  auto parameters = slave_parameters(arm);
  for (auto& joint : parameters.joints) joint.coulomb = 0.0;
  parameters.contact_friction = 0.0;
  std::vector<ContactPoint> tip{{2, {0.3, 0, 0}}};
  SlavePlant plant(arm, parameters, tip, wall, {}, {0.3, 0, 0});
  core::JointArray torque{};
  torque[0] = 14.0, torque[1] = 6.0;  // the ratio of the levers: 0.7 m and 0.3 m
  for (int i = 0; i < 4000; ++i) plant.step(torque, kDt);
  EXPECT_TRUE(plant.contact().contact);
  EXPECT_NEAR(plant.contact().force_N, 20.0, 0.5);
  EXPECT_EQ(plant.contact().object, HalfSpace::kObject);
  EXPECT_NEAR(plant.contact().point_W_m.y(), 0.02 + 20.0 / 30000.0, 2e-4);
  EXPECT_EQ(plant.contact().clearance_m, 0.0);
  EXPECT_LT(plant.tool_speed_m_s(), 1e-3);
}

TEST(SlavePlant, ContactNeverPullsAndNeverAddsEnergy) {
  const auto arm = robot::test_arms::planar();
  HalfSpace wall(-Eigen::Vector3d::UnitY(), -0.05);
  auto parameters = slave_parameters(arm);
  for (auto& joint : parameters.joints) joint.coulomb = joint.viscous = 0.0;
  parameters.contact_damping_Ns_per_m = 50.0;
  SlavePlant plant(arm, parameters, tip_of_planar(), wall, {}, {0.3, 0, 0});
  // Thrown at the wall: a short push, then free. It bounces off slower than it came, and does not stick.
  core::JointArray push{};
  push[0] = 20.0;
  for (int i = 0; i < 30; ++i) plant.step(push, kDt);
  robot::KdlDynamics kdl(robot::kdl_chain(arm), {}, parameters.rotor);
  const auto energy = [&] {
    const Eigen::VectorXd v = robot::vector_of(plant.true_velocity(), 2);
    return 0.5 * v.dot(kdl.mass(plant.true_position()) * v);
  };
  const double before_J = energy();
  bool touched = false;
  for (int i = 0; i < 400; ++i) {
    plant.step({}, kDt);
    touched = touched || plant.contact().contact;
    ASSERT_LE(energy(), before_J * 1.001);
  }
  EXPECT_TRUE(touched);
  EXPECT_FALSE(plant.contact().contact);
  EXPECT_LT(plant.true_velocity()[0], 0.0);
}

TEST(SlavePlant, ClearanceIsTheLeastDistanceOfTheContactPoints) {
  const auto arm = robot::test_arms::planar();
  HalfSpace wall(-Eigen::Vector3d::UnitX(), -0.75);
  SlavePlant plant(arm, slave_parameters(arm), tip_of_planar(), wall, {}, {0.3, 0, 0});
  EXPECT_NEAR(plant.contact().clearance_m, 0.05, 1e-9);
}

// Literal twin: every point looked up in every step.
TEST(SlavePlant, ClearanceEqualsTheSearchOfAllPointsWhileTheArmMoves) {
  const auto arm = robot::test_arms::suspended();
  const HalfSpace floor(Eigen::Vector3d(0.1, 0.2, 1.0).normalized(), 0.35);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-0.15, 0.15), torque(-8, 8);
  std::vector<ContactPoint> points;
  for (int i = 0; i < 200; ++i) {
    points.push_back({1 + static_cast<std::size_t>(i) % 7, {place(random), place(random), place(random)}});
  }
  SlavePlant plant(arm, slave_parameters(arm), points, floor, {}, {0, 0, 0});
  core::JointArray drive{};
  int known = 0, touching = 0;
  for (int i = 0; i < 4000; ++i) {
    if (i % 300 == 0) {
      for (std::size_t j = 0; j < 7; ++j) drive[j] = torque(random);
    }
    robot::LinkPoses X_WL;
    arm.link_poses(plant.true_position(), X_WL);
    double least_m = 1e9;
    for (const auto& point : points)
      least_m = std::min(least_m, floor.distance_m(X_WL[point.link] * point.position_m));
    plant.step(drive, kDt);
    const double expected_m = least_m < floor.range_m() ? std::max(0.0, least_m) : -1.0;
    if (expected_m > 0.0) {
      ASSERT_GE(plant.contact().clearance_m, expected_m - 1e-12) << "step " << i;
      ASSERT_LE(plant.contact().clearance_m, expected_m / (1.0 - kClearanceTolerance)) << "step " << i;
    } else {
      ASSERT_EQ(plant.contact().clearance_m, expected_m) << "step " << i;
    }
    known += expected_m > 0.0;
    touching += plant.contact().contact;
  }
  EXPECT_GT(known, 100);
  EXPECT_GT(touching, 30);
}

TEST(SlavePlant, BadTorquesCountAsNone) {
  const auto arm = robot::test_arms::planar();
  HalfSpace far(Eigen::Vector3d::UnitX(), -100);
  SlavePlant plant(arm, slave_parameters(arm), tip_of_planar(), far, {}, {0.3, 0, 0});
  core::JointArray bad{};
  bad[0] = std::nan(""), bad[1] = INFINITY;
  for (int i = 0; i < 10; ++i) plant.step(bad, kDt);
  for (const double q : plant.true_position()) EXPECT_NEAR(q, 0.0, 1e-12);
}

TEST(MasterPlant, MotorTorqueActsOneSampleLateAndWithinItsLimit) {
  MasterPlantParameters p{.joint_count = 1, .joints = {}, .torque_limit_Nm = {}, .encoder_resolution = {}};
  p.joints[0] = {.inertia = 1.0};
  p.torque_limit_Nm[0] = 2.0;
  p.encoder_resolution[0] = 1e-7;
  MasterPlant plant(p, {});
  core::JointArray motor{};
  motor[0] = 5.0;
  plant.step({}, motor, kDt);
  EXPECT_EQ(plant.true_velocity()[0], 0.0);
  plant.step({}, {}, kDt);
  EXPECT_NEAR(plant.true_velocity()[0], 2.0 * kDt, 1e-12);
  plant.step({}, {}, kDt);
  EXPECT_NEAR(plant.true_velocity()[0], 2.0 * kDt, 1e-12);
}

}  // namespace
}  // namespace phantom::simulation
