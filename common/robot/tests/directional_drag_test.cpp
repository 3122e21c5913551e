// Directional drag: the law sensor by sensor, its bounds, and ways there and back.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <optional>

#include "common/robot/tests/drag_rig.hpp"

namespace phantom::robot::directional_drag_test {
namespace {

using core::JointArray;
using drag_rig::Rig;
using test_arms::random_joints;

JointArray random_speeds(std::size_t joints, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 0.3);
  JointArray v{};
  for (std::size_t i = 0; i < joints; ++i) v[i] = normal(random);
  return v;
}

JointArray advance(JointArray q, const JointArray& v, double duration_s) {
  for (std::size_t i = 0; i < q.size(); ++i) q[i] += v[i] * duration_s;
  return q;
}

JointArray reversed(JointArray v) {
  for (double& x : v) x = 0.0 - x;
  return v;
}

/// Rate at which a pose and motion drag against the link's way: Σ wμ|u|² of the link's sensors, from the
/// sensors themselves.
double literal_drag_power(const Rig& rig, std::size_t link, const JointArray& v) {
  double sum = 0.0;
  for (std::size_t s = rig.layout.first[link]; s < rig.layout.first[link + 1]; ++s) {
    const Eigen::Vector3d p = rig.X_WL[link] * rig.layout.position(s);
    sum += rig.layout.weight[s] * static_cast<double>(rig.world.mu(rig.world.grid().index_of(p))) *
           rig.arm.point_velocity_W(link, p, rig.X_WL, v).squaredNorm();
  }
  return sum;
}

TEST(DirectionalDrag, SigmaHasTheSignOfTheChangeOfTheLinksViscosityAsAllJointsMove) {
  Rig rig;
  std::mt19937 random(11);
  int compared = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const JointArray q = random_joints(rig.arm, random), v = random_speeds(7, random);
    const JointArray sigma = rig.at(q, {.enabled = true}, v).sigma;
    for (std::size_t link = 1; link <= 7; ++link) {
      EXPECT_LE(std::abs(sigma[link - 1]), 1.0);
      if (std::abs(sigma[link - 1]) < 0.4) continue;  // a voxel field is too coarse to compare faint slopes
      rig.at(q);
      // Far enough to cross voxels: 30 mm at the mean speed of the sensors that feel something.
      const double speed = std::sqrt(literal_drag_power(rig, link, v) / rig.sensing.sums()[link].mu),
                   time_s = 0.03 / speed;
      rig.at(advance(q, v, time_s));
      const double after = rig.sensing.sums()[link].mu;
      rig.at(advance(q, v, -time_s));
      EXPECT_GT(sigma[link - 1] * (after - rig.sensing.sums()[link].mu), 0.0)
          << "trial " << trial << " link " << link;
      ++compared;
    }
  }
  EXPECT_GT(compared, 40);
}

TEST(DirectionalDrag, GradientSumsAreTheLiteralOnes) {
  Rig rig;
  std::mt19937 random(12);
  rig.at(random_joints(rig.arm, random));
  const double h = 0.04;
  for (std::size_t link = 1; link <= 7; ++link) {
    ViscousSums expected;
    for (std::size_t s = rig.layout.first[link]; s < rig.layout.first[link + 1]; ++s) {
      const Eigen::Vector3d d = rig.X_WL[link].rotation * rig.layout.position(s),
                            p = rig.X_WL[link] * rig.layout.position(s);
      const auto mu = [&](const Eigen::Vector3d& at) {
        return static_cast<double>(rig.world.mu(rig.world.grid().index_of(at)));
      };
      if (mu(p) <= 0.0) continue;
      Eigen::Vector3d g;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(axis);
        g[axis] = (mu(p + step) - mu(p - step)) / (2 * h);
      }
      expected.add({0, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero(), rig.layout.weight[s] * g,
                    rig.layout.weight[s] * d.cross(g), rig.layout.weight[s] * g.squaredNorm() / mu(p)});
    }
    const ViscousSums& actual = rig.sensing.sums()[link];
    EXPECT_LT((actual.gradient - expected.gradient).norm(), 1e-9 * expected.gradient.norm() + 1e-12);
    EXPECT_LT((actual.gradient_moment - expected.gradient_moment).norm(),
              1e-9 * expected.gradient_moment.norm() + 1e-12);
    EXPECT_NEAR(actual.gradient_square, expected.gradient_square, 1e-9 * expected.gradient_square + 1e-12);
  }
}

/// h of the law, written out.
double literal_share(const DirectionalLaw& law, double sigma) {
  if (sigma >= 0.0) return 1.0;
  const double x = std::min(1.0, -sigma / law.full_at);
  return 1.0 - (1.0 - law.leaving_share) * x * x * (3.0 - 2.0 * x);
}

