#include "tests/experiments/percept/intersection_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::experiments {
namespace {

using geometry::make_box;
using geometry::make_sphere;
using geometry::make_torus;
using geometry::Pose;
using geometry::rotation_about;
using geometry::TriangleMesh;

Eigen::Vector3d random_unit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Vector3d v(normal(random), normal(random), normal(random));
  return v.normalized();
}

std::vector<TriangleMesh> random_scene(std::mt19937& random, int objects) {
  std::uniform_real_distribution<double> place(-0.6, 0.6), size(0.05, 0.25);
  std::vector<TriangleMesh> scene;
  for (int i = 0; i < objects; ++i) {
    const TriangleMesh shape = i % 3 == 0   ? make_box({size(random), size(random), size(random)})
                               : i % 3 == 1 ? make_sphere(size(random), 2)
                                            : make_torus(0.2, size(random) / 3.0, 16, 8);
    const Pose X_WB{rotation_about(random_unit(random), place(random) * 5.0),
                    {place(random), place(random), place(random)}};
    scene.push_back(shape.transformed(X_WB));
  }
  return scene;
}

/// Every triangle against the probe, by another formula (Möller and Trumbore's, either face).
std::optional<ProbeHit> brute_force(const std::vector<TriangleMesh>& scene, const Eigen::Vector3d& p,
                                    const Eigen::Vector3d& d, double length_m) {
  std::optional<ProbeHit> nearest;
  for (std::size_t o = 0; o < scene.size(); ++o) {
    for (std::size_t i = 0; i < scene[o].triangles.size(); ++i) {
      const auto corner = [&](std::size_t k) -> Eigen::Vector3d {
        return scene[o].vertices_m[scene[o].triangles[i][k]].cast<double>();
      };
      const Eigen::Vector3d e1 = corner(1) - corner(0), e2 = corner(2) - corner(0), h = d.cross(e2),
                            s = p - corner(0), q = s.cross(e1);
      const double determinant = e1.dot(h);
      if (std::abs(determinant) < 1e-15) continue;
      const double u = s.dot(h) / determinant, v = d.dot(q) / determinant, t = e2.dot(q) / determinant;
      if (u < 0.0 || v < 0.0 || u + v > 1.0 || t < 0.0 || t > length_m) continue;
      if (!nearest || t < nearest->distance_m) nearest = ProbeHit{t, o, i};
    }
  }
  return nearest;
}

/// Whether the point is outside every object, by the number of surfaces on a ray from it.
bool outside(const std::vector<TriangleMesh>& scene, const Eigen::Vector3d& p) {
  for (const TriangleMesh& mesh : scene) {
    int crossings = 0;
    double from = 0.0;
    const Eigen::Vector3d d = Eigen::Vector3d(0.31, 0.57, 0.76).normalized();
    while (const auto hit = brute_force({mesh}, p + from * d, d, 10.0)) {
      from += hit->distance_m + 1e-9;
      ++crossings;
    }
    if (crossings % 2 == 1) return false;
  }
  return true;
}

TEST(IntersectionFilter, EveryChainFindsWhatBruteForceFinds) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-0.9, 0.9), reach(0.05, 1.0);
  int hits = 0, probes = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const auto scene = random_scene(random, 1 + trial % 8);
    const IntersectionScene filtered(scene), boxed(scene, {.bounds_by_box = true}),
        triangle_first(scene, {.triangle_first = true});
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3d p(place(random), place(random), place(random)), d = random_unit(random);
      if (!outside(scene, p)) continue;
      const double length_m = reach(random);
      const auto expected = brute_force(scene, p, d, length_m);
      FilterQueries plain, fast;
      const auto a = filtered.probe(p, d, length_m, FilterForm::kUnoptimised, plain);
      const auto b = filtered.probe(p, d, length_m, FilterForm::kOptimised, fast);
      ASSERT_EQ(expected.has_value(), a.has_value()) << trial << " " << i;
      ASSERT_EQ(expected.has_value(), b.has_value()) << trial << " " << i;
      EXPECT_EQ(plain.vit, fast.vit);
      EXPECT_EQ(plain.sess, fast.sess);
      FilterQueries unused;
      for (const IntersectionScene* other : {&boxed, &triangle_first}) {
        const auto c = other->probe(p, d, length_m, FilterForm::kOptimised, unused);
        ASSERT_EQ(expected.has_value(), c.has_value()) << trial << " " << i;
        if (c.has_value()) {
          EXPECT_EQ(c->distance_m, b->distance_m);
        }
      }
      ++probes;
      if (!expected) continue;
      ++hits;
      EXPECT_NEAR(a->distance_m, expected->distance_m, 1e-9);
      EXPECT_EQ(a->distance_m, b->distance_m);
      EXPECT_EQ(a->object, expected->object);
    }
  }
  EXPECT_GT(hits, 200);
  EXPECT_GT(probes - hits, 200);
}

