#include "common/simulation/mesh_world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/winding_number.hpp"
#include "common/geometry/point_triangle.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::simulation {
namespace {

using geometry::TriangleMesh;

TriangleMesh box(const Eigen::Vector3d& size_m, const Eigen::Vector3d& centre_m) {
  return geometry::make_box(size_m).transformed({Eigen::Matrix3d::Identity(), centre_m});
}

/// A channel along x, 40 mm wide and 60 mm deep, of three overlapping plates of 4 mm.
std::vector<TriangleMesh> plates() {
  return {box({0.3, 0.048, 0.004}, {0, 0, -0.002}), box({0.3, 0.004, 0.064}, {0, 0.022, 0.028}),
          box({0.3, 0.004, 0.064}, {0, -0.022, 0.028})};
}
TriangleMesh channel() {
  TriangleMesh mesh;
  for (const TriangleMesh& plate : plates()) mesh.append(plate);
  return mesh;
}

// Oracle: a sphere, whose distance everybody knows; its mesh is 0.2 mm within it.
TEST(MeshWorld, DistanceAndNormalOfASphere) {
  const double radius_m = 0.2, range_m = 0.13;
  const MeshWorld world({{geometry::make_sphere(radius_m, 5), 5}}, range_m);
  for (double along = 0.09; along < 0.32; along += 0.003) {
    const Eigen::Vector3d direction = Eigen::Vector3d(1.0, 0.5, -0.7 + along).normalized();
    const auto found = world.query(along * direction);
    EXPECT_NEAR(found.distance_m, along - radius_m, 2e-4) << along;
    EXPECT_EQ(found.distance_m, world.distance_m(along * direction));
    EXPECT_GT(found.normal_W.dot(direction), 0.998) << along;
    EXPECT_NEAR(found.normal_W.norm(), 1.0, 1e-9);
    EXPECT_EQ(found.object, 5);
  }
  EXPECT_EQ(world.distance_m({0.45, 0.45, 0.45}), range_m);
  EXPECT_EQ(world.query({0.45, 0.45, 0.45}).object, 0);
  EXPECT_EQ(world.distance_m({0, 0, 0}), -range_m) << "deeper than the range";
}

// Literal twin: of every body every triangle, and the exact winding number.
TEST(MeshWorld, IsTheLeastOfAllBodiesDistancesByTheirTriangles) {
  const std::vector<geometry::PlacedMesh> bodies{
      {plates()[0], 1},
      {plates()[1], 1},
      {plates()[2], 1},
      {box({0.1, 0.1, 0.1}, {0.05, 0.0, 0.06}), 2},
      {geometry::make_sphere(0.05, 3).transformed({Eigen::Matrix3d::Identity(), {0.0, 0.1, 0.0}}), 3}};
  const double range_m = 0.1;
  // The channel's plates in one mesh: what lies within another plate is no surface.
  const MeshWorld world({{channel(), 1}, bodies[3], bodies[4]}, range_m);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-0.2, 0.2);
  int inside = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const Eigen::Vector3d p(place(random), place(random), place(random));
    double expected_m = range_m;
    for (const auto& body : bodies) {
      double least_m = range_m;
      const auto& v = body.mesh_W.vertices_m;
      for (const auto& t : body.mesh_W.triangles)
        least_m = std::min(
            least_m, (geometry::closest_point_on_triangle(p, v[t[0]].cast<double>(), v[t[1]].cast<double>(),
                                                          v[t[2]].cast<double>()) -
                      p)
                         .norm());
      if (geometry::winding_number(body.mesh_W, p) > 0.5) least_m = -least_m;
      expected_m = std::min(expected_m, least_m);
    }
    const ContactQuery found = world.query(p);
    ASSERT_NEAR(found.distance_m, expected_m, 1e-9) << p.transpose();
    inside += found.distance_m < 0.0;
    if (found.object == 0) continue;
    // The distance grows along the normal.
    EXPECT_NEAR(world.distance_m(p + 1e-6 * found.normal_W) - found.distance_m, 1e-6, 1e-7);
  }
  EXPECT_GT(inside, 50);
}

// What a convex hull would fill: between the walls of a channel there is room, and its thin walls push both
// ways.
TEST(MeshWorld, AConcaveBodyIsOpenInside) {
  const MeshWorld world({{channel(), 1}}, 0.13);
  EXPECT_NEAR(world.distance_m({0, 0, 0.03}), 0.02, 1e-6);
  EXPECT_NEAR(world.distance_m({0, 0.015, 0.03}), 0.005, 1e-6);
  const auto inner = world.query({0, 0.0205, 0.03}), outer = world.query({0, 0.0235, 0.03});
  EXPECT_NEAR(inner.distance_m, -0.0005, 1e-6);
  EXPECT_NEAR(inner.normal_W.y(), -1.0, 1e-6);
  EXPECT_NEAR(outer.distance_m, -0.0005, 1e-6);
  EXPECT_NEAR(outer.normal_W.y(), 1.0, 1e-6);
}

TEST(MeshWorld, ACavityIsNoPartOfTheBody) {
  TriangleMesh vessel = box({0.2, 0.2, 0.2}, {0, 0, 0}), cavity = box({0.1, 0.1, 0.1}, {0, 0, 0});
  for (auto& t : cavity.triangles) std::swap(t[1], t[2]);
  vessel.append(cavity);
  const MeshWorld world({{vessel, 1}}, 0.13);
  EXPECT_NEAR(world.distance_m({0, 0, 0.01}), 0.04, 1e-6);
  EXPECT_NEAR(world.distance_m({0, 0, 0.06}), -0.01, 1e-6);
  EXPECT_NEAR(world.query({0, 0, 0.06}).normal_W.z(), -1.0, 1e-6) << "out of the wall, into the cavity";
  EXPECT_NEAR(world.distance_m({0, 0, 0.11}), 0.01, 1e-6);
}

// Meshes as they come: inside out, with a hole, with every triangle twice.
TEST(MeshWorld, BadMeshesHaveAnInsideToo) {
  TriangleMesh inverted = box({0.1, 0.1, 0.1}, {0, 0, 0}), open = inverted, doubled = inverted;
  for (auto& t : inverted.triangles) std::swap(t[1], t[2]);
  open.triangles.pop_back();
  doubled.append(TriangleMesh(doubled));
  for (const TriangleMesh& mesh : {inverted, open, doubled}) {
    const MeshWorld world({{mesh, 1}}, 0.13);
    for (const Eigen::Vector3d& axis :
         {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0, 0, -1)}) {
      EXPECT_NEAR(world.distance_m(0.045 * axis), -0.005, 1e-6);
      EXPECT_NEAR(world.distance_m(0.055 * axis), 0.005, 1e-6);
    }
  }
}

TEST(MeshWorld, AllocatesNothing) {
  const MeshWorld world({{channel(), 1}, {geometry::make_sphere(0.05, 4), 2}}, 0.13);
  double sum = 0.0;
  {
    const test::HeapGuard guard;
    for (int i = 0; i < 100; ++i) sum += world.query({0.001 * i, 0.01, 0.02}).distance_m;
  }
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace phantom::simulation