/// B± of every joint from the sensors themselves, by the law as it is told in drag.hpp: +1 forwards, −1
/// backwards.
JointArray literal_directional(const Rig& rig, const DirectionalLaw& law, const JointArray& v,
                               double direction) {
  const double h = 0.04;  // four voxels
  JointArray result{};
  for (std::size_t joint = 0; joint < 7; ++joint) {
    JointArray moving = v, unit{};
    moving[joint] = direction * std::sqrt(v[joint] * v[joint] + law.still * law.still);
    unit[joint] = 1.0;
    for (std::size_t link = joint + 1; link <= 7; ++link) {
      double own = 0.0, drag = 0.0, rise = 0.0, slopes = 0.0;
      for (std::size_t s = rig.layout.first[link]; s < rig.layout.first[link + 1]; ++s) {
        const Eigen::Vector3d p = rig.X_WL[link] * rig.layout.position(s);
        const auto mu = [&](const Eigen::Vector3d& at) {
          return static_cast<double>(rig.world.mu(rig.world.grid().index_of(at)));
        };
        if (mu(p) <= 0.0) continue;
        Eigen::Vector3d g;
        for (int axis = 0; axis < 3; ++axis)
          g[axis] =
              (mu(p + h * Eigen::Vector3d::Unit(axis)) - mu(p - h * Eigen::Vector3d::Unit(axis))) / (2 * h);
        const double w = rig.layout.weight[s];
        const Eigen::Vector3d u = rig.arm.point_velocity_W(link, p, rig.X_WL, moving);
        own += w * mu(p) * rig.arm.point_velocity_W(link, p, rig.X_WL, unit).squaredNorm();
        drag += w * mu(p) * u.squaredNorm();
        rise += w * g.dot(u);
        slopes += w * g.squaredNorm() / mu(p);
      }
      result[joint] += own * literal_share(law, slopes * drag > 0.0 ? rise / std::sqrt(slopes * drag) : 0.0);
    }
  }
  return result;
}

TEST(DirectionalDrag, IsTheLawSensorBySensor) {
  Rig rig;
  std::mt19937 random(16);
  for (int trial = 0; trial < 10; ++trial) {
    const JointArray q = random_joints(rig.arm, random),
                     v = trial < 2 ? JointArray{} : random_speeds(7, random);
    const DirectionalLaw law{.enabled = true, .leaving_share = 0.1 * trial, .full_at = 0.3 + 0.05 * trial};
    const JointArray symmetric = rig.at(q).plus;
    const DragCoefficients& drag = rig.at(q, law, v);
    const JointArray plus = literal_directional(rig, law, v, 1.0),
                     minus = literal_directional(rig, law, v, -1.0);
    for (std::size_t j = 0; j < 7; ++j) {
      EXPECT_NEAR(drag.plus[j], plus[j], 1e-8 * symmetric[j] + 1e-15) << "trial " << trial << " joint " << j;
      EXPECT_NEAR(drag.minus[j], minus[j], 1e-8 * symmetric[j] + 1e-15)
          << "trial " << trial << " joint " << j;
    }
  }
}

TEST(DirectionalDrag, NeverExceedsTheSymmetricCoefficientNorFallsBelowItsShare) {
  Rig rig;
  std::mt19937 random(13);
  for (const double leaving : {0.0, 0.4, 1.0}) {
    for (int trial = 0; trial < 20; ++trial) {
      const JointArray q = random_joints(rig.arm, random), v = random_speeds(7, random);
      const JointArray symmetric = rig.at(q).plus;
      const DragCoefficients& drag = rig.at(q, {.enabled = true, .leaving_share = leaving}, v);
      for (std::size_t j = 0; j < 7; ++j) {
        for (const double b : {drag.plus[j], drag.minus[j]}) {
          EXPECT_LE(b, symmetric[j]);
          EXPECT_GE(b, leaving * symmetric[j]);
        }
        EXPECT_EQ(drag.matrix(j, j), symmetric[j]);
      }
    }
  }
}

TEST(DirectionalDrag, IsContinuousInSpeedAlsoThroughStandstill) {
  Rig rig;
  std::mt19937 random(17);
  for (int trial = 0; trial < 20; ++trial) {
    const JointArray q = random_joints(rig.arm, random), whole = random_speeds(7, random),
                     aside = random_speeds(7, random);
    for (const double share : {-1.0, -0.01, -1e-4, 0.0, 1e-4, 0.01, 1.0}) {
      JointArray v{}, beside{};
      for (std::size_t j = 0; j < 7; ++j) {
        v[j] = j % 3 == 0 ? 0.0 : share * whole[j];
        beside[j] = v[j] + 1e-10 * aside[j];
      }
      const DragCoefficients here = rig.at(q, {.enabled = true}, v),
                             there = rig.at(q, {.enabled = true}, beside);
      for (std::size_t j = 0; j < 7; ++j) {
        EXPECT_NEAR(here.plus[j], there.plus[j], 1e-4 * here.matrix(j, j))
            << "share " << share << " joint " << j;
        EXPECT_NEAR(here.minus[j], there.minus[j], 1e-4 * here.matrix(j, j))
            << "share " << share << " joint " << j;
      }
    }
  }
}

