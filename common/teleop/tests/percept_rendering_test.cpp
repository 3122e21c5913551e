#include "common/teleop/rendering/percept_rendering.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "common/teleop/tests/period.hpp"

namespace phantom::teleop::percept_rendering_test {
namespace {

core::JointArray all(double gain) {
  core::JointArray gains{};
  gains.fill(gain);
  return gains;
}
std::size_t triangle_index(std::size_t i, std::size_t j) { return i * (i + 1) / 2 + j; }

constexpr std::size_t kPerceptJoints = 5;

PerceptParameters parameters(DragMode mode) {
  PerceptParameters p{
      .joint_count = kPerceptJoints, .mode = mode, .torque_cap_Nm = {}, .damping_limit_Nms_per_rad = {}};
  for (std::size_t j = 0; j < kPerceptJoints; ++j) {
    p.torque_cap_Nm[j] = 1.0 + 0.3 * static_cast<double>(j);
    p.damping_limit_Nms_per_rad[j] = 2.0 + static_cast<double>(j);
  }
  return p;
}

struct Random {
  std::mt19937 engine{11};
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine);
  }
  core::JointArray velocity(double greatest) {
    core::JointArray v{};
    for (std::size_t j = 0; j < kPerceptJoints; ++j) v[j] = uniform(-greatest, greatest);
    return v;
  }
  // D = JᵀJ with random J: positive semi-definite, often of low rank.
  DragCoefficients drag(double scale, bool directional = true, bool current = false) {
    DragCoefficients d;
    d.valid = true;
    const int rank = static_cast<int>(uniform(1, 6));
    double jacobian[6][kPerceptJoints] = {};
    for (int r = 0; r < rank; ++r) {
      for (auto& value : jacobian[r]) value = uniform(-1, 1);
    }
    for (std::size_t i = 0; i < kPerceptJoints; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        for (auto& row : jacobian) d.coupled[triangle_index(i, j)] += scale * row[i] * row[j];
      }
      const double own = d.matrix(i, i);
      d.plus[i] = own * (directional ? uniform(0, 1) : 1.0);
      d.minus[i] = own * (directional ? uniform(0, 1) : 1.0);
    }
    if (current) d.drift = velocity(std::pow(10.0, uniform(-3, 1)));
    return d;
  }
};

double power(const RenderedPercept& out, const core::JointArray& v) {
  double sum_W = 0.0;
  for (std::size_t j = 0; j < kPerceptJoints; ++j) sum_W += out.torque_Nm[j] * v[j];
  return sum_W;
}

class Rendering : public testing::TestWithParam<DragMode> {};
INSTANTIATE_TEST_SUITE_P(Modes, Rendering, testing::Values(DragMode::kSeparable, DragMode::kCoupled));

TEST_P(Rendering, NeverDrivesTheHandAndStaysWithinTheCaps) {
  Random random;
  const auto p = parameters(GetParam());
  PerceptRenderer renderer(p);
  for (int i = 0; i < 20000; ++i) {
    const auto drag = random.drag(std::pow(10.0, random.uniform(-3, 3)), true, i % 2 == 0);
    const auto v = random.velocity(std::pow(10.0, random.uniform(-4, 1.5)));
    const bool fresh = random.uniform(0, 1) < 0.9, enabled = random.uniform(0, 1) < 0.95;
    const auto out = renderer.step(drag, fresh, enabled, all(random.uniform(0, 50)), v, kDt);
    ASSERT_LE(power(out, v), 1e-12);
    for (std::size_t j = 0; j < kPerceptJoints; ++j)
      ASSERT_LE(std::abs(out.torque_Nm[j]), p.torque_cap_Nm[j] * (1 + 1e-12));
  }
}

TEST_P(Rendering, NothingAtRest) {
  Random random;
  PerceptRenderer renderer(parameters(GetParam()));
  for (int i = 0; i < 100; ++i) renderer.step(random.drag(1.0), true, true, all(10), random.velocity(1), kDt);
  for (const bool current : {false, true}) {
    const auto out = renderer.step(random.drag(1.0, true, current), true, true, all(10), {}, kDt);
    for (const double torque : out.torque_Nm) EXPECT_EQ(torque, 0.0);
  }
}

