#include "common/teleop/stability_guard.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>

namespace phantom::teleop {
namespace {

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

TEST(StabilityGuard, DampingAtTheLimitIsStableForEveryDelay) {
  for (int delay = 0; delay <= 6; ++delay) {
    const double limit = damping_stability_limit(0.02, 0.001, delay);
    EXPECT_TRUE(settles(0.02, 0.98 * limit, 0.001, delay)) << delay;
    EXPECT_FALSE(settles(0.02, 1.35 * limit, 0.001, delay)) << delay;
  }
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
