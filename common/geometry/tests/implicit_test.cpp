#include "common/geometry/implicit/implicit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/point_triangle.hpp"

namespace phantom::geometry {
namespace {

using Eigen::Vector3d;

class Dice {
 public:
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
  Vector3d point(double reach) {
    return {uniform(-reach, reach), uniform(-reach, reach), uniform(-reach, reach)};
  }
  Pose pose(double reach) {
    return {rotation_from_rpy(uniform(-3, 3), uniform(-3, 3), uniform(-3, 3)), point(reach)};
  }

 private:
  std::mt19937 random_{5};
};

std::vector<ImplicitPtr> plain_shapes() {
  return {implicit_sphere(0.3),
          implicit_cylinder(0.2, 0.5),
          implicit_cone(0.3, 0.0, 0.4),
          implicit_cone(0.1, 0.25, 0.3),
          implicit_box({0.3, 0.5, 0.2}),
          implicit_prism({Eigen::Vector2d(-0.2, -0.1), {0.3, -0.1}, {0.0, 0.3}}, 0.4),
          implicit_torus(0.25, 0.08)};
}

ImplicitPtr formula_solid(const std::string& text, const Box& within) {
  auto f = Formula::parse(text, {"x", "y", "z"});
  EXPECT_TRUE(f) << f.status().message();
  return implicit_formula(*std::move(f), within);
}

/// Everything that there is, nested and moved.
std::vector<ImplicitPtr> many_solids() {
  Dice dice;
  std::vector<ImplicitPtr> solids = plain_shapes();
  const std::vector<ImplicitPtr> plain = plain_shapes();
  const Box cube{Vector3d::Constant(-0.4), Vector3d::Constant(0.4)};
  solids.push_back(formula_solid("x^2 + y^2 + z^2 - 0.09", cube));
  solids.push_back(formula_solid("sin(12*x)*cos(12*y) + sin(12*y)*cos(12*z) + sin(12*z)*cos(12*x)", cube));
  solids.push_back(formula_solid("sqrt(x) + y - 0.3", cube));
  solids.push_back(formula_solid("1/x + z", cube));
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const auto one = implicit_placed(plain[i], dice.pose(0.2), dice.uniform(0.5, 1.5));
    const auto other = implicit_placed(plain[(i + 3) % plain.size()], dice.pose(0.2));
    solids.push_back(one);
    solids.push_back(implicit_union({one, other, plain[0]}));
    solids.push_back(implicit_intersection({one, other}));
    solids.push_back(implicit_placed(implicit_difference({one, other, plain[1]}), dice.pose(0.1), 0.8));
  }
  return solids;
}

TEST(ImplicitSolid, BoundsHoldEveryValueOfTheRegion) {
  Dice dice;
  for (const ImplicitPtr& solid : many_solids()) {
    for (int i = 0; i < 200; ++i) {
      const Region region = Region::box(dice.point(0.6), dice.point(0.1).cwiseAbs());
      const Interval bounds = solid->bounds(region);
      for (int k = 0; k < 30; ++k) {
        const Vector3d p = region.centre_m + region.half_m.cwiseProduct(dice.point(1.0));
        const double value = solid->value(p);
        ASSERT_FALSE(std::isnan(value));
        ASSERT_TRUE(bounds.contains(value)) << value << " not in " << bounds.lo << " to " << bounds.hi;
      }
    }
  }
}

TEST(ImplicitSolid, WhatIsLeftWithinARegionHasTheSameValues) {
  Dice dice;
  int thinned = 0;
  for (const ImplicitPtr& solid : many_solids()) {
    for (int i = 0; i < 300; ++i) {
      const Region region = Region::box(dice.point(0.5), dice.point(0.05).cwiseAbs());
      const ImplicitPtr fewer = solid->within(region);
      if (!fewer) continue;
      ++thinned;
      for (int k = 0; k < 20; ++k) {
        const Vector3d p = region.centre_m + region.half_m.cwiseProduct(dice.point(1.0));
        ASSERT_EQ(fewer->value(p), solid->value(p));
      }
    }
  }
  EXPECT_GT(thinned, 2000);
}

TEST(ImplicitSolid, EverythingInsideLiesInTheBox) {
  Dice dice;
  for (const ImplicitPtr& solid : many_solids()) {
    const Box box = solid->bounding_box();
    for (int i = 0; i < 3000; ++i) {
      const Vector3d p = dice.point(1.0);
      if (solid->value(p) >= 0.0) continue;
      EXPECT_TRUE((p.array() >= box.min_m.array()).all() && (p.array() <= box.max_m.array()).all());
    }
  }
}

// So that a single primitive keeps its exact mesh, and need not be polygonised.
TEST(ImplicitSolid, ACombinationOfOnePartIsThatPart) {
  for (const ImplicitPtr& part : plain_shapes())
    for (const auto& combined :
         {implicit_union({part}), implicit_intersection({part}), implicit_difference({part})})
      EXPECT_EQ(combined, part);
}

TEST(ImplicitSolid, CombinationsAreBooleanLogic) {
  Dice dice;
  const std::vector<ImplicitPtr> plain = plain_shapes();
  const auto inside = [](const ImplicitPtr& solid, const Vector3d& p) { return solid->value(p) < 0.0; };
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const ImplicitPtr a = implicit_placed(plain[i], dice.pose(0.2));
    const ImplicitPtr b = implicit_placed(plain[(i + 2) % plain.size()], dice.pose(0.2));
    const ImplicitPtr c = implicit_placed(plain[(i + 4) % plain.size()], dice.pose(0.2));
    const auto both = implicit_intersection({a, b}), any = implicit_union({a, b, c}),
               rest = implicit_difference({a, b, c});
    const auto nested = implicit_difference({any, implicit_union({both, c})});
    for (int k = 0; k < 2000; ++k) {
      const Vector3d p = dice.point(0.6);
      const bool in_a = inside(a, p), in_b = inside(b, p), in_c = inside(c, p);
      EXPECT_EQ(inside(both, p), in_a && in_b);
      EXPECT_EQ(inside(any, p), in_a || in_b || in_c);
      EXPECT_EQ(inside(rest, p), in_a && !in_b && !in_c);
      EXPECT_EQ(inside(nested, p), (in_a || in_b || in_c) && !((in_a && in_b) || in_c));
    }
  }
}

