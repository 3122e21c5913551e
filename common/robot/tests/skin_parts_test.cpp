// Polygon segments, lines of sensors and meshes: positions by the thesis's equations, areas, pitch, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/robot/drag/drag.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/robot/tests/test_worlds.hpp"

namespace phantom::robot::skin_parts_test {
namespace {

using testing::HasSubstr;

SkinLayout lay_out(const LinkSkin& skin, const SkinOptions& options = {}) {
  auto layout = lay_out_skin(test_arms::planar(), {skin}, options);
  if (!layout) throw std::runtime_error(layout.status().message());
  return *std::move(layout);
}

std::string part_refusal(const LinkSkin& skin, const SkinOptions& options = {}) {
  const auto layout = lay_out_skin(test_arms::planar(), {skin}, options);
  EXPECT_FALSE(layout.has_value());
  return layout.has_value() ? "" : layout.status().message();
}

double total_area(const SkinLayout& layout) {
  return std::accumulate(layout.area_m2.begin(), layout.area_m2.end(), 0.0);
}

// ---- polygon segments

/// An L-like section that tapers, on an axis along x: u is y, v is z.
SkinSegment tapering() {
  SkinSegment segment;
  segment.from_m = {0.1, 0.0, 0.0}, segment.to_m = {0.4, 0.0, 0.0};
  segment.from_polygon = {{0.05, 0.0}, {0.06, 0.8}, {0.04, 2.0}, {0.05, 3.5}, {0.03, 5.0}};
  segment.to_polygon = {{0.02, 0.0}, {0.03, 0.8}, {0.02, 2.0}, {0.03, 3.5}, {0.01, 5.0}};
  segment.spin_rad = 0.4;
  return segment;
}

TEST(PolygonSegment, SensorsAreTheThesissInterpolation) {
  SkinSegment segment = tapering();
  segment.sides = 5, segment.rings = 41;
  const SkinLayout layout = lay_out({"upper", {segment}, {}, {}}, {.voxel_size_m = 0.1});
  ASSERT_EQ(layout.size(), 5U * 41U);
  for (std::size_t k = 0; k <= 40; ++k) {
    for (std::size_t p = 0; p < 5; ++p) {  // eqs. 5.24, 5.25
      const auto corner = [&](const PolygonPoint& point, double x) {
        const double angle = segment.spin_rad + point.psi_rad;
        return Eigen::Vector3d(x, point.r_m * std::cos(angle), point.r_m * std::sin(angle));
      };
      const Eigen::Vector3d ptp = corner(segment.from_polygon[p], 0.1),
                            pbp = corner(segment.to_polygon[p], 0.4);
      const Eigen::Vector3d css = ptp + static_cast<double>(k) / 40.0 * (pbp - ptp);
      EXPECT_LT((layout.position(5 * k + p) - css).norm(), 1e-12) << "k " << k << " p " << p;
    }
  }
}

TEST(PolygonSegment, WithoutABottomIsOfTypeA) {
  SkinSegment segment = tapering();
  segment.to_polygon.clear();
  const SkinLayout layout = lay_out({"upper", {segment}, {}, {}});
  ASSERT_EQ(layout.size() % 62, 0U);  // 300 mm at a pitch below 4.95 mm: 61 spans
  const std::size_t around = layout.size() / 62;
  for (std::size_t i = 0; i < layout.size(); ++i) {
    const Eigen::Vector3d p = layout.position(i), first = layout.position(i % around);
    EXPECT_NEAR(p.x(), 0.1 + 0.3 * static_cast<double>(i / around) / 61, 1e-12);
    EXPECT_NEAR(p.y(), first.y(), 1e-12);
    EXPECT_NEAR(p.z(), first.z(), 1e-12);
  }
}

TEST(PolygonSegment, AutoKeepsThePitchAroundAndAlongAndTheAreaOfItsFacets) {
  SkinSegment square;
  square.from_m = {0, 0, 0}, square.to_m = {0.3, 0, 0};
  for (int i = 0; i < 4; ++i)
    square.from_polygon.push_back({0.05 * std::numbers::sqrt2, std::numbers::pi * (0.25 + 0.5 * i)});
  const SkinLayout layout = lay_out({"upper", {square}, {}, {}});
  EXPECT_NEAR(total_area(layout), 4 * 0.1 * 0.3, 1e-12);
  // 100 mm at a pitch below 4.95 mm are 21 spans a side; 300 mm are 61.
  EXPECT_EQ(layout.size(), 4U * 21U * 62U);
  for (std::size_t i = 0; i < layout.size(); ++i) {
    const Eigen::Vector3d p = layout.position(i);
    EXPECT_NEAR(std::max(std::abs(p.y()), std::abs(p.z())), 0.05, 1e-12);  // on the square
    const std::size_t around = i / 84 * 84 + (i + 1) % 84;
    EXPECT_LT((layout.position(around) - p).norm(), 0.00495);
    if (i + 84 < layout.size()) {
      EXPECT_LT((layout.position(i + 84) - p).norm(), 0.00495);
    }
  }
  // A frustum's facets are trapezoids.
  SkinSegment frustum = square;
  frustum.to_polygon = square.from_polygon;
  for (PolygonPoint& corner : frustum.to_polygon) corner.r_m *= 0.5;
  EXPECT_NEAR(total_area(lay_out({"upper", {frustum}, {}, {}})),
              4 * 0.5 * (0.1 + 0.05) * std::hypot(0.3, 0.025), 1e-12);
}

TEST(PolygonSegment, ManyCornersAreTheRoundSegment) {
  SkinSegment round, polygon;
  round.from_m = polygon.from_m = {0, 0, 0}, round.to_m = polygon.to_m = {0.2, 0.1, -0.1};
  round.from_radius_m = 0.06, round.to_radius_m = 0.03;
  round.sides = polygon.sides = 120;
  round.spin_rad = polygon.spin_rad = 0.2;
  for (int p = 0; p < 120; ++p) {
    polygon.from_polygon.push_back({0.06, 2 * std::numbers::pi * p / 120});
    polygon.to_polygon.push_back({0.03, 2 * std::numbers::pi * p / 120});
  }
  const SkinLayout a = lay_out({"upper", {round}, {}, {}}), b = lay_out({"upper", {polygon}, {}, {}});
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_LT((a.position(i) - b.position(i)).norm(), 1e-12);
  EXPECT_NEAR(total_area(b), total_area(a), 1e-3 * total_area(a));
}

TEST(PolygonSegment, StandsAtItsOffsetOnTheLinksAxis) {
  SkinSegment segment;
  const SerialArm arm = test_arms::planar();
  ASSERT_TRUE(place_along_link_axis(arm, "upper", 0.05, 0.2, segment));  // the next joint is 0.4 m along x
  EXPECT_TRUE(segment.from_m.isApprox(Eigen::Vector3d(0.05, 0, 0)));
  EXPECT_TRUE(segment.to_m.isApprox(Eigen::Vector3d(0.25, 0, 0)));
  ASSERT_TRUE(
      place_along_link_axis(arm, "tip", 0.05, 0.2, segment));  // fixed to "lower", 0.3 m from its joint
  EXPECT_TRUE(segment.from_m.isApprox(Eigen::Vector3d(-0.25, 0, 0)));
  EXPECT_FALSE(place_along_link_axis(arm, "hand", 0.05, 0.2, segment));
}

TEST(PolygonSegmentRefuses, WhatBreaksThePitchRuleOrIsNoPolygon) {
  SkinSegment segment = tapering();
  segment.sides = 5;
  EXPECT_THAT(part_refusal({"upper", {segment}, {}, {}}),
              HasSubstr("link 'upper': segments[0]: from_polygon: corners 0 and 1 are"));
  segment.sides = 6;
  EXPECT_THAT(part_refusal({"upper", {segment}, {}, {}}),
              HasSubstr("sides: 6; allowed: 5, the number of corners, or auto"));
  segment = tapering();
  segment.to_polygon.pop_back();
  EXPECT_THAT(part_refusal({"upper", {segment}, {}, {}}), HasSubstr("to_polygon: 4 corners; allowed: 5"));
  segment.from_polygon.resize(2);
  EXPECT_THAT(part_refusal({"upper", {segment}, {}, {}}),
              HasSubstr("from_polygon: 2 corners; allowed: 3 or more"));
  segment = tapering();
  segment.from_polygon[2].psi_rad = std::nan("");
  EXPECT_THAT(part_refusal({"upper", {segment}, {}, {}}), HasSubstr("from_polygon: corner 2"));
  segment = tapering();
  segment.cluster = ClusterSpec{16, ClusterShape::kCube};
  EXPECT_THAT(part_refusal({"upper", {segment}, {}, {}}),
              HasSubstr("cluster: reach_vox: 16; allowed: 1 to 15"));
}

TEST(NettingSkin, MayStandAsFarApartAsItsZonesReach) {
  SkinSegment points = tapering();
  points.from_polygon.clear(), points.to_polygon.clear();
  points.from_radius_m = points.to_radius_m = 0.05;
  SkinSegment netting = points;
  netting.cluster = ClusterSpec{3, ClusterShape::kSphere};
  const SkinLayout a = lay_out({"upper", {points}, {}, {}}), b = lay_out({"upper", {netting}, {}, {}});
  EXPECT_NEAR(static_cast<double>(a.size()) / static_cast<double>(b.size()), 9.0, 1.5);
  EXPECT_NEAR(total_area(a), total_area(b), 1e-12);
  EXPECT_EQ(b.first_cluster[1], 0U);
  EXPECT_EQ(b.cluster_kind, std::vector<std::uint8_t>(b.size(), 1));
}

// ---- lines of sensors

AxisSensors line(int count) {
  AxisSensors axis;
  axis.from_m = {0.0, 0.0, 0.0}, axis.to_m = {0.4, 0.0, 0.0};
  axis.count = count;
  return axis;
}

TEST(AxisSensors, StandWhereTheThesisPutsThem) {
  for (const int K : {10, 20, 40, 60, 90}) {
    const SkinLayout layout = lay_out({"upper", {}, {line(K)}, {}}, {.normalisation = Normalisation::kCount});
    ASSERT_EQ(layout.size(), static_cast<std::size_t>(K));
    for (int k = 1; k <= K; ++k) {
      EXPECT_LT(
          (layout.position(static_cast<std::size_t>(k - 1)) - Eigen::Vector3d(0.4 * k / K, 0, 0)).norm(),
          1e-12);
      EXPECT_DOUBLE_EQ(layout.weight[static_cast<std::size_t>(k - 1)], 1.0 / K);
    }
  }
}

/// Eqs. 5.8 to 5.10 word by word, on an arm that turns through fluid.
TEST(AxisSensors, BothNormalisationsAreTheThesiss) {
  const SerialArm arm = test_arms::planar(test_arms::at(-0.2, -0.1, 0.9));
  const workspace::Workspace world = test_worlds::balls();
  const double LL = 0.4;
  for (const int K : {10, 20, 40, 60, 90}) {
    for (const Normalisation normalisation : {Normalisation::kCount, Normalisation::kActive}) {
      const SkinLayout layout = *lay_out_skin(arm, {{"upper", {}, {line(K)}, {}}},
                                              {.voxel_size_m = 0.01, .normalisation = normalisation});
      SkinSensing sensing(layout, {});
      double greatest = 0.0;
      for (double q = -3.0; q < 3.0; q += 0.1) {
        LinkPoses X_WL;
        DragCoefficients drag;
        arm.link_poses({q}, X_WL);
        sensing.sense(X_WL, 2, world);
        drag_coefficients(arm, X_WL, sensing.sums(), {}, {}, drag);
        const Eigen::Vector3d lj = X_WL[1].translation_m, next = X_WL[2].translation_m;
        const double speed = 0.7;
        double torque = 0.0;
        int N_c = 0;
        for (int k = 1; k <= K; ++k) {
          const Eigen::Vector3d S_k = lj + static_cast<double>(k) / K * (next - lj);
          const auto mu = static_cast<double>(world.mu(world.grid().index_of(S_k)));
          torque += mu * (static_cast<double>(k) / K * LL) * speed * (static_cast<double>(k) / K * LL);
          N_c += mu > 0.0 ? 1 : 0;
        }
        const int divisor = normalisation == Normalisation::kCount ? K : std::max(N_c, 1);
        EXPECT_NEAR(drag.plus[0] * speed, torque / divisor, 1e-9 * torque + 1e-15);
        greatest = std::max(greatest, torque);
      }
      EXPECT_GT(greatest, 0.0);
    }
  }
}

TEST(AxisSensors, AutoKeepsAPitchBelowOneVoxelOrTheReach) {
  AxisSensors axis = line(1);
  axis.count.reset();
  EXPECT_EQ(lay_out({"upper", {}, {axis}, {}}, {.normalisation = Normalisation::kNone}).size(),
            81U);  // 0.4 / 4.95 mm
  axis.cluster = ClusterSpec{3, ClusterShape::kSphere};
  const SkinLayout spheres = lay_out({"upper", {}, {axis}, {}});
  EXPECT_EQ(spheres.size(), 27U);
  EXPECT_NEAR(total_area(spheres), 2 * std::numbers::pi * 3.5 * 0.005 * 0.4, 1e-12);
}

TEST(FingerSensors, ShrinkTowardsTheTipAndCoverTheFinger) {
  AxisSensors finger = line(1);
  finger.count.reset();
  finger.to_m = {0.12, 0.0, 0.0};
  finger.cluster = ClusterSpec{4, ClusterShape::kSphere};
  finger.tip_reach_vox = 1;
  const SkinLayout layout = lay_out({"upper", {}, {finger}, {}});
  int before = 4;
  double at = 0.0;
  for (std::size_t i = 0; i < layout.size(); ++i) {
    const int m = layout.clusters[layout.cluster_kind[i] - std::size_t{1}].reach_vox;
    EXPECT_LE(m, before);
    EXPECT_LE(layout.position(i).x() - at, before * 0.005 + 1e-12);  // steps of the sphere before
    before = m, at = layout.position(i).x();
  }
  EXPECT_EQ(before, 1);
  EXPECT_NEAR(at, 0.12, 1e-12);
  EXPECT_EQ(layout.clusters.size(), 4U);
}

TEST(AxisSensorsRefuse, WhatCannotBe) {
  EXPECT_THAT(part_refusal({"upper", {}, {line(10)}, {}}),
              HasSubstr("link 'upper': axes[0]: point sensors on an axis stand for no area; give a radius"));
  EXPECT_THAT(part_refusal({"upper", {}, {line(0)}, {}}), HasSubstr("count: 0; allowed: 1 to 1000000"));
  AxisSensors axis = line(10);
  axis.tip_reach_vox = 1;
  EXPECT_THAT(part_refusal({"upper", {}, {axis}, {}}), HasSubstr("tip_reach_vox: stands without a cluster"));
  axis.cluster = ClusterSpec{3, ClusterShape::kSphere};
  axis.tip_reach_vox = 4;
  EXPECT_THAT(part_refusal({"upper", {}, {axis}, {}}), HasSubstr("tip_reach_vox: 4; allowed: 1 to 3"));
}

// ---- meshes

geometry::TriangleMesh ball() { return geometry::make_sphere(0.06, 4); }

double area_of(const geometry::TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d p = mesh.vertices_m[a].cast<double>(), q = mesh.vertices_m[b].cast<double>(),
                          r = mesh.vertices_m[c].cast<double>();
    area += 0.5 * (q - p).cross(r - p).norm();
  }
  return area;
}

double distance_to_nearest(const SkinLayout& layout, const Eigen::Vector3d& p, std::size_t except) {
  double nearest = 1e9;
  for (std::size_t i = 0; i < layout.size(); ++i) {
    if (i != except) nearest = std::min(nearest, (layout.position(i) - p).norm());
  }
  return nearest;
}

TEST(MeshSkin, CoversTheSurfaceEvenlyAndItsAreasSumUpToTheMeshs) {
  for (const auto& mesh : {ball(), geometry::make_box({0.1, 0.06, 0.03})}) {
    const SkinLayout layout = lay_out({"upper", {}, {}, {{mesh, 1.0, std::nullopt}}});
    EXPECT_NEAR(total_area(layout), area_of(mesh), 1e-9 * area_of(mesh));
    const double pitch = 0.00495;
    for (std::size_t i = 0; i < layout.size(); i += 7) {
      const double apart = distance_to_nearest(layout, layout.position(i), i);
      EXPECT_GE(apart, 0.7 * pitch);
      EXPECT_LT(apart, 2 * 0.9 * pitch);
      EXPECT_GT(layout.area_m2[i], 0.0);
    }
    // Any place on the surface has a sensor within 0.9 of the pitch.
    std::mt19937 random(1);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (int trial = 0; trial < 400; ++trial) {
      const auto& [a, b, c] = mesh.triangles[random() % mesh.triangles.size()];
      double s = share(random), t = share(random);
      if (s + t > 1.0) s = 1.0 - s, t = 1.0 - t;
      const Eigen::Vector3d p = mesh.vertices_m[a].cast<double>(), q = mesh.vertices_m[b].cast<double>(),
                            r = mesh.vertices_m[c].cast<double>();
      EXPECT_LT(distance_to_nearest(layout, p + s * (q - p) + t * (r - p), layout.size()), 0.9 * pitch);
    }
  }
}

TEST(MeshSkin, IsTheSameForTheSameMeshHoweverItIsCut) {
  const SkinLayout a = lay_out({"upper", {}, {}, {{ball(), 1.0, std::nullopt}}}),
                   b = lay_out({"upper", {}, {}, {{ball(), 1.0, std::nullopt}}});
  EXPECT_EQ(a.x_m, b.x_m);
  EXPECT_EQ(a.area_m2, b.area_m2);
  // Long slivers are covered like any other triangle.
  geometry::TriangleMesh sliver;
  sliver.vertices_m = {{0, 0, 0}, {0.5F, 0, 0}, {0.5F, 0.0004F, 0}};
  sliver.triangles = {{0, 1, 2}};
  const SkinLayout thin = lay_out({"upper", {}, {}, {{sliver, 1.0, std::nullopt}}});
  EXPECT_NEAR(total_area(thin), 0.0001, 1e-9);
  EXPECT_GT(thin.size(), 60U);
  EXPECT_LT(thin.size(), 200U);
}

/// A tube's drag is that of its mesh: both skins stand for the same surface.
TEST(MeshSkin, FeelsWhatTheStructuredSkinOfTheSameShapeFeels) {
  const SerialArm arm = test_arms::planar(test_arms::at(-0.2, -0.1, 0.9));
  const workspace::Workspace world = test_worlds::balls();
  SkinSegment tube;
  tube.to_m = {0.3, 0.0, 0.0};
  tube.from_radius_m = tube.to_radius_m = 0.04;
  geometry::TriangleMesh mesh;
  const std::uint32_t n = 180;
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto angle = static_cast<float>(2 * std::numbers::pi * i / n);
    for (const float x : {0.0F, 0.3F})
      mesh.vertices_m.emplace_back(x, 0.04F * std::cos(angle), 0.04F * std::sin(angle));
    const std::uint32_t next = (i + 1) % n;
    mesh.triangles.push_back({2 * i, 2 * i + 1, 2 * next});
    mesh.triangles.push_back({2 * next, 2 * i + 1, 2 * next + 1});
  }
  const auto drags = [&](const LinkSkin& skin) {
    const SkinLayout layout = *lay_out_skin(arm, {skin}, {.voxel_size_m = 0.01, .pitch_vox = 0.5});
    SkinSensing sensing(layout, {});
    std::vector<double> drag;
    for (double q = -3.0; q < 3.0; q += 0.2) {
      LinkPoses X_WL;
      DragCoefficients result;
      arm.link_poses({q}, X_WL);
      sensing.sense(X_WL, 2, world);
      drag_coefficients(arm, X_WL, sensing.sums(), {}, {}, result);
      drag.push_back(result.plus[0]);
    }
    return drag;
  };
  const auto structured = drags({"upper", {tube}, {}, {}}),
             sampled = drags({"upper", {}, {}, {{mesh, 1.0, std::nullopt}}});
  const double greatest = *std::max_element(structured.begin(), structured.end());
  ASSERT_GT(greatest, 0.0);
  for (std::size_t i = 0; i < structured.size(); ++i) EXPECT_NEAR(sampled[i], structured[i], 0.02 * greatest);
}

TEST(MeshSkinRefuses, WhatHasNoSurfaceOrTooMuch) {
  EXPECT_THAT(part_refusal({"upper", {}, {}, {{{}, 1.0, std::nullopt}}}),
              HasSubstr("link 'upper': meshes[0]: has no surface"));
  geometry::TriangleMesh broken = ball();
  broken.triangles[3][1] = 1'000'000;
  EXPECT_THAT(part_refusal({"upper", {}, {}, {{broken, 1.0, std::nullopt}}}),
              HasSubstr("vertex that is missing"));
  broken = ball();
  broken.vertices_m[5].x() = std::nanf("");
  EXPECT_THAT(part_refusal({"upper", {}, {}, {{broken, 1.0, std::nullopt}}}), HasSubstr("not finite"));
  EXPECT_THAT(part_refusal({"upper", {}, {}, {{geometry::make_box({50, 50, 50}), 1.0, std::nullopt}}}),
              HasSubstr("is too large"));
  SkinOptions options;
  options.max_sensors = 100;
  EXPECT_THAT(part_refusal({"upper", {}, {}, {{ball(), 1.0, std::nullopt}}}, options),
              HasSubstr("needs more sensors than the 100"));
}

}  // namespace
}  // namespace phantom::robot::skin_parts_test
