// A medium and its current against the sums written out sensor by sensor, and what drag in a current does to
// energy.
#include "common/robot/drag/medium.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/robot/tests/drag_rig.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::robot {
namespace {

using core::JointArray;

constexpr std::size_t kArmJoints = 7;

/// A pool whose surface cuts the arm, a jet in it, and a slow layer over its floor that hides the jet there.
Medium pool() {
  MediumRegion water, jet, sump;
  water.mu_Pa_s_per_m = 2.0;
  water.max_m.z() = 1.13;
  water.current_m_s = {0.03, -0.02, 0.0};
  jet = water;
  jet.min_m = {-0.1, -0.4, 0.2};
  jet.max_m = {0.3, 0.4, 1.0};
  jet.current_m_s = {0.0, 0.2, -0.05};
  sump.mu_Pa_s_per_m = 5.0;
  sump.max_m.z() = 0.7;
  return {water, jet, sump};
}

/// Sums over the joints of all moving links, as the definitions have them.
struct Literal {
  double matrix[kArmJoints][kArmJoints] = {};  // Σ wμ J_i·J_j
  JointArray push{};                           // Σ wμ J_i·u
  int immersed = 0, dry = 0;
};

struct PoolRig : drag_rig::Rig {
  explicit PoolRig(Normalisation normalisation = Normalisation::kArea) : Rig(normalisation) {
    fingers = layout;
    fingers.closing_m.assign(layout.size(), Eigen::Vector3d::Zero());
    for (std::size_t i = layout.first[7]; i < layout.size(); i += 3)
      fingers.closing_m[i] = {0.02, -0.01, 0.03};
  }
  Literal literal(const JointArray& q, double closed) {
    arm.link_poses(q, X_WL);
    Literal sums;
    for (std::size_t link = 1; link <= kArmJoints; ++link) {
      std::vector<std::pair<Eigen::Vector3d, MediumRegion>> wet;
      std::vector<double> weights;
      for (std::size_t i = layout.first[link]; i < layout.first[link + 1]; ++i) {
        const Eigen::Vector3d p = X_WL[link] * fingers.position(i, closed);
        const MediumRegion* there = nullptr;
        for (const MediumRegion& region : medium)
          if ((p.array() >= region.min_m.array()).all() && (p.array() < region.max_m.array()).all())
            there = &region;
        ++(there != nullptr ? sums.immersed : sums.dry);
        if (there == nullptr) continue;
        wet.emplace_back(p, *there);
        weights.push_back(layout.weight[i]);
      }
      const double share = layout.normalisation == Normalisation::kActive && !wet.empty()
                               ? 1.0 / static_cast<double>(wet.size())
                               : 1.0;
      for (std::size_t k = 0; k < wet.size(); ++k) {
        const auto& [p, region] = wet[k];
        const double m = share * weights[k] * region.mu_Pa_s_per_m;
        std::array<Eigen::Vector3d, kArmJoints> column;
        for (std::size_t j = 0; j < kArmJoints; ++j) {
          JointArray unit{};
          unit[j] = 1.0;
          column[j] = arm.point_velocity_W(link, p, X_WL, unit);
          sums.push[j] += m * column[j].dot(region.current_m_s);
        }
        for (std::size_t i = 0; i < kArmJoints; ++i)
          for (std::size_t j = 0; j < kArmJoints; ++j) sums.matrix[i][j] += m * column[i].dot(column[j]);
      }
    }
    return sums;
  }
  /// Coefficients of objects and medium as a tick computes them.
  DragCoefficients with_medium(const JointArray& q, DragMode mode, double closed = 0.0) {
    DragCoefficients result = at(q);
    MediumSensing sensing_medium(fingers, medium);
    sensing_medium.sense(X_WL, kArmJoints, closed);
    add_medium_drag(arm, X_WL, sensing_medium.sums(), mode, result);
    return result;
  }
  Medium medium = pool();
  SkinLayout fingers;  // the layout, with sensors of the last link that move as a gripper closes
};

JointArray random_velocity(std::mt19937& random, double scale) {
  std::normal_distribution<double> normal(0.0, scale);
  JointArray v{};
  for (std::size_t j = 0; j < kArmJoints; ++j) v[j] = normal(random);
  return v;
}

double power_W(const JointArray& torque, const JointArray& v) {
  double sum = 0.0;
  for (std::size_t j = 0; j < kArmJoints; ++j) sum += torque[j] * v[j];
  return sum;
}

class MediumNormalisations : public testing::TestWithParam<Normalisation> {};
INSTANTIATE_TEST_SUITE_P(All, MediumNormalisations,
                         testing::Values(Normalisation::kArea, Normalisation::kCount, Normalisation::kActive,
                                         Normalisation::kNone));

TEST_P(MediumNormalisations, AddsTheSumsOverAllSensorsThatAreInIt) {
  PoolRig rig(GetParam());
  std::mt19937 random(5);
  int cut = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const JointArray q = test_arms::random_joints(rig.arm, random, 2.0);
    const double closed = trial % 2 == 0 ? 0.0 : 0.7;
    const DragCoefficients objects = rig.at(q);
    const DragCoefficients both = rig.with_medium(q, DragMode::kSeparable, closed);
    const Literal literal = rig.literal(q, closed);
    cut += literal.immersed > 0 && literal.dry > 0 ? 1 : 0;
    for (std::size_t i = 0; i < kArmJoints; ++i) {
      const double size = literal.matrix[i][i] + objects.matrix(i, i) + 1e-9;
      EXPECT_NEAR(both.plus[i] - objects.plus[i], literal.matrix[i][i], 1e-9 * size);
      EXPECT_NEAR(both.minus[i] - objects.minus[i], literal.matrix[i][i], 1e-9 * size);
      EXPECT_NEAR(both.drift[i] * both.matrix(i, i), literal.push[i], 1e-9 * size);
      for (std::size_t j = 0; j <= i; ++j)
        EXPECT_NEAR(both.matrix(i, j) - objects.matrix(i, j), literal.matrix[i][j],
                    1e-9 * std::sqrt(size * (literal.matrix[j][j] + objects.matrix(j, j) + 1e-9)));
    }
  }
  EXPECT_GT(cut, 10) << "the surface cuts the arm";
}