/// How fast what a link has in fluid closes in on the nearest object, as a share of its speed, weighted by
/// drag; and the link's share of the arm's drag power. From geometry alone.
struct Closing {
  double speed_share, drag_share;
};

std::array<Closing, 8> closing(const Rig& rig, const JointArray& v) {
  std::array<Closing, 8> links{};
  double total = 0.0;
  for (std::size_t link = 1; link <= 7; ++link) {
    double drag = 0.0, nearing = 0.0;
    for (std::size_t s = rig.layout.first[link]; s < rig.layout.first[link + 1]; ++s) {
      const Eigen::Vector3d p = rig.X_WL[link] * rig.layout.position(s),
                            u = rig.arm.point_velocity_W(link, p, rig.X_WL, v);
      const double m = rig.layout.weight[s] * static_cast<double>(rig.world.mu(rig.world.grid().index_of(p)));
      if (m <= 0.0) continue;
      drag += m * u.squaredNorm();
      nearing += m * u.norm() * u.dot((test_worlds::nearest_ball(p).head<3>() - p).normalized());
    }
    links[link] = {drag > 0.0 ? nearing / drag : 0.0, drag};
    total += drag;
  }
  for (Closing& link : links) link.drag_share = total > 0.0 ? link.drag_share / total : 0.0;
  return links;
}

/// A stretch of straight way in joint space, outside of the objects, on which all joints move and every link
/// that is felt nears: what it has in fluid closes in with a third of its speed or more.
struct Approach {
  JointArray start{}, v{};
  double duration_s = 0.0;
};

bool nears(Rig& rig, const JointArray& q, const JointArray& v) {
  rig.at(q);
  if (!rig.sensing.worst().found || rig.sensing.worst().mu >= 100.0F)
    return false;  // nothing to feel, or in an object
  for (const auto& [speed_share, drag_share] : closing(rig, v)) {
    if (drag_share > 0.002 && speed_share < 1.0 / 3.0) return false;
  }
  return true;
}

/// None if the pose and motion that chance gives are no approach, or one of less than 0.15 s.
std::optional<Approach> random_approach(Rig& rig, std::mt19937& random) {
  Approach path;
  path.start = random_joints(rig.arm, random);
  std::uniform_real_distribution<double> speed(0.02, 0.2);
  for (std::size_t j = 0; j < 7; ++j) path.v[j] = random() % 2 == 0 ? speed(random) : -speed(random);
  if (!nears(rig, path.start, path.v)) return std::nullopt;
  while (path.duration_s < 1.0) {
    const JointArray before = advance(path.start, path.v, -0.05);
    if (!nears(rig, before, path.v)) break;
    path.start = before;
    path.duration_s += 0.05;
  }
  return path.duration_s < 0.14 ? std::nullopt : std::optional(path);
}

/// Σ|τ_l| and power along the way, or back along it.
std::pair<double, double> felt_along(Rig& rig, const Approach& path, bool back, const DirectionalLaw& law,
                                     DragMode mode) {
  double torque_sum = 0.0, power = 0.0;
  for (int i = 0; i <= 30; ++i) {
    const JointArray v = back ? reversed(path.v) : path.v;
    const JointArray torque =
        drag_torque(rig.at(advance(path.start, path.v, path.duration_s * i / 30), law, v), mode, v, 7);
    for (std::size_t j = 0; j < 7; ++j) torque_sum += std::abs(torque[j]), power -= torque[j] * v[j];
  }
  return {torque_sum, power};
}

TEST(DirectionalDrag, RetreatOnAnyApproachOfSevenMovingJointsCostsLessThanATenth) {
  Rig rig;
  std::mt19937 random(18);
  int paths = 0;
  for (int trial = 0; trial < 50000 && paths < 100; ++trial) {
    const auto path = random_approach(rig, random);
    if (!path) continue;
    ++paths;
    for (const DragMode mode : {DragMode::kSeparable, DragMode::kCoupled}) {
      SCOPED_TRACE(testing::Message() << "trial " << trial << " mode " << static_cast<int>(mode));
      const auto [symmetric_torque, symmetric_power] = felt_along(rig, *path, false, {}, mode);
      const auto [back_torque, back_power] = felt_along(rig, *path, true, {}, mode);
      EXPECT_NEAR(back_torque, symmetric_torque, 1e-9 * symmetric_torque);
      EXPECT_NEAR(back_power, symmetric_power, 1e-9 * symmetric_power);
      const DirectionalLaw law{.enabled = true};
      const auto [torque, power] = felt_along(rig, *path, false, law, mode);
      const auto [freed_torque, freed_power] = felt_along(rig, *path, true, law, mode);
      EXPECT_GT(power, 0.95 * symmetric_power) << "nearing is felt";
      EXPECT_LT(freed_torque, 0.1 * torque);
      EXPECT_LT(freed_power, 0.1 * power);
    }
  }
  EXPECT_EQ(paths, 100);
}

}  // namespace
}  // namespace phantom::robot::directional_drag_test
