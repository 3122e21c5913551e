// Cluster sensors against the thesis's sums, written out; the fraction of a voxel in a sphere against its
// volume.
#include "common/robot/sensing/cluster_sensor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "common/robot/drag/drag.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/robot/tests/test_worlds.hpp"
#include "common/workspace/voxel_box.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::robot {
namespace {

using testing::HasSubstr;

const workspace::Workspace& world() {
  static const workspace::Workspace workspace = test_worlds::balls();
  return workspace;
}

/// Share of the voxel at (x,y,z) inside the sphere, by counting points.
double counted_fraction(int x, int y, int z, double radius,
                        const Eigen::Vector3d& stretch = Eigen::Vector3d::Ones()) {
  const int n = 100;
  int inside = 0;
  for (int i = 0; i < n * n * n; ++i) {
    const Eigen::Vector3d p(x - 0.5 + (i % n + 0.5) / n, y - 0.5 + (i / n % n + 0.5) / n,
                            z - 0.5 + (i / n / n + 0.5) / n);
    inside += p.cwiseProduct(stretch).squaredNorm() <= radius * radius ? 1 : 0;
  }
  return inside / static_cast<double>(n * n * n);
}

/// SSA of eq. 6.1 and its type 2, in quarters of a voxel's shortest side so that comparisons are exact.
double ssa(const ClusterSpec& spec, int x, int y, int z, const Eigen::Vector3d& stretch) {
  const int m = spec.reach_vox;
  if (spec.shape == ClusterShape::kFraction) return fraction_in_sphere(x, y, z, m + 0.5, stretch);
  const Eigen::Array3i at = (4.0 * stretch.cwiseProduct(Eigen::Vector3d(x, y, z))).cast<int>();
  if (spec.shape == ClusterShape::kCube) return at.abs().maxCoeff() <= 4 * m ? 1.0 : 0.0;
  const int radius = spec.shape == ClusterShape::kSphere ? 4 * m : 4 * m + 2;
  return at.square().sum() <= radius * radius ? 1.0 : 0.0;
}

constexpr std::array kClusterShapes{ClusterShape::kCube, ClusterShape::kSphere,
                                    ClusterShape::kSphereContained, ClusterShape::kFraction};
/// Voxels that are cubes, and such as are not.
const std::array<Eigen::Vector3d, 3> kVoxelStretches{Eigen::Vector3d{1, 1, 1}, {1, 1.25, 4}, {8, 1, 1.5}};

/// SSA of every voxel around a sensor, in the order of literal(): worked out once, for many sensors.
struct LiteralZone {
  explicit LiteralZone(const ClusterSpec& spec, const Eigen::Vector3d& stretch = Eigen::Vector3d::Ones())
      : reach_vox(spec.reach_vox) {
    const int m = reach_vox;
    for (int x = -m; x <= m; ++x) {
      for (int y = -m; y <= m; ++y) {
        for (int z = -m; z <= m; ++z) weight.push_back(ssa(spec, x, y, z, stretch));
      }
    }
  }
  int reach_vox;
  std::vector<double> weight;
};

/// Σ(SLA·SSA)/ΣSSA, literally, and the greatest code where SSA is not 0.
ClusterReading literal(const LiteralZone& zone, const workspace::Workspace& workspace, workspace::Index3 c,
                       const ResponseCurve& curve) {
  double sum = 0.0, weight = 0.0;
  ClusterReading reading;
  const int m = zone.reach_vox;
  auto ssa_of_voxel = zone.weight.begin();
  for (int x = -m; x <= m; ++x) {
    for (int y = -m; y <= m; ++y) {
      for (int z = -m; z <= m; ++z) {
        const double w = *ssa_of_voxel++;
        const workspace::Index3 v{c.x + x, c.y + y, c.z + z};
        sum += w * curve(static_cast<double>(workspace.mu(v)));
        weight += w;
        if (w > 0.0) reading.greatest = std::max(reading.greatest, workspace.mu_code(v));
      }
    }
  }
  reading.mean = sum / weight;
  return reading;
}

TEST(FractionInSphere, SumsUpToTheSpheresVolume) {
  for (const double radius : {0.3, 0.5, 1.5, 2.5, 3.5, 3.2}) {
    const int m = static_cast<int>(std::ceil(radius));
    double volume = 0.0;
    for (int x = -m; x <= m; ++x) {
      for (int y = -m; y <= m; ++y) {
        for (int z = -m; z <= m; ++z) volume += fraction_in_sphere(x, y, z, radius);
      }
    }
    EXPECT_NEAR(volume, 4.0 / 3.0 * std::numbers::pi * radius * radius * radius, 1e-8) << radius;
  }
}

TEST(FractionInSphere, OfVoxelsThatAreNoCubesSumsUpToTheSameVolumeAndIsTheShareOfPoints) {
  for (const Eigen::Vector3d& stretch : kVoxelStretches) {
    double volume = 0.0;
    for (int x = -4; x <= 4; ++x) {
      for (int y = -4; y <= 4; ++y) {
        for (int z = -4; z <= 4; ++z) volume += fraction_in_sphere(x, y, z, 3.5, stretch) * stretch.prod();
      }
    }
    EXPECT_NEAR(volume, 4.0 / 3.0 * std::numbers::pi * 3.5 * 3.5 * 3.5, 1e-7) << stretch.transpose();
    for (const auto& [x, y, z] : {std::array{0, 0, 0}, {0, 1, 1}, {1, 2, -2}, {0, 0, -1}, {3, 1, 0}})
      EXPECT_NEAR(fraction_in_sphere(x, y, z, 3.5, stretch), counted_fraction(x, y, z, 3.5, stretch), 2e-3);
  }
}

TEST(FractionInSphere, IsTheShareOfPointsAndTheSameAlongEveryAxis) {
  for (const auto& [x, y, z] : {std::array{3, 0, 0}, {2, 2, 1}, {2, -2, -2}, {0, 1, -3}, {3, 1, 1}}) {
    const double fraction = fraction_in_sphere(x, y, z, 3.5);
    EXPECT_NEAR(fraction, counted_fraction(x, y, z, 3.5), 2e-3);
    EXPECT_NEAR(fraction, fraction_in_sphere(z, x, y, 3.5), 1e-9);
    EXPECT_NEAR(fraction, fraction_in_sphere(-y, -z, -x, 3.5), 1e-9);
  }
  EXPECT_EQ(fraction_in_sphere(0, 0, 0, 3.5), 1.0);
  EXPECT_EQ(fraction_in_sphere(4, 2, 0, 3.5), 0.0);
}

TEST(ClusterSensor, HasTheThesissNumbersOfVoxels) {
  EXPECT_EQ(ClusterStencil({3, ClusterShape::kCube}).voxel_count(), 343U);
  EXPECT_EQ(ClusterStencil({3, ClusterShape::kSphere}).voxel_count(), 123U);
  EXPECT_EQ(ClusterStencil({1, ClusterShape::kSphere}).voxel_count(), 7U);
  for (const auto& [m, voxels] : {std::pair{1, 19U}, {2, 81U}, {3, 179U}})  // as shaping elements (table 4.1)
    EXPECT_EQ(ClusterStencil({m, ClusterShape::kSphereContained}).voxel_count(), voxels) << m;
  EXPECT_NEAR(ClusterStencil({3, ClusterShape::kFraction}).total_weight(),
              4.0 / 3.0 * std::numbers::pi * 3.5 * 3.5 * 3.5, 1e-8);
}

std::vector<std::pair<Eigen::Vector3d, ClusterShape>> stretches_and_shapes() {
  std::vector<std::pair<Eigen::Vector3d, ClusterShape>> all;
  for (const Eigen::Vector3d& stretch : kVoxelStretches)
    for (const ClusterShape shape : kClusterShapes) all.emplace_back(stretch, shape);
  return all;
}

// A wall is felt from as far away along every axis, to one voxel's side.
TEST(ClusterSensor, FeelsAsFarInMetresAlongEveryAxis) {
  const Eigen::Vector3d sides_m(0.01, 0.01, 0.04);
  const workspace::VoxelSize size(sides_m);
  constexpr int kWall_vox = 30;
  for (const ClusterShape shape : kClusterShapes) {
    for (const int m : {3, 6, 15}) {
      const ClusterStencil stencil({m, shape}, size.stretch());
      for (std::size_t axis = 0; axis < 3; ++axis) {
        workspace::Workspace wall({Eigen::Vector3d::Zero(), size, {32, 32, 32}}, {0.0F, 9.0F});
        auto brick = wall.edit_brick({0, 0, 0});
        workspace::VoxelBox::of(wall.grid()).for_each([&](workspace::Index3 v) {
          if (v[axis] >= kWall_vox)
            brick.mu_code[workspace::brick_offset(static_cast<std::uint32_t>(v.x),
                                                  static_cast<std::uint32_t>(v.y),
                                                  static_cast<std::uint32_t>(v.z))] = 1;
        });
        ResponseTable table;
        fill_response({}, wall.palette(), table);
        workspace::Index3 at{16, 16, 16};
        at[axis] = 0;
        while (!(stencil.read(wall, at, table).mean > 0.0)) ++at[axis];
        const double side_m = size[axis], from_centre_m = (kWall_vox - at[axis]) * side_m;
        EXPECT_LT(from_centre_m, 0.01 * (m + 0.5) + 0.5 * side_m + 1e-9) << "m = " << m << " along " << axis;
        EXPECT_GT(from_centre_m, 0.01 * m - side_m) << "m = " << m << " along " << axis;
      }
    }
  }
}

TEST(ClusterSensor, ReadsTheLiteralMean) {
  const ResponseCurve curve({{0.0, 0.5}, {9.0, 9.0}, {100.0, 40.0}});
  ResponseTable plain, shaped;
  fill_response({}, world().palette(), plain);
  fill_response(curve, world().palette(), shaped);
  std::mt19937 random(1);
  double felt = 0.0;
  for (const auto& [stretch, shape] : stretches_and_shapes()) {
    for (const int m : {1, 2, 3, 5, 8, 15}) {
      const ClusterSpec spec{m, shape};
      const ClusterStencil stencil(spec, stretch);
      const LiteralZone zone(spec, stretch);
      for (int trial = 0; trial < 12; ++trial) {
        // Everywhere: amid bricks, across their borders, over the grid's border, outside.
        const auto at = [&] { return std::uniform_int_distribution<std::int32_t>(-5, 245)(random); };
        const workspace::Index3 centre{at(), at(), at()};
        for (const auto& [table, law] : {std::pair{&plain, ResponseCurve()}, std::pair{&shaped, curve}}) {
          const ClusterReading reading = stencil.read(world(), centre, *table),
                               expected = literal(zone, world(), centre, law);
          EXPECT_NEAR(reading.mean, expected.mean, 1e-11 * (1.0 + expected.mean));
          EXPECT_EQ(reading.greatest, expected.greatest);
        }
        felt += stencil.read(world(), centre, plain).mean;
      }
    }
  }
  EXPECT_GT(felt, 0.0);
}

TEST(ClusterSensor, ReadsTheSameWithAPaletteTooLargeToCount) {
  std::vector<float> many{0.0F};
  for (int i = 1; i < 60; ++i) many.push_back(static_cast<float>(i) * 1.5F);
  workspace::Workspace workspace({Eigen::Vector3d::Zero(), 0.01, {64, 64, 64}}, many);
  std::mt19937 random(2);
  for (const workspace::BrickKey key : {workspace::BrickKey{0, 0, 0}, {1, 0, 0}, {1, 1, 1}}) {
    auto brick = workspace.edit_brick(key);
    for (std::size_t i = 0; i < workspace::kBrickVoxels; ++i)
      brick.mu_code[i] = static_cast<std::uint8_t>(random() % 60);
  }
  ResponseTable table;
  fill_response({}, many, table);
  const ClusterSpec spec{3, ClusterShape::kSphere};
  const LiteralZone zone(spec);
  for (int i = 5; i < 58; i += 3) {
    const ClusterReading reading = ClusterStencil(spec).read(workspace, {i, 30, 31}, table);
    const ClusterReading expected = literal(zone, workspace, {i, 30, 31}, {});
    EXPECT_NEAR(reading.mean, expected.mean, 1e-11 * (1.0 + expected.mean));
    EXPECT_EQ(reading.greatest, expected.greatest);
  }
}

TEST(ResponseCurve, IsStraightBetweenItsPointsAndLevelBeyond) {
  const ResponseCurve curve({{5.0, 1.0}, {10.0, 3.0}, {20.0, 3.5}});
  EXPECT_EQ(curve(2.0), 1.0);
  EXPECT_DOUBLE_EQ(curve(7.5), 2.0);
  EXPECT_DOUBLE_EQ(curve(12.0), 3.1);
  EXPECT_EQ(curve(100.0), 3.5);
  EXPECT_EQ(ResponseCurve()(42.0), 42.0);
  EXPECT_THROW(ResponseCurve({{5.0, 1.0}, {5.0, 2.0}}), std::invalid_argument);
  EXPECT_THROW(ResponseCurve({{5.0, -1.0}}), std::invalid_argument);
}

// ---- in a skin

struct Rig {
  explicit Rig(const std::vector<LinkSkin>& skin, const SensingOptions& options = {.gradient = true},
               Normalisation normalisation = Normalisation::kArea)
      : arm(test_arms::suspended()),
        layout(*lay_out_skin(arm, skin, {.voxel_size_m = 0.01, .normalisation = normalisation})),
        sensing(layout, options) {}

