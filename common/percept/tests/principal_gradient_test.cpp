#include "common/percept/principal_gradient.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/percept/closeness.hpp"

namespace phantom::percept {
namespace {

/// 64³ voxels, of 10 mm if not said otherwise; `code_at` by voxel.
workspace::Workspace world(const std::function<int(workspace::Index3)>& code_at,
                           const workspace::VoxelSize& size = 0.01) {
  workspace::Workspace workspace({Eigen::Vector3d(0.1, -0.2, 0.3), size, {64, 64, 64}},
                                 {0.0F, 9.0F, 13.0F, 32.0F, 100.0F});
  for (std::int32_t z = 0; z < 64; ++z) {
    for (std::int32_t y = 0; y < 64; ++y) {
      for (std::int32_t x = 0; x < 64; ++x) {
        const int code = code_at({x, y, z});
        if (code == 0) continue;
        const auto brick = workspace.edit_brick({x >> 5, y >> 5, z >> 5});
        const std::size_t at =
            workspace::brick_offset(static_cast<std::uint32_t>(x) & 31U, static_cast<std::uint32_t>(y) & 31U,
                                    static_cast<std::uint32_t>(z) & 31U);
        brick.mu_code[at] = static_cast<std::uint8_t>(code);
        brick.order[at] = code == 4 ? workspace::kOrderBoundary : static_cast<std::int8_t>(4 - code);
      }
    }
  }
  return workspace;
}

/// The definition, in doubles and without thought for speed.
PrincipalGradient literal(const workspace::Workspace& workspace, workspace::Index3 centre, int m,
                          ZoneShape shape) {
  double greatest = -1.0, least = 1e9;
  const auto for_zone = [&](const auto& visit) {
    for (int x = -m; x <= m; ++x) {
      for (int y = -m; y <= m; ++y) {
        for (int z = -m; z <= m; ++z) {
          if (shape == ZoneShape::kSphere && x * x + y * y + z * z > m * m) continue;
          visit(workspace::Index3{centre.x + x, centre.y + y, centre.z + z});
        }
      }
    }
  };
  for_zone([&](workspace::Index3 v) {
    greatest = std::max(greatest, static_cast<double>(workspace.mu(v)));
    least = std::min(least, static_cast<double>(workspace.mu(v)));
  });
  Eigen::Vector3d high = Eigen::Vector3d::Zero(), low = Eigen::Vector3d::Zero();
  int highs = 0, lows = 0;
  for_zone([&](workspace::Index3 v) {
    const auto mu = static_cast<double>(workspace.mu(v));
    if (mu == greatest) high += workspace.grid().centre_of(v), ++highs;
    if (mu == least) low += workspace.grid().centre_of(v), ++lows;
  });
  return {high / highs - low / lows, greatest - least, greatest, least};
}

int ball(workspace::Index3 v) {
  const double distance =
      std::sqrt(std::pow(v.x - 30, 2) + std::pow(v.y - 28, 2) + std::pow(v.z - 35, 2)) - 8.0;
  return distance <= 0 ? 4 : distance <= 4 ? 3 : distance <= 8 ? 2 : distance <= 12 ? 1 : 0;
}

void expect_literal(const workspace::Workspace& workspace) {
  for (const ZoneShape shape : {ZoneShape::kCube, ZoneShape::kSphere}) {
    for (const int m : {1, 2, 3, 4, 5, 9, 15}) {
      const ClusterZone zone(m, shape);
      for (int i = 0; i < 200; ++i) {
        const workspace::Index3 centre{(i * 7) % 66 - 1, (i * 13) % 66 - 1,
                                       (i * 29) % 66 - 1};  // over the grid's edge, too
        const PrincipalGradient actual = zone.gradient(workspace, centre),
                                expected = literal(workspace, centre, m, shape);
        EXPECT_EQ(actual.strength, expected.strength);
        EXPECT_EQ(actual.greatest, expected.greatest);
        EXPECT_EQ(actual.least, expected.least);
        if (expected.strength > 0.0) {
          EXPECT_LT((actual.pgv_W_m - expected.pgv_W_m).norm(), 1e-12);
        } else {
          EXPECT_EQ(actual.pgv_W_m.norm(), 0.0);
          EXPECT_FALSE(actual.has_direction());
        }
      }
    }
  }
}

TEST(PrincipalGradient, IsTheLiteralDefinition) { expect_literal(world(ball)); }

TEST(PrincipalGradient, IsTheLiteralDefinitionInMetresWhereVoxelsAreNoCubes) {
  expect_literal(world(ball, workspace::VoxelSize(Eigen::Vector3d(0.01, 0.013, 0.02))));
}

TEST(PrincipalGradient, PointsTowardsTheObject) {
  const workspace::Workspace workspace = world(ball);
  const ClusterZone zone(3, ZoneShape::kSphere);
  const Eigen::Vector3d middle = workspace.grid().centre_of({30, 28, 35});
  for (const workspace::Index3 at :
       {workspace::Index3{20, 20, 35}, {40, 28, 35}, {30, 40, 40}, {25, 28, 46}}) {
    const PrincipalGradient gradient = zone.gradient(workspace, at);
    ASSERT_TRUE(gradient.has_direction());
    const double cosine =
        gradient.pgv_W_m.normalized().dot((middle - workspace.grid().centre_of(at)).normalized());
    EXPECT_GT(cosine, 0.95);
  }
}

TEST(PrincipalGradient, HasNoDirectionWhereAllIsEqual) {
  const workspace::Workspace workspace = world([](workspace::Index3) { return 3; });
  const PrincipalGradient inside = ClusterZone(3, ZoneShape::kCube).gradient(workspace, {30, 30, 30});
  EXPECT_FALSE(inside.has_direction());
  EXPECT_EQ(inside.strength, 0.0);
  EXPECT_EQ(inside.pgv_W_m, Eigen::Vector3d::Zero());
}

TEST(PrincipalGradient, HasNoDirectionAmidASymmetricSlot) {
  const workspace::Workspace slot =
      world([](workspace::Index3 v) { return std::abs(v.x - 30) >= 3 ? 3 : 1; });
  const PrincipalGradient gradient = ClusterZone(4, ZoneShape::kCube).gradient(slot, {30, 30, 30});
  EXPECT_GT(gradient.strength, 0.0);
  EXPECT_FALSE(gradient.has_direction());
}

TEST(PrincipalGradient, ZoneSizesAreThoseOfCubeAndSphere) {
  EXPECT_EQ(ClusterZone(3, ZoneShape::kCube).voxel_count(), 343U);
  EXPECT_EQ(ClusterZone(1, ZoneShape::kSphere).voxel_count(), 7U);
  EXPECT_EQ(ClusterZone(2, ZoneShape::kSphere).voxel_count(), 33U);
}

TEST(Closeness, IsMeasuredAgainstTheFluidNotTheSkin) {
  const workspace::Workspace workspace = world(ball);
  const double greatest = greatest_neighbour_mu(workspace);
  EXPECT_EQ(greatest, 32.0);
  EXPECT_EQ(closeness(0.0, greatest), 0.0);
  EXPECT_DOUBLE_EQ(closeness(13.0, greatest), 13.0 / 32.0);
  EXPECT_EQ(closeness(32.0, greatest), 1.0);
  EXPECT_EQ(closeness(100.0, greatest), 1.0);
  EXPECT_EQ(closeness(5.0, 0.0), 1.0);  // bare bodies without fluid
}

}  // namespace
}  // namespace phantom::percept