/// Distance to a mesh of the shape: an oracle that shares no formula with it.
double distance_to(const TriangleMesh& mesh, const Vector3d& p) {
  double least = 1e9;
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices_m[t[0]].cast<double>(), b = mesh.vertices_m[t[1]].cast<double>(),
                   c = mesh.vertices_m[t[2]].cast<double>();
    least = std::min(least, (closest_point_on_triangle(p, a, b, c) - p).norm());
  }
  return least;
}

TEST(ImplicitSolid, ValuesAreTheDistanceToTheSurface) {
  struct Case {
    ImplicitPtr solid;
    TriangleMesh mesh;
    bool exact_outside;
  };
  const std::array<Eigen::Vector2d, 3> corners{Eigen::Vector2d(-0.2, -0.1), {0.3, -0.1}, {0.0, 0.3}};
  const Case cases[] = {{implicit_sphere(0.3), make_sphere(0.3, 5), true},
                        {implicit_cylinder(0.2, 0.5), make_cylinder(0.2, 0.5, 400), true},
                        {implicit_box({0.3, 0.5, 0.2}), make_box({0.3, 0.5, 0.2}), true},
                        {implicit_torus(0.25, 0.08), make_torus(0.25, 0.08, 300, 120), true},
                        {implicit_cone(0.3, 0.0, 0.4), make_cone(0.3, 0.0, 0.4, 400), false},
                        {implicit_cone(0.1, 0.25, 0.3), make_cone(0.1, 0.25, 0.3, 400), false},
                        {implicit_prism(corners, 0.4), make_prism(corners, 0.4), false}};
  Dice dice;
  for (const Case& one : cases) {
    for (int i = 0; i < 150; ++i) {
      const Vector3d p = dice.point(0.5);
      const double value = one.solid->value(p), distance = distance_to(one.mesh, p);
      constexpr double kChords = 3e-4;
      if (value < 0.0 || one.exact_outside) {
        EXPECT_NEAR(std::abs(value), distance, kChords);
      } else {
        EXPECT_LE(value, distance + kChords);
      }
    }
  }
}

TEST(ImplicitSolid, VolumesAreThoseOfTheTextbook) {
  constexpr double kPi = std::numbers::pi;
  struct Case {
    ImplicitPtr solid;
    double volume_m3;
  };
  const Case cases[] = {{implicit_sphere(0.3), 4.0 / 3 * kPi * 0.027},
                        {implicit_cylinder(0.2, 0.5), kPi * 0.04 * 0.5},
                        {implicit_cone(0.3, 0.0, 0.4), kPi * 0.09 * 0.4 / 3},
                        {implicit_cone(0.1, 0.25, 0.3), kPi * 0.3 / 3 * (0.01 + 0.025 + 0.0625)},
                        {implicit_box({0.3, 0.5, 0.2}), 0.03},
                        {implicit_prism({Eigen::Vector2d(0, 0), {0, 0.3}, {0.4, 0}}, 0.5), 0.03},
                        {implicit_torus(0.25, 0.08), 2 * kPi * kPi * 0.25 * 0.0064},
                        {implicit_placed(implicit_sphere(0.3), {}, 0.5), 0.5 / 3 * kPi * 0.027}};
  for (const Case& one : cases) {
    const Box box = one.solid->bounding_box();
    Dice dice;  // one sample anywhere in each part of the box
    constexpr int kSamples = 100;
    const Vector3d step = box.size_m() / kSamples;
    int inside = 0;
    for (int x = 0; x < kSamples; ++x) {
      for (int y = 0; y < kSamples; ++y) {
        for (int z = 0; z < kSamples; ++z)
          inside += one.solid->value(box.min_m + step.cwiseProduct(Vector3d(x + 0.5, y + 0.5, z + 0.5) +
                                                                   dice.point(0.5))) < 0.0;
      }
    }
    EXPECT_NEAR(inside * step.prod(), one.volume_m3, 0.004 * one.volume_m3);
  }
}

TEST(ImplicitSolid, WhatIsUndefinedIsOutside) {
  const auto root = formula_solid("sqrt(x) - 2", {Vector3d::Constant(-1), Vector3d::Constant(1)});
  EXPECT_GT(root->value({-0.5, 0, 0}), 0.0);
  EXPECT_LT(root->value({0.5, 0, 0}), 0.0);
  EXPECT_GT(root->bounds(Region::box({-0.5, 0, 0}, Vector3d::Constant(0.1))).lo, 0.0);
  const Interval across = root->bounds(Region::box({0, 0, 0}, Vector3d::Constant(0.1)));
  EXPECT_TRUE(across.lo < 0.0 && across.hi > 0.0);
}

TEST(ImplicitSolid, AFormulaEndsAtItsBox) {
  const auto everywhere = formula_solid("-1", {Vector3d(0, 0, 0), Vector3d(1, 2, 3)});
  EXPECT_LT(everywhere->value({0.5, 1, 1.5}), 0.0);
  EXPECT_GT(everywhere->value({1.1, 1, 1.5}), 0.0);
  EXPECT_GT(everywhere->value({0.5, 1, -0.1}), 0.0);
}

}  // namespace
}  // namespace phantom::geometry