TEST(Medium, WithoutOneNothingChanges) {
  PoolRig rig;
  rig.medium.clear();
  std::mt19937 random(6);
  const JointArray q = test_arms::random_joints(rig.arm, random, 2.0);
  EXPECT_EQ(rig.with_medium(q, DragMode::kCoupled), rig.at(q));
  rig.medium = pool();
  for (MediumRegion& region : rig.medium) region.min_m.z() = 50.0, region.max_m.z() = 60.0;
  EXPECT_EQ(rig.with_medium(q, DragMode::kCoupled), rig.at(q)) << "the arm is in air";
}

TEST(Medium, ALinkWithoutAPoseFeelsNothing) {
  PoolRig rig;
  rig.arm.link_poses({}, rig.X_WL);
  rig.X_WL[3].translation_m.x() = std::nan("");
  MediumSensing sensing(rig.layout, rig.medium);
  sensing.sense(rig.X_WL, kArmJoints, 0.0);
  EXPECT_EQ(sensing.sums()[3].fluid.mu, 0.0);
  EXPECT_GT(sensing.sums()[4].fluid.mu, 0.0);
}

// Fast enough, the drag is Σ wμ Jᵀ(Jv − u) to the letter; c is where it would vanish.
TEST(MediumCurrent, FromItsOwnSpeedOnTheDragIsThatOfTheRelativeVelocity) {
  PoolRig rig;
  std::mt19937 random(7);
  for (int trial = 0; trial < 20; ++trial) {
    const JointArray q = test_arms::random_joints(rig.arm, random, 2.0);
    const JointArray v = random_velocity(random, 100.0);
    const Literal literal = rig.literal(q, 0.0);
    const DragCoefficients separable = rig.with_medium(q, DragMode::kSeparable);
    const DragCoefficients coupled = rig.with_medium(q, DragMode::kCoupled);
    const JointArray each = drag_torque(separable, DragMode::kSeparable, v, kArmJoints),
                     all = drag_torque(coupled, DragMode::kCoupled, v, kArmJoints);
    for (std::size_t i = 0; i < kArmJoints; ++i) {
      const double own = separable.matrix(i, i);
      if (std::abs(v[i]) >= std::abs(separable.drift[i])) {
        EXPECT_NEAR(each[i], -own * v[i] + literal.push[i], 1e-9 * (own * std::abs(v[i]) + 1e-9));
      }
      double relative = literal.push[i];
      for (std::size_t j = 0; j < kArmJoints; ++j) relative -= coupled.matrix(i, j) * v[j];
      // D·c is b but for a millionth of the diagonal's part.
      EXPECT_NEAR(
          all[i], relative,
          1.1e-6 * coupled.matrix(i, i) * std::abs(coupled.drift[i]) + 1e-9 * std::abs(relative) + 1e-12)
          << i;
    }
  }
}