TEST(IntersectionFilter, EachFilterSeesOnlyWhatTheOneBeforeLetThrough) {
  std::mt19937 random(8);
  const auto scene = random_scene(random, 6);
  const IntersectionScene filtered(scene);
  FilterQueries all;
  for (int i = 0; i < 200; ++i) {
    FilterQueries q;
    filtered.probe(0.8 * random_unit(random), random_unit(random), 0.3, FilterForm::kOptimised, q);
    EXPECT_EQ(q.seso, 6U);
    EXPECT_LE(q.sdt, q.sess);
    EXPECT_LE(q.idp, q.sdt);
    EXPECT_LE(q.rt, q.idp);
    EXPECT_LE(q.vit, q.rt);
    all += q;
  }
  EXPECT_GT(all.vit, 0U);
  EXPECT_LT(all.vit, all.rt);
  EXPECT_LT(all.sdt, all.sess);
}

TEST(IntersectionFilter, LoadsAddUpAsInTheThesissTables) {
  // Rows a, b and e of tables 3.3 and 3.4.
  const FilterQueries a{2, 220, 16, 8, 4, 2}, b{2, 220, 14, 4, 2, 0}, e{2, 440, 17, 6, 6, 0};
  EXPECT_EQ(filter_load(a, FilterForm::kUnoptimised), 9758U);
  EXPECT_EQ(filter_load(b, FilterForm::kUnoptimised), 9174U);
  EXPECT_EQ(filter_load(e, FilterForm::kUnoptimised), 17290U);
  EXPECT_EQ(filter_load(a, FilterForm::kOptimised), 3532U);
  EXPECT_EQ(filter_load(b, FilterForm::kOptimised), 3088U);
  EXPECT_EQ(filter_load(e, FilterForm::kOptimised), 5934U);
}

TEST(IntersectionFilter, AnObjectOutOfReachCostsOneQuery) {
  const IntersectionScene scene({make_box({0.1, 0.1, 0.1})});
  FilterQueries q;
  EXPECT_FALSE(scene.probe({1, 0, 0}, {-1, 0, 0}, 0.5, FilterForm::kOptimised, q));
  EXPECT_EQ(q.seso, 1U);
  EXPECT_EQ(q.sess, 0U);
  const auto hit = scene.probe({1, 0, 0}, {-1, 0, 0}, 0.95, FilterForm::kOptimised, q);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance_m, 0.95, 1e-7);
}

TEST(IntersectionFilter, ProbesWithoutAllocating) {
  const IntersectionScene scene({make_sphere(0.1, 3)});
  FilterQueries q;
  bool found = false;
  {
    const test::HeapGuard guard;
    found = scene.probe({0.3, 0.01, 0}, {-1, 0, 0}, 0.5, FilterForm::kUnoptimised, q).has_value();
  }
  EXPECT_TRUE(found);
}

TEST(FrontHemisphere, IsSpreadEvenlyOverTheHalfInFront) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 0.5).normalized();
  const auto directions = front_hemisphere(axis, 200);
  ASSERT_EQ(directions.size(), 200U);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& d : directions) {
    EXPECT_NEAR(d.norm(), 1.0, 1e-12);
    EXPECT_GT(d.dot(axis), 0.0);
    sum += d;
  }
  EXPECT_TRUE((sum / 200.0).isApprox(0.5 * axis, 0.02));  // the centroid of a half sphere's surface
}

}  // namespace
}  // namespace phantom::experiments