TEST_P(Rendering, BadNumbersNeverReachTheMotors) {
  Random random;
  PerceptRenderer renderer(parameters(GetParam()));
  for (int i = 0; i < 5000; ++i) {
    auto drag = random.drag(1.0, true, true);
    auto v = random.velocity(1);
    double gain = 5;
    const double bad =
        i % 2 == 0 ? std::numeric_limits<double>::quiet_NaN() : -std::numeric_limits<double>::infinity();
    if (i % 3 == 0) drag.plus[1] = drag.coupled[4] = bad;
    if (i % 5 == 0) v[2] = bad;
    if (i % 13 == 0) drag.drift[3] = bad;
    if (i % 7 == 0) gain = bad;
    if (i % 11 == 0) drag.minus[0] = -4.0;
    const auto out = renderer.step(drag, true, true, all(gain), v, kDt);
    for (const double torque : out.torque_Nm) ASSERT_TRUE(std::isfinite(torque));
    if (i % 5 != 0) {
      ASSERT_LE(power(out, v), 1e-12);
    }
  }
}

TEST_P(Rendering, FadesOutInBoundedTimeWithoutAJump) {
  Random random;
  const auto p = parameters(GetParam());
  PerceptRenderer renderer(p);
  const auto drag = random.drag(0.3);
  const auto v = random.velocity(0.5);
  for (int i = 0; i < 2000; ++i) renderer.step(drag, true, true, all(1.0), v, kDt);
  auto before = renderer.step(drag, true, true, all(1.0), v, kDt);
  ASSERT_LT(power(before, v), -1e-3);
  // Stale, and the field says so with zeros as the phantom sends them: still no jump.
  int ticks = 0;
  while (power(before, v) < 0.0) {
    const auto now = renderer.step(DragCoefficients{}, ticks % 2 == 0, true, all(1.0), v, kDt);
    for (std::size_t j = 0; j < kPerceptJoints; ++j) {
      ASSERT_LE(std::abs(now.torque_Nm[j] - before.torque_Nm[j]),
                1.1 * p.torque_cap_Nm[j] * kDt / p.ramp_down_s);
    }
    before = now;
    ASSERT_LE(++ticks, static_cast<int>(p.ramp_down_s / kDt) + 1);
  }
  EXPECT_EQ(before.authority, 0.0);
}

