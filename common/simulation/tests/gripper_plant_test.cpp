// The simulated gripper against what mechanics says of it.
#include "common/simulation/gripper_plant.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/heap_guard.hpp"

namespace phantom::simulation {
namespace {

constexpr double kDt_s = 0.001;

GripperPlantParameters frictionless() {
  return {.widest_m = 0.1,
          .finger_mass_kg = 0.4,
          .coulomb_N = 0.0,
          .viscous_Ns_per_m = 0.0,
          .object_stiffness_N_per_m = 20'000.0,
          .object_damping_Ns_per_m = 0.0};
}

// Both fingers of mass m move by half of the width: kinetic energy 2·½·m·(ẇ/2)² = ½·(m/2)·ẇ².
TEST(GripperPlant, AcceleratesAsItsMassSays) {
  GripperPlant plant(frictionless(), 0.1);
  constexpr double kForce_N = 2.0, kTime_s = 0.05;
  for (int i = 0; i < 50; ++i) plant.step(-10.0, kForce_N, kDt_s);
  const double acceleration = kForce_N / 0.2;
  EXPECT_NEAR(plant.velocity_m_s(), -acceleration * kTime_s, 1e-9);
  // Semi-implicit Euler is half a step ahead.
  EXPECT_NEAR(plant.width_m(), 0.1 - 0.5 * acceleration * kTime_s * kTime_s,
              acceleration * kTime_s * GripperPlant::kSubStep_s);
}

TEST(GripperPlant, ReachesItsTerminalSpeedThroughViscousFriction) {
  GripperPlantParameters parameters = frictionless();
  parameters.widest_m = 10.0;
  parameters.viscous_Ns_per_m = 20.0;
  parameters.coulomb_N = 1.0;
  GripperPlant plant(parameters, 10.0);
  for (int i = 0; i < 500; ++i) plant.step(-1000.0, 5.0, kDt_s);
  EXPECT_NEAR(plant.velocity_m_s(), -(5.0 - 1.0) / 20.0, 1e-9);
}

// The object is a spring: k·(b − w) = F, and the drive's force is all on it.
TEST(GripperPlant, CompressesAnObjectAsItsStiffnessSays) {
  GripperPlantParameters parameters = frictionless();
  parameters.object_width_m = 0.042;
  parameters.object_damping_Ns_per_m = 50.0;
  GripperPlant plant(parameters, 0.05);
  for (int i = 0; i < 2000; ++i) plant.step(0.0, 30.0, kDt_s);
  EXPECT_NEAR(plant.width_m(), 0.042 - 30.0 / 20'000.0, 1e-9);
  EXPECT_NEAR(plant.object_force_N(), 30.0, 1e-6);
  EXPECT_NEAR(plant.drive_force_N(), 30.0, 1e-12);
}

TEST(GripperPlant, FrictionIsBetweenTheDrivesForceAndTheObjects) {
  GripperPlantParameters parameters = frictionless();
  parameters.object_width_m = 0.042;
  parameters.object_damping_Ns_per_m = 50.0;
  parameters.coulomb_N = 2.0;
  GripperPlant plant(parameters, 0.05);
  for (int i = 0; i < 2000; ++i) plant.step(0.0, 30.0, kDt_s);
  EXPECT_NEAR(plant.object_force_N(), 30.0, 2.0 + 1e-9);
  // What the friction bears stays when the drive's force ends; the rest of the grip goes.
  for (int i = 0; i < 2000; ++i) plant.step(0.0, 0.0, kDt_s);
  EXPECT_LE(plant.object_force_N(), 2.0 + 1e-9);
}

// A mass on a spring leaves it after half a period, as fast as it came.
TEST(GripperPlant, BouncesOffAnElasticObjectInHalfAPeriod) {
  GripperPlantParameters parameters = frictionless();
  parameters.object_width_m = 0.05;
  GripperPlant plant(parameters, 0.06);
  while (plant.width_m() > 0.0502) plant.step(-10.0, 5.0, kDt_s);
  double contact_s = 0.0;
  constexpr double kFine_s = GripperPlant::kSubStep_s;
  const double speed_in = plant.velocity_m_s();
  for (int i = 0; i < 100; ++i) {
    plant.step(0.0, 0.0, kFine_s);
    contact_s += plant.object_force_N() > 0.0 ? kFine_s : 0.0;
  }
  EXPECT_NEAR(contact_s, std::numbers::pi / std::sqrt(20'000.0 / 0.2), 3 * kFine_s);
  EXPECT_NEAR(plant.velocity_m_s(), -speed_in, 0.02 * std::abs(speed_in));
}

TEST(GripperPlant, FollowsItsDemandWithoutOvershoot) {
  GripperPlant plant({.finger_mass_kg = 0.2, .coulomb_N = 1.0}, 0.1);
  double demand_m = 0.1, least_m = 1.0;
  for (int i = 0; i < 1500; ++i) {
    demand_m = std::max(0.03, demand_m - 0.1 * kDt_s);
    plant.step(demand_m, 40.0, kDt_s);
    least_m = std::min(least_m, plant.width_m());
  }
  EXPECT_NEAR(plant.width_m(), 0.03, 1.0 / plant.drive_stiffness_N_per_m() + 1e-6);
  EXPECT_GT(least_m, 0.03 - 1e-4);
}

TEST(GripperPlant, StaysWithinItsStopsWhateverIsDemanded) {
  GripperPlant plant({.object_width_m = 0.0}, 0.5);
  EXPECT_EQ(plant.width_m(), 0.1);
  for (const double demand_m : {1e9, -1e9, std::numeric_limits<double>::quiet_NaN(), 0.05})
    for (const double force_N : {1e3, -1.0, std::numeric_limits<double>::infinity()})
      for (int i = 0; i < 200; ++i) {
        plant.step(demand_m, force_N, kDt_s);
        ASSERT_GE(plant.width_m(), 0.0);
        ASSERT_LE(plant.width_m(), 0.1);
      }
}

TEST(GripperPlant, StepDoesNotAllocate) {
  GripperPlant plant({.object_width_m = 0.03}, 0.1);
  const test::HeapGuard guard;
  for (int i = 0; i < 1000; ++i) plant.step(0.0, 20.0, kDt_s);
}

}  // namespace
}  // namespace phantom::simulation