  void at(const core::JointArray& q) {
    arm.link_poses(q, X_WL);
    sensing.sense(X_WL, 7, world());
  }
  SerialArm arm;
  SkinLayout layout;
  SkinSensing sensing;
  LinkPoses X_WL;
};

std::vector<LinkSkin> slender(const ClusterSpec& spec) {
  std::vector<LinkSkin> skin;
  for (const LinkSkin& tube : test_worlds::tubes()) {
    AxisSensors axis;
    axis.to_m = tube.segments[0].to_m;
    axis.cluster = spec;
    axis.gain = 1.5;
    skin.push_back({tube.link, {}, {axis}, {}});
  }
  return skin;
}

TEST(ClusterSkin, SumsAreTheLiteralOnes) {
  for (const auto normalisation : {Normalisation::kArea, Normalisation::kCount, Normalisation::kActive}) {
    for (const auto shape : {ClusterShape::kCube, ClusterShape::kFraction}) {
      // Points, netting and slender sensors on the same links.
      auto skin = slender({2, shape});
      const auto tubes = test_worlds::tubes();
      skin.insert(skin.end(), tubes.begin(), tubes.end());
      skin[1].segments = tubes[1].segments;
      skin[1].segments[0].cluster = ClusterSpec{1, ClusterShape::kSphere};
      Rig rig(skin, {.gradient = true}, normalisation);
      const std::vector<LiteralZone> zones(rig.layout.clusters.begin(), rig.layout.clusters.end());
      std::mt19937 random(3);
      double felt = 0.0;
      for (int trial = 0; trial < 6; ++trial) {
        core::JointArray q{};
        for (std::size_t i = 0; i < 7; ++i) q[i] = std::uniform_real_distribution(-0.9, 0.9)(random);
        rig.at(q);
        for (std::size_t link = 1; link <= 7; ++link) {
          ViscousSums expected;
          std::size_t active = 0;
          for (std::size_t s = rig.layout.first[link]; s < rig.layout.first[link + 1]; ++s) {
            const Eigen::Vector3d p = rig.X_WL[link] * rig.layout.position(s),
                                  d = p - rig.X_WL[link].translation_m;
            const workspace::Index3 v = world().grid().index_of(p);
            const std::uint8_t kind = rig.layout.cluster_kind[s];
            const double mu = kind == 0 ? static_cast<double>(world().mu(v))
                                        : literal(zones[kind - 1U], world(), v, {}).mean;
            if (!(mu > 0.0)) continue;
            ++active;
            const double w = rig.layout.weight[s];
            Eigen::Vector3d g;
            const auto at = [&](int x, int y, int z) {
              return static_cast<double>(world().mu({v.x + x, v.y + y, v.z + z}));
            };
            g << at(4, 0, 0) - at(-4, 0, 0), at(0, 4, 0) - at(0, -4, 0), at(0, 0, 4) - at(0, 0, -4);
            g /= 0.08;
            expected.add({w * mu, w * mu * d, w * mu * d * d.transpose(), w * g, w * d.cross(g),
                          w * g.squaredNorm() / mu});
          }
          if (normalisation == Normalisation::kActive && active > 0)
            expected.scale(1.0 / static_cast<double>(active));
          const ViscousSums& sums = rig.sensing.sums()[link];
          EXPECT_NEAR(sums.mu, expected.mu, 1e-9 * expected.mu + 1e-15);
          EXPECT_LT((sums.mu_d - expected.mu_d).norm(), 1e-9 * expected.mu_d.norm() + 1e-12);
          EXPECT_LT((sums.mu_dd - expected.mu_dd).norm(), 1e-9 * expected.mu_dd.norm() + 1e-12);
          EXPECT_LT((sums.gradient - expected.gradient).norm(), 1e-9 * expected.gradient.norm() + 1e-10);
          EXPECT_LT((sums.gradient_moment - expected.gradient_moment).norm(),
                    1e-9 * expected.gradient_moment.norm() + 1e-10);
          EXPECT_NEAR(sums.gradient_square, expected.gradient_square,
                      1e-9 * expected.gradient_square + 1e-10);
          felt += sums.mu;
        }
      }
      EXPECT_GT(felt, 0.0);
    }
  }
}

/// Thesis 6.4.2: 20 spheres of m = 3 along a link follow 60 point sensors on it, but rise smoothly.
TEST(ClusterSkin, TwentySpheresMatchSixtyPoints) {
  // A link of 0.57 m turns towards a bar; voxels of 10 mm, six layers of 40 mm.
  const SerialArm arm = test_arms::load(
      test_arms::link("base", 0, "0 0 0") + test_arms::link("bar", 1, "0.3 0 0") +
          test_arms::moving_joint("j", "revolute", "base", "bar", "0 0 0", "0 0 0", "0 0 1", 3),
      "bar", test_arms::at(-0.3, -0.4, 1.0));
  const workspace::Workspace bar = test_worlds::make([](const Eigen::Vector3d& p) {
    return test_worlds::layer_code(
        std::hypot(std::max(0.0, std::abs(p.y() - 0.1) - 0.025), std::max(0.0, std::abs(p.z() - 1.0) - 0.1)));
  });
  const auto drags = [&](std::optional<ClusterSpec> cluster, int count) {
    AxisSensors axis;
    axis.to_m = {0.57, 0.0, 0.0};
    axis.count = count;
    axis.cluster = cluster;
    const SkinLayout layout = *lay_out_skin(arm, {{"bar", {}, {axis}, {}}},
                                            {.voxel_size_m = 0.01, .normalisation = Normalisation::kCount});
    SkinSensing sensing(layout, {});
    std::vector<double> drag;
    for (double q = 0.0; q < 0.85; q += 0.01) {
      LinkPoses X_WL;
      DragCoefficients result;
      arm.link_poses({q}, X_WL);
      sensing.sense(X_WL, 1, bar);
      drag_coefficients(arm, X_WL, sensing.sums(), {}, {}, result);
      drag.push_back(result.plus[0]);
    }
    return drag;
  };
  const auto spheres = drags(ClusterSpec{3, ClusterShape::kSphere}, 20), points = drags(std::nullopt, 60),
             coarse = drags(std::nullopt, 20);
  const double greatest = *std::max_element(points.begin(), points.end());
  // A sphere feels m voxels ahead and behind: at the tip that is this many steps of the way.
  const std::size_t ahead = 7;
  double roughness_of_spheres = 0.0, roughness_of_coarse = 0.0;
  for (std::size_t i = 1; i + ahead < spheres.size(); ++i) {
    EXPECT_GE(spheres[i], points[i > ahead ? i - ahead : 0] - 0.01 * greatest) << i;
    EXPECT_LE(spheres[i], points[i + ahead] + 0.01 * greatest) << i;
    EXPECT_GE(spheres[i], spheres[i - 1] - 0.002 * greatest) << "not monotonic at " << i;
    roughness_of_spheres = std::max(roughness_of_spheres, spheres[i] - spheres[i - 1]);
    roughness_of_coarse = std::max(roughness_of_coarse, std::abs(coarse[i] - coarse[i - 1]));
  }
  EXPECT_LT(roughness_of_spheres, roughness_of_coarse);
}

TEST(ClusterSkin, WorstSensorOfASlenderLinkIsWhereItsZoneMeetsTheMost) {
  Rig rig(slender({3, ClusterShape::kSphere}));
  const LiteralZone zone({3, ClusterShape::kSphere});
  std::mt19937 random(4);
  int found = 0;
  for (int trial = 0; trial < 20; ++trial) {
    core::JointArray q{};
    for (std::size_t i = 0; i < 7; ++i) q[i] = std::uniform_real_distribution(-0.9, 0.9)(random);
    rig.at(q);
    std::uint8_t greatest = 0;
    for (std::size_t s = 0; s < rig.layout.size(); ++s) {
      const workspace::Index3 v =
          world().grid().index_of(rig.X_WL[rig.layout.link_of(s)] * rig.layout.position(s));
      greatest = std::max(greatest, literal(zone, world(), v, {}).greatest);
    }
    const WorstSensor& worst = rig.sensing.worst();
    ASSERT_EQ(worst.found, greatest > 0);
    if (!worst.found) continue;
    ++found;
    EXPECT_EQ(worst.mu, world().palette()[greatest]);
    EXPECT_EQ(world().mu_code(worst.voxel), greatest);
    EXPECT_LE((world().grid().centre_of(worst.voxel) - worst.position_W_m).norm(), 0.04);
  }
  EXPECT_GT(found, 5);
}

TEST(ClusterSkin, AllocatesNothing) {
  Rig rig(slender({3, ClusterShape::kFraction}));
  rig.arm.link_poses({0.1, 0.4, 0.9}, rig.X_WL);
  const workspace::Workspace& workspace = world();  // made at its first use
  const test::HeapGuard guard;
  rig.sensing.sense(rig.X_WL, 7, workspace);
}

}  // namespace
}  // namespace phantom::robot