TEST_P(Rendering, WhatIsNotSoundEndsThePerceptAsIfItWereSwitchedOff) {
  const auto p = parameters(GetParam());
  Random random;
  const auto sound = random.drag(0.3);
  const auto v = random.velocity(0.5);
  struct Given {
    DragCoefficients drag;
    bool fresh;
    core::JointArray gain;
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto spoilt = [&](auto change) {
    Given given{sound, true, all(1.0)};
    change(given);
    return given;
  };
  for (const Given& given :
       {spoilt([](Given& g) { g.fresh = false; }), spoilt([](Given& g) { g.drag.valid = false; }),
        spoilt([](Given& g) { g.drag.plus[1] = kInfinity; }),
        spoilt([](Given& g) { g.drag.minus[3] = std::nan(""); }),
        spoilt([](Given& g) { g.drag.drift[2] = std::nan(""); }), spoilt([](Given& g) { g.gain[2] = -1.0; }),
        spoilt([](Given& g) { g.gain[0] = std::nan(""); })}) {
    PerceptRenderer renderer(p);
    RenderedPercept out;
    for (int i = 0; i < 2000; ++i) out = renderer.step(sound, true, true, all(1.0), v, kDt);
    ASSERT_LT(power(out, v), -1e-3);
    for (double t = 0.0; t < p.ramp_down_s + 2 * kDt; t += kDt)
      out = renderer.step(given.drag, given.fresh, true, given.gain, v, kDt);
    EXPECT_EQ(out.authority, 0.0);
    for (const double torque : out.torque_Nm) EXPECT_EQ(torque, 0.0);
  }
}

TEST(PerceptRendering, ACoefficientBelowZeroDoesNotPush) {
  PerceptRenderer renderer(parameters(DragMode::kSeparable));
  DragCoefficients drag;
  drag.valid = true;
  drag.plus[1] = drag.minus[2] = -1.0;
  core::JointArray v{};
  v[1] = 0.5;
  v[2] = -0.5;
  for (int i = 0; i < 2000; ++i) {
    const auto out = renderer.step(drag, true, true, all(1.0), v, kDt);
    ASSERT_EQ(out.torque_Nm[1], 0.0);
    ASSERT_EQ(out.torque_Nm[2], 0.0);
  }
}

TEST(PerceptRendering, AMatrixThatWouldPushIsNotRendered) {
  DragCoefficients drag;  // not positive semi-definite: it drives joints 0 and 1 apart
  drag.valid = true;
  drag.coupled[triangle_index(0, 0)] = drag.coupled[triangle_index(1, 1)] = 0.1;
  drag.coupled[triangle_index(1, 0)] = 1.0;
  for (std::size_t j = 0; j < 2; ++j) drag.plus[j] = drag.minus[j] = 0.1;
  for (const double second : {1.0, -1.0}) {
    PerceptRenderer renderer(parameters(DragMode::kCoupled));
    RenderedPercept out;
    const core::JointArray v{1.0, second};
    for (int i = 0; i < 2000; ++i) out = renderer.step(drag, true, true, all(0.5), v, kDt);
    EXPECT_EQ(power(out, v) < 0.0, second > 0.0) << "where it opposes the motion it is rendered";
    EXPECT_LE(power(out, v), 0.0);
  }
}

TEST_P(Rendering, ComesInWithoutAKick) {
  Random random;
  const auto p = parameters(GetParam());
  PerceptRenderer renderer(p);
  const auto drag = random.drag(1.0);
  const auto v = random.velocity(5.0);
  auto before = renderer.step(drag, false, true, all(20.0), v, kDt);
  for (int i = 0; i < 1000; ++i) {
    const auto now = renderer.step(drag, true, true, all(20.0), v, kDt);
    for (std::size_t j = 0; j < kPerceptJoints; ++j) {
      const double stiffest_Nm =
          p.damping_limit_Nms_per_rad[j] * 5.0 * 3.0;  // coupled: rows add up to at most this much
      ASSERT_LE(std::abs(now.torque_Nm[j] - before.torque_Nm[j]),
                stiffest_Nm * (kDt / p.ramp_up_s + kDt / p.smoothing_s * 0.1));
    }
    before = now;
  }
}

TEST_P(Rendering, ASteppedCoefficientComesInOverTheSmoothingTime) {
  Random random;
  const auto p = parameters(GetParam());
  PerceptRenderer renderer(p);
  auto drag = random.drag(0.1);
  core::JointArray v{};
  v[0] = 0.2;
  for (int i = 0; i < 2000; ++i) renderer.step(drag, true, true, all(1.0), v, kDt);
  const double start = renderer.step(drag, true, true, all(1.0), v, kDt).torque_Nm[0];
  for (auto* values : {&drag.plus, &drag.minus})
    for (auto& value : *values) value *= 2;
  for (auto& value : drag.coupled) value *= 2;
  const double first = renderer.step(drag, true, true, all(1.0), v, kDt).torque_Nm[0];
  for (int i = 0; i < 200; ++i) renderer.step(drag, true, true, all(1.0), v, kDt);
  const double end = renderer.step(drag, true, true, all(1.0), v, kDt).torque_Nm[0];
  EXPECT_NEAR(end, 2 * start, 1e-6);
  EXPECT_NEAR(first - start, start * kDt / (kDt + p.smoothing_s), 1e-9);
}

// A jet that the arm comes into: the drag takes the smoothing time to change.
TEST_P(Rendering, ACurrentComesInOverTheSmoothingTimeAndIsThatOfTheDragLaw) {
  Random random;
  const auto p = parameters(GetParam());
  PerceptRenderer renderer(p);
  auto drag = random.drag(0.1, false);
  core::JointArray v{};
  v[0] = 0.2;
  for (int i = 0; i < 2000; ++i) renderer.step(drag, true, true, all(1.0), v, kDt);
  const double before = renderer.step(drag, true, true, all(1.0), v, kDt).torque_Nm[0];
  drag.drift[0] = -0.1;
  const double first = renderer.step(drag, true, true, all(1.0), v, kDt).torque_Nm[0];
  for (int i = 0; i < 200; ++i) renderer.step(drag, true, true, all(1.0), v, kDt);
  const double end = renderer.step(drag, true, true, all(1.0), v, kDt).torque_Nm[0];
  EXPECT_NEAR(end, 1.5 * before, 1e-6) << "0.3 instead of 0.2 relative to the fluid";
  EXPECT_NEAR(first - before, 0.5 * before * kDt / (kDt + p.smoothing_s), 1e-9);
}

TEST(PerceptRendering, SeparableIsDirectional) {
  auto p = parameters(DragMode::kSeparable);
  p.smoothing_s = 0.0;
  PerceptRenderer renderer(p);
  DragCoefficients drag;
  drag.valid = true;
  drag.plus[0] = 0.5, drag.minus[0] = 0.1;
  core::JointArray v{};
  for (int i = 0; i < 1000; ++i) renderer.step(drag, true, true, all(2.0), v, kDt);
  v[0] = 0.4;
  EXPECT_NEAR(renderer.step(drag, true, true, all(2.0), v, kDt).torque_Nm[0], -2 * 0.5 * 0.4, 1e-12);
  v[0] = -0.4;
  EXPECT_NEAR(renderer.step(drag, true, true, all(2.0), v, kDt).torque_Nm[0], 2 * 0.1 * 0.4, 1e-12);
}

TEST(PerceptRendering, CoupledEqualsTheLiteralProductWhenNothingLimits) {
  Random random;
  auto p = parameters(DragMode::kCoupled);
  p.smoothing_s = 0.0;
  PerceptRenderer renderer(p);
  const auto drag = random.drag(0.05, false);
  const auto v = random.velocity(0.5);
  RenderedPercept out;
  for (int i = 0; i < 1000; ++i) out = renderer.step(drag, true, true, all(1.5), v, kDt);
  ASSERT_FALSE(out.damping_limited || out.torque_limited);
  for (std::size_t i = 0; i < kPerceptJoints; ++i) {
    double expected = 0.0;
    for (std::size_t j = 0; j < kPerceptJoints; ++j) {
      expected -=
          1.5 * (i >= j ? drag.coupled[triangle_index(i, j)] : drag.coupled[triangle_index(j, i)]) * v[j];
    }
    EXPECT_NEAR(out.torque_Nm[i], expected, 1e-12);
  }
}

TEST_P(Rendering, SaysWhenTheDevicesStabilityHoldsItBack) {
  Random random;
  PerceptRenderer renderer(parameters(GetParam()));
  const auto drag = random.drag(1.0);
  const auto v = random.velocity(1e-3);
  EXPECT_FALSE(renderer.step(drag, true, true, all(0.01), v, kDt).damping_limited);
  const auto out = renderer.step(drag, true, true, all(1000), v, kDt);
  EXPECT_TRUE(out.damping_limited);
  EXPECT_LT(out.gain, 1000);
  EXPECT_GT(out.gain, 0);
}

TEST_P(Rendering, EffectiveDampingNeverExceedsTheDevicesLimit) {
  Random random;
  const auto p = parameters(GetParam());
  for (int i = 0; i < 200; ++i) {
    PerceptRenderer renderer(p);
    const auto drag = random.drag(std::pow(10.0, random.uniform(-2, 3)), true, i % 2 == 0);
    const auto v = random.velocity(1e-6);
    RenderedPercept out;
    for (int k = 0; k < 1000; ++k) out = renderer.step(drag, true, true, all(10), v, kDt);
    double rendered_W = -power(out, v), greatest_W = 0.0;
    for (std::size_t j = 0; j < kPerceptJoints; ++j)
      greatest_W += p.damping_limit_Nms_per_rad[j] * v[j] * v[j];
    EXPECT_LE(rendered_W, greatest_W * (1 + 1e-9));  // D ≤ diag(limit) as quadratic forms
  }
}

TEST_P(Rendering, OverflowGivesNoTorqueThatIsNotANumber) {
  Random random;
  const auto p = parameters(GetParam());
  PerceptRenderer renderer(p);
  const auto drag = random.drag(1.0);
  auto v = random.velocity(1.0);
  for (int i = 0; i < 500; ++i) renderer.step(drag, true, true, all(1.0), v, kDt);
  for (double& speed : v) speed *= 1e308;
  const auto out = renderer.step(drag, true, true, all(1.0), v, kDt);
  for (std::size_t j = 0; j < kPerceptJoints; ++j) {
    ASSERT_TRUE(std::isfinite(out.torque_Nm[j])) << j;
    ASSERT_LE(std::abs(out.torque_Nm[j]), p.torque_cap_Nm[j] * (1 + 1e-12));
  }
}

// A device that can render no damping on one joint: nothing there, and the others stay within their limits.
TEST_P(Rendering, AJointThatMayNotBeDampedTakesNoLimitFromTheOthers) {
  auto p = parameters(GetParam());
  p.damping_limit_Nms_per_rad[1] = 0.0;
  PerceptRenderer renderer(p);
  DragCoefficients drag;
  drag.valid = true;
  drag.plus[0] = drag.minus[0] = drag.coupled[0] = 100.0;  // nothing on joint 1
  core::JointArray v{};
  v[0] = 1e-3;
  RenderedPercept out;
  for (int i = 0; i < 1000; ++i) out = renderer.step(drag, true, true, all(1.0), v, kDt);
  EXPECT_NEAR(out.torque_Nm[0], -p.damping_limit_Nms_per_rad[0] * v[0], 1e-9);
  EXPECT_TRUE(out.damping_limited);
  EXPECT_EQ(out.torque_Nm[1], 0.0);
}

// From phantom to hand: what the phantom reports of a pose and a velocity is what the master renders there.
TEST_P(Rendering, IsTheLawThatThePhantomReportsBy) {
  Random random;
  auto p = parameters(GetParam());
  p.torque_cap_Nm.fill(1e9);
  p.damping_limit_Nms_per_rad.fill(1e9);
  for (const bool directional : {false, true}) {
    for (int i = 0; i < 200; ++i) {
      const auto drag = random.drag(std::pow(10.0, random.uniform(-2, 2)), directional);
      const auto v = random.velocity(std::pow(10.0, random.uniform(-3, 1)));
      PerceptRenderer renderer(p);
      RenderedPercept out;
      for (int k = 0; k < 1000; ++k) out = renderer.step(drag, true, true, all(1.0), v, kDt);
      const auto reported = robot::drag_torque(drag, GetParam(), v, kPerceptJoints);
      double scale = 0.0;
      for (std::size_t j = 0; j < kPerceptJoints; ++j) scale = std::max(scale, std::abs(reported[j]));
      for (std::size_t j = 0; j < kPerceptJoints; ++j)
        ASSERT_NEAR(out.torque_Nm[j], reported[j], 1e-9 * scale) << i;
      ASSERT_LE(power(out, v), 1e-12);
    }
  }
}

// λ is tuned joint by joint (thesis): D becomes √G·D·√G, which stays dissipative.
TEST_P(Rendering, EachJointHasItsOwnGain) {
  Random random;
  auto p = parameters(GetParam());
  p.torque_cap_Nm.fill(1e9);
  p.damping_limit_Nms_per_rad.fill(1e9);
  for (int i = 0; i < 100; ++i) {
    const auto drag = random.drag(1.0);
    const auto v = random.velocity(1.0);
    core::JointArray gain{};
    auto scaled = drag;
    for (std::size_t j = 0; j < kPerceptJoints; ++j) gain[j] = random.uniform(0, 20);
    for (std::size_t j = 0; j < kPerceptJoints; ++j) {
      scaled.plus[j] *= gain[j];
      scaled.minus[j] *= gain[j];
      for (std::size_t k = 0; k <= j; ++k)
        scaled.coupled[triangle_index(j, k)] *= std::sqrt(gain[j] * gain[k]);
    }
    PerceptRenderer renderer(p);
    RenderedPercept out;
    for (int k = 0; k < 1000; ++k) out = renderer.step(drag, true, true, gain, v, kDt);
    const auto expected = robot::drag_torque(scaled, GetParam(), v, kPerceptJoints);
    for (std::size_t j = 0; j < kPerceptJoints; ++j) ASSERT_NEAR(out.torque_Nm[j], expected[j], 1e-7) << i;
    ASSERT_LE(power(out, v), 1e-12);
    ASSERT_NEAR(out.gain, *std::min_element(gain.begin(), gain.begin() + kPerceptJoints), 1e-12);
  }
}

}  // namespace
}  // namespace phantom::teleop::percept_rendering_test
