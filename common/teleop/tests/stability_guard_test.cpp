#include "common/teleop/guards/stability_guard.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "common/simulation/master_plant.hpp"
#include "common/teleop/rendering/percept_rendering.hpp"

namespace phantom::teleop {
namespace {

using simulation::MasterPlant;
using simulation::MasterPlantParameters;

// Literal twin: a free mass braked by a damper that acts on velocities n samples old. Does its speed die out?
bool settles(double inertia, double damping, double period_s, int delay) {
  double v = 1.0;
  std::deque<double> past(static_cast<std::size_t>(delay) + 1, v);
  for (int i = 0; i < 20000; ++i) {
    v -= period_s / inertia * damping * past.front();
    past.pop_front();
    past.push_back(v);
    if (!(std::abs(v) < 1e6)) return false;
  }
  return std::abs(v) < 1e-3;
}

TEST(StabilityGuard, SR13_DampingAtTheLimitIsStableForEveryDelay) {
  for (int delay = 0; delay <= 6; ++delay) {
    const double limit = damping_stability_limit(0.02, 0.001, delay);
    EXPECT_TRUE(settles(0.02, 0.98 * limit, 0.001, delay)) << delay;
    EXPECT_FALSE(settles(0.02, 1.35 * limit, 0.001, delay)) << delay;
  }
}

// The simulated device with encoder steps, velocity filter and a sample of delay, in drag of the percept's
// greatest gain: a hand gives it a push and lets go. What remains of its motion, rad/s?
double speed_long_after_a_push(const core::JointArray& damping_limit) {
  MasterPlantParameters device{.joint_count = 1, .velocity_filter_s = 0.002};
  device.joints[0] = {.inertia = 0.05, .viscous = 0.02, .coulomb = 0.0};
  device.torque_limit_Nm[0] = 8.0;
  device.encoder_resolution[0] = 2e-5;
  MasterPlant plant(device, {});
  PerceptParameters parameters{.joint_count = 1};
  parameters.torque_cap_Nm[0] = 8.0;
  parameters.damping_limit_Nms_per_rad = damping_limit;
  PerceptRenderer renderer(parameters);
  DragCoefficients drag{.valid = true};
  drag.plus[0] = drag.minus[0] = 5.0;
  core::JointArray gain{};
  gain[0] = 20.0;
  double greatest = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const auto percept = renderer.step(drag, true, true, gain, plant.velocity(), 0.001);
    core::JointArray hand{};
    hand[0] = i >= 500 && i < 520 ? 1.0 : 0.0;  // once the percept is fully there
    plant.step(hand, percept.torque_Nm, 0.001);
    if (i >= 2500) greatest = std::max(greatest, std::abs(plant.true_velocity()[0]));
  }
  return greatest;
}

TEST(StabilityGuard, AnUnlimitedDragGainMakesTheDeviceOscillateAndTheGuardedOneDoesNot) {
  core::JointArray unlimited{};
  unlimited.fill(1e9);
  EXPECT_GT(speed_long_after_a_push(unlimited), 0.1) << "it shakes for ever";
  DeviceDamping device{
      .joint_count = 1, .period_s = 0.001, .delay_samples = 1 + filter_delay_samples(0.002, 0.001)};
  device.inertia[0] = 0.05;
  device.damping_cap[0] = 1e9;
  EXPECT_LT(speed_long_after_a_push(usable_damping(device)), 0.01) << "an encoder step in the filter's time";
}

TEST(StabilityGuard, WithoutDelayTheLimitIsTwoMassesPerPeriod) {
  EXPECT_NEAR(damping_stability_limit(0.5, 0.001, 0), 2 * 0.5 / 0.001, 1e-9);
}

TEST(StabilityGuard, FilterCountsAsWholeSamplesOfDelay) {
  EXPECT_EQ(filter_delay_samples(0.0, 0.001), 0);
  EXPECT_EQ(filter_delay_samples(0.002, 0.001), 2);
  EXPECT_EQ(filter_delay_samples(0.0021, 0.001), 3);
}

TEST(StabilityGuard, UsesHalfTheLimitAtMostAndTheDevicesCap) {
  DeviceDamping device{
      .joint_count = 2, .inertia = {}, .damping_cap = {}, .period_s = 0.001, .delay_samples = 1};
  device.inertia[0] = device.inertia[1] = 0.02;
  device.damping_cap[0] = 1000, device.damping_cap[1] = 3;
  const auto usable = usable_damping(device);
  EXPECT_DOUBLE_EQ(usable[0], 0.5 * damping_stability_limit(0.02, 0.001, 1));
  EXPECT_DOUBLE_EQ(usable[1], 3.0);
  EXPECT_EQ(usable[2], 0.0);
}

}  // namespace
}  // namespace phantom::teleop