// Drag dissuades, never pushes, and vanishes at rest, in any current.
TEST(MediumCurrent, TheDragNeverPushesAndIsContinuousWithTwiceTheCoefficientAtMost) {
  PoolRig rig;
  std::mt19937 random(8);
  std::uniform_real_distribution<double> exponent(-6.0, 1.0);
  for (const DragMode mode : {DragMode::kSeparable, DragMode::kCoupled}) {
    for (int trial = 0; trial < 20; ++trial) {
      DragCoefficients drag = rig.with_medium(test_arms::random_joints(rig.arm, random, 2.0), mode);
      ASSERT_NE(drag.drift, JointArray{});
      EXPECT_EQ(drag_torque(drag, mode, {}, kArmJoints), JointArray{});
      for (int i = 0; i < 500; ++i) {
        const JointArray v = random_velocity(random, std::pow(10.0, exponent(random)));
        if (i == 250) drag.drift = random_velocity(random, 5.0);  // whatever the network says
        const JointArray torque = drag_torque(drag, mode, v, kArmJoints);
        ASSERT_LE(power_W(torque, v), 0.0);
        JointArray change = random_velocity(random, 0.01), near = v;
        for (std::size_t j = 0; j < kArmJoints; ++j) near[j] += change[j] *= std::abs(v[0]);
        const JointArray other = drag_torque(drag, mode, near, kArmJoints);
        // v − s·c changes by 2·|Δv| at most, in the norm of D.
        double square = 0.0, along = 0.0;
        for (std::size_t a = 0; a < kArmJoints; ++a) {
          along += (other[a] - torque[a]) * change[a];
          for (std::size_t b = 0; b < kArmJoints; ++b)
            square +=
                mode == DragMode::kSeparable && a != b ? 0.0 : change[a] * drag.matrix(a, b) * change[b];
        }
        const double rounding = 1e-14 * (std::abs(power_W(torque, v)) + std::abs(power_W(torque, change)));
        ASSERT_LE(std::abs(along), 2.0 * square * (1 + 1e-6) + rounding);
      }
    }
  }
}

TEST(MediumCurrent, AJointAloneMeetsTwiceTheMediumAgainstItAndNothingWithItUntilItIsFaster) {
  DragCoefficients drag;
  drag.plus[0] = drag.minus[0] = drag.coupled[0] = 3.0;
  drag.drift[0] = 0.2;
  for (const DragMode mode : {DragMode::kSeparable, DragMode::kCoupled}) {
    const auto torque = [&](double v) { return drag_torque(drag, mode, {v}, 1)[0]; };
    EXPECT_NEAR(torque(0.1), 0.0, 1e-9) << "it goes with the current";
    EXPECT_NEAR(torque(0.5), -3.0 * 0.3, 1e-9);
    EXPECT_NEAR(torque(-0.1), 3.0 * 0.2, 1e-9);
    EXPECT_NEAR(torque(-0.5), 3.0 * 0.7, 1e-9);
  }
}

TEST(Medium, ATickAllocatesNothing) {
  PoolRig rig;
  std::mt19937 random(9);
  const JointArray q = test_arms::random_joints(rig.arm, random, 2.0);
  DragCoefficients drag = rig.at(q);
  MediumSensing sensing(rig.layout, rig.medium);
  const test::HeapGuard guard;
  sensing.sense(rig.X_WL, kArmJoints, 0.3);
  add_medium_drag(rig.arm, rig.X_WL, sensing.sums(), DragMode::kCoupled, drag);
  drag_torque(drag, DragMode::kCoupled, {0.1, 0.2}, kArmJoints);
}

}  // namespace
}  // namespace phantom::robot
