#include <gtest/gtest.h>

#include "common/simulation/handle_plant.hpp"
#include "common/simulation/indexing_hand.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::simulation {
namespace {

constexpr double kTick_s = 0.001;

HandlePlantParameters handle() {
  HandlePlantParameters p;
  p.moved = {.inertia = 0.8, .viscous = 0.5, .coulomb = 0.1, .lower = -0.15, .upper = 0.15};
  p.turned = {.inertia = 0.01, .viscous = 0.005, .coulomb = 0.0, .lower = -1.0, .upper = 1.0};
  p.force_limit_N = 10.0;
  p.moment_limit_N_m = 0.5;
  return p;
}

robot::Spatial along(int axis, double value) {
  robot::Spatial v = robot::Spatial::Zero();
  v[axis] = value;
  return v;
}

TEST(HandlePlant, SpeedsUpByForceOverMassAndInertia) {
  auto p = handle();
  p.moved.viscous = p.moved.coulomb = p.turned.viscous = 0.0;
  HandlePlant plant(p);
  robot::Spatial push = along(1, 0.8);
  push[5] = 0.01;
  for (int i = 0; i < 200; ++i) plant.step(push, robot::Spatial::Zero(), kTick_s);
  EXPECT_NEAR(plant.true_twist()[1], 0.2, 1e-9);  // 1 m/s² for 0.2 s
  EXPECT_NEAR(plant.true_twist()[5], 0.2, 1e-9);
  EXPECT_NEAR(plant.pose().translation_m.y(), 0.02, 2e-4);
  EXPECT_NEAR(geometry::rotation_vector(plant.pose().rotation).z(), 0.02, 2e-4);
  EXPECT_NEAR(plant.twist()[1], 0.2, 0.02) << "the encoders' filter lags a little";
}

TEST(HandlePlant, StopsAtTheEdgesOfItsWorkspaceAndComesBack) {
  HandlePlant plant(handle());
  robot::Spatial push = along(0, 5.0);
  push[4] = 0.1;
  for (int i = 0; i < 3000; ++i) {
    const test::HeapGuard guard;
    plant.step(push, robot::Spatial::Zero(), kTick_s);
  }
  EXPECT_EQ(plant.pose().translation_m.x(), 0.15);
  EXPECT_NEAR(geometry::rotation_vector(plant.pose().rotation).norm(), 1.0, 0.02);
  for (int i = 0; i < 300; ++i) plant.step(-push, robot::Spatial::Zero(), kTick_s);
  EXPECT_LT(plant.pose().translation_m.x(), 0.1);
  EXPECT_LT(geometry::rotation_vector(plant.pose().rotation).norm(), 0.9);
}

TEST(HandlePlant, MotorsActATickLaterWithinTheirLimitsAndNeverByNumbersThatAreNone) {
  HandlePlant plant(handle());
  plant.step(robot::Spatial::Zero(), along(2, 100.0), kTick_s);
  EXPECT_EQ(plant.true_twist()[2], 0.0);
  EXPECT_EQ(plant.motors()[2], 10.0);
  plant.step(robot::Spatial::Zero(), along(2, std::nan("")), kTick_s);
  EXPECT_GT(plant.true_twist()[2], 0.0);
  EXPECT_EQ(plant.motors().norm(), 0.0);
}

TEST(IndexingHand, BringsTheHandleBackWithItsClutchOut) {
  HandlePlant plant(handle());
  IndexingHand hand({.reach_m = 0.1});
  int times_out = 0;
  bool was_in = true;
  for (int i = 0; i < 20'000; ++i) {
    robot::Spatial task = along(0, 3.0) - 10.0 * along(0, plant.true_twist()[0]);
    const robot::Spatial push = hand.step(plant.pose(), plant.true_twist(), task);
    times_out += was_in && !hand.clutch();
    was_in = hand.clutch();
    plant.step(push, robot::Spatial::Zero(), kTick_s);
    ASSERT_LT(plant.pose().translation_m.norm(), 0.15);
  }
  EXPECT_GT(times_out, 5);
}

}  // namespace
}  // namespace phantom::simulation
