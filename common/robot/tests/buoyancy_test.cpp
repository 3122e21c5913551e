// The lift of an arm under water against Archimedes' law in closed form, and against the gradient of the
// energy that the displaced fluid has.
#include "common/robot/drag/buoyancy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/robot/kinematics/arm_dynamics.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::robot {
namespace {

using core::JointArray;

constexpr double kWater_kg_m3 = 1000.0, kBrine_kg_m3 = 1200.0;

MediumRegion fluid(double density_kg_per_m3, double from_z_m, double to_z_m) {
  MediumRegion region;
  region.mu_Pa_s_per_m = 2.0;
  region.min_m.z() = from_z_m;
  region.max_m.z() = to_z_m;
  region.density_kg_per_m3 = density_kg_per_m3;
  return region;
}

/// Two joints about horizontal axes: the planar arm, upright, with gravity in its plane.
SerialArm upright() {
  return test_arms::planar({geometry::rotation_from_rpy(std::numbers::pi / 2, 0, 0), {0, 0, 0}});
}

JointArray lift_of(const Buoyancy& buoyancy, const SerialArm& arm, const JointArray& q) {
  LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  JointArray tau{};
  buoyancy.add_lift(arm, X_WL, tau);
  return tau;
}

/// Parts all about the links' centres of mass, with the volume that their mass takes up at this density.
DisplacedParts as_heavy_as(const SerialArm& arm, double density_kg_per_m3) {
  DisplacedParts parts;
  const Eigen::Vector3d off(0.03, -0.02, 0.05);
  for (std::size_t link = 1; link <= arm.joint_count(); ++link) {
    const Link& body = arm.links()[link];
    for (const double side : {-1.0, 1.0})
      parts[link].push_back(
          {body.centre_of_mass_m + side * off, 0.5 * body.mass_kg / density_kg_per_m3, 0.1});
  }
  return parts;
}

/// Energy of the fluid that parts displace: of each, g · volume · the mean over its height of the mass of a
/// column of fluid above, ∫ρ dz.
double energy_J(const DisplacedParts& parts, const SerialArm& arm, const JointArray& q,
                double (*column_kg_m2)(double)) {
  LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  double energy = 0.0;
  for (std::size_t link = 1; link <= arm.joint_count(); ++link) {
    for (const DisplacedPart& part : parts[link]) {
      const double z = (X_WL[link] * part.centre_m).z();
      constexpr int kSlices = 4000;
      double mean = 0.0;
      for (int i = 0; i < kSlices; ++i)
        mean += column_kg_m2(z + part.height_m * ((i + 0.5) / kSlices - 0.5)) / kSlices;
      energy += kGravity_m_s2 * part.volume_m3 * mean;
    }
  }
  return energy;
}

TEST(Buoyancy, OfOneLinkIsThatOfArchimedes) {
  const SerialArm arm = upright();
  DisplacedParts parts;
  parts[2] = {{{0.1, 0, 0}, 1e-3, 0.1}, {{0.2, 0, 0}, 2e-3, 0.1}};
  const Buoyancy buoyancy(parts, {fluid(kWater_kg_m3, -5.0, 5.0)});
  EXPECT_TRUE(buoyancy.acts());
  EXPECT_DOUBLE_EQ(buoyancy.volume_m3(2), 3e-3);
  for (const double q1 : {0.0, 0.4, 1.9}) {
    for (const double q2 : {0.0, -0.7}) {
      const JointArray tau = lift_of(buoyancy, arm, {q1, q2});
      const double at_elbow = -kWater_kg_m3 * kGravity_m_s2 * (1e-3 * 0.1 + 2e-3 * 0.2) * std::cos(q1 + q2);
      EXPECT_NEAR(tau[1], at_elbow, 1e-12);
      EXPECT_NEAR(tau[0], at_elbow - kWater_kg_m3 * kGravity_m_s2 * 3e-3 * 0.4 * std::cos(q1), 1e-12);
    }
  }
}

TEST(Buoyancy, AnArmAsHeavyAsWaterWeighsNothingInItAndOneOfSteelAnEighthLess) {
  const SerialArm arm = test_arms::suspended();
  const Medium water{fluid(kWater_kg_m3, -50.0, 50.0)};
  const Buoyancy of_water(as_heavy_as(arm, kWater_kg_m3), water), of_steel(as_heavy_as(arm, 8000.0), water);
  std::mt19937 random(5);
  double greatest = 0.0;
  for (int i = 0; i < 100; ++i) {
    const JointArray q = test_arms::random_joints(arm, random);
    LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    const JointArray weight = arm.gravity_torque(X_WL);
    JointArray in_water = weight, steel = weight;
    of_water.add_lift(arm, X_WL, in_water);
    of_steel.add_lift(arm, X_WL, steel);
    for (std::size_t j = 0; j < arm.joint_count(); ++j) {
      greatest = std::max(greatest, std::abs(weight[j]));
      EXPECT_NEAR(in_water[j], 0.0, 1e-10) << j;
      EXPECT_NEAR(steel[j], 0.875 * weight[j], 1e-10) << j;
    }
  }
  EXPECT_GT(greatest, 10.0);
}

// Water to 1.1 m, and brine below 0.8 m, which cut the arm; the centre of gravity has no part in it.
TEST(Buoyancy, IsTheGradientOfTheDisplacedFluidsEnergyAlsoInASurface) {
  const SerialArm arm = test_arms::suspended();
  const DisplacedParts parts = as_heavy_as(arm, 2700.0);
  const Buoyancy buoyancy(parts, {fluid(kWater_kg_m3, -50.0, 1.1), fluid(kBrine_kg_m3, -50.0, 0.8)});
  const auto column_kg_m2 = [](double z) {
    return kWater_kg_m3 * std::max(0.0, 1.1 - std::max(z, 0.8)) + kBrine_kg_m3 * std::max(0.0, 0.8 - z);
  };
  std::mt19937 random(11);
  constexpr double kStep = 1e-5;
  double greatest = 0.0;
  for (int i = 0; i < 40; ++i) {
    const JointArray q = test_arms::random_joints(arm, random, 1.5);
    const JointArray tau = lift_of(buoyancy, arm, q);
    for (std::size_t j = 0; j < arm.joint_count(); ++j) {
      JointArray above = q, below = q;
      above[j] += kStep;
      below[j] -= kStep;
      const double slope =
          (energy_J(parts, arm, above, column_kg_m2) - energy_J(parts, arm, below, column_kg_m2)) /
          (2.0 * kStep);
      EXPECT_NEAR(tau[j], slope, 0.02) << i << ", joint " << j;
      greatest = std::max(greatest, std::abs(tau[j]));
    }
  }
  EXPECT_GT(greatest, 5.0) << "else the bound would say nothing";
}

TEST(Buoyancy, OfAnUprightBarRisesWithItsDepth) {
  const SerialArm arm = test_arms::load(
      test_arms::link("base", 0, "0 0 0") + test_arms::link("bar", 1, "0 0 0") +
          test_arms::moving_joint("lift", "prismatic", "base", "bar", "0 0 0", "0 0 0", "0 0 1", 2),
      "bar");
  DisplacedParts parts;  // 0.8 m, 0.01 m² of section
  for (int i = 0; i < 8; ++i) parts[1].push_back({{0, 0, 0.05 + 0.1 * i}, 1e-3, 0.1});
  const Buoyancy buoyancy(parts, {fluid(kWater_kg_m3, -3.0, 0.0)});
  for (double q = 0.3; q > -1.5; q -= 0.0137) {
    const double depth_m = std::clamp(-q, 0.0, 0.8);
    EXPECT_NEAR(lift_of(buoyancy, arm, {q})[0], -kWater_kg_m3 * kGravity_m_s2 * 0.01 * depth_m, 1e-9) << q;
  }
}

TEST(Buoyancy, AJetIsOfTheWaterItFlowsInAndABellHoldsAir) {
  const SerialArm arm = upright();
  DisplacedParts parts;
  parts[1] = {{{0.2, 0, 0}, 1e-3, 0.05}};
  const MediumRegion water = fluid(kWater_kg_m3, -5.0, 5.0), bell = fluid(0.0, -1.0, 1.0);
  MediumRegion jet = water;
  jet.density_kg_per_m3.reset();
  jet.current_m_s.x() = 1.0;
  const double whole = lift_of({parts, {water}}, arm, {})[0];
  EXPECT_LT(whole, -1.9);
  EXPECT_EQ(lift_of({parts, {water, jet}}, arm, {})[0], whole);
  EXPECT_EQ(lift_of({parts, {water, bell}}, arm, {})[0], 0.0);
  EXPECT_EQ(lift_of({parts, {bell, water}}, arm, {})[0], whole) << "the later region counts";
  EXPECT_FALSE(Buoyancy(parts, {jet}).acts());
  EXPECT_EQ(lift_of({parts, {jet}}, arm, {})[0], 0.0) << "in air";
}

TEST(Buoyancy, WhatIsCarriedIsLiftedAboutTheCentreOfItsVolumes) {
  const SerialArm arm = upright();
  const Buoyancy buoyancy({}, {fluid(kWater_kg_m3, -5.0, 0.35)});
  Payload payload;
  add_displaced(payload, 2, 1e-3, {0.3, 0, 0});
  add_displaced(payload, 2, 3e-3, {0.1, 0, 0});
  add_displaced(payload, 2, 0.0, {9, 9, 9});
  EXPECT_DOUBLE_EQ(payload.displaced_m3(), 4e-3);
  LinkPoses X_WL;
  arm.link_poses({}, X_WL);
  JointArray tau{};
  buoyancy.add_lift(arm, payload, X_WL, tau);
  EXPECT_NEAR(tau[1], -kWater_kg_m3 * kGravity_m_s2 * 4e-3 * 0.15, 1e-12);
  EXPECT_NEAR(tau[0], -kWater_kg_m3 * kGravity_m_s2 * 4e-3 * 0.55, 1e-12);
  arm.link_poses({1.2}, X_WL);  // its cube of 0.16 m is raised to 0.51 m, out of the fluid
  tau = {};
  buoyancy.add_lift(arm, payload, X_WL, tau);
  EXPECT_EQ(tau[0], 0.0);
  EXPECT_GT(std::abs(std::cos(1.2)), 0.3) << "a lever there is";
}

TEST(Buoyancy, UsesNoHeap) {
  const SerialArm arm = test_arms::suspended();
  const Buoyancy buoyancy(as_heavy_as(arm, 2700.0), {fluid(kWater_kg_m3, -50.0, 1.1)});
  Payload payload;
  add_displaced(payload, 7, 1e-3, {0.0, 0.0, 0.1});
  LinkPoses X_WL;
  arm.link_poses({}, X_WL);
  JointArray tau{};
  const test::HeapGuard guard;
  buoyancy.add_lift(arm, X_WL, tau);
  buoyancy.add_lift(arm, payload, X_WL, tau);
}

}  // namespace
}  // namespace phantom::robot
