#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <map>
#include <random>
#include <utility>

#include "common/geometry/mesh/mesh_topology.hpp"

namespace phantom::geometry {
namespace {

/// As is_oriented_surface(), by counting each edge's uses.
bool literal(const std::vector<Triangle>& triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      uses[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, sum] : uses) {
    if (sum != 0) return false;
  }
  return true;
}

/// Surfaces of tetrahedra, in any order: every edge cancels out.
std::vector<Triangle> tetrahedra(std::size_t count, std::uint32_t vertices, std::mt19937& random) {
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < count; ++i) {
    const auto a = static_cast<std::uint32_t>(random() % vertices), b = (a + 1) % vertices,
               c = (a + 2 + static_cast<std::uint32_t>(random() % (vertices - 3))) % vertices;
    std::uint32_t d = 0;
    while (d == a || d == b || d == c) ++d;
    for (const Triangle& t : {Triangle{a, b, c}, Triangle{a, c, d}, Triangle{a, d, b}, Triangle{b, d, c}})
      triangles.push_back(t);
  }
  std::shuffle(triangles.begin(), triangles.end(), random);
  return triangles;
}

TEST(OrientedSurface, AsCountedWithEveryInstructionSet) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    std::mt19937 random(3);
    for (std::size_t count = 0; count < 40; ++count) {
      const std::vector<Triangle> whole = tetrahedra(count, count % 2 == 0 ? 20 : 4'000'000'000U, random);
      ASSERT_TRUE(literal(whole));
      EXPECT_TRUE(is_oriented_surface(whole));
      if (whole.empty()) continue;
      const std::size_t changed = random() % whole.size();
      auto open = whole, turned = whole, twice = whole, elsewhere = whole;
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(changed));
      std::swap(turned[changed][0], turned[changed][1]);
      twice.push_back(twice[changed]);
      elsewhere[changed][2] ^= 0x80000000U;
      for (const auto& other : {open, turned, twice, elsewhere})
        EXPECT_EQ(is_oriented_surface(other), literal(other))
            << "triangle " << changed << " of " << whole.size();
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}

}  // namespace
}  // namespace phantom::geometry
