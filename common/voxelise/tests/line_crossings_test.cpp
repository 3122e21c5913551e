#include "common/voxelise/line_crossings.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <random>
#include <tuple>

namespace phantom::voxelise::detail {
namespace {

__extension__ using Wide = __int128;
using Found = std::tuple<std::uint32_t, std::int32_t, std::int32_t>;  // line, voxel, step

std::vector<Found> sorted(std::vector<Found> crossings) {
  std::sort(crossings.begin(), crossings.end());
  return crossings;
}

/// Which side of the edge the line (pu − ε, pv + ε²) is on.
int side(const SnappedPoint& from, const SnappedPoint& to, const Axes& axes, std::int64_t pu,
         std::int64_t pv) {
  const std::int64_t du = std::int64_t{to[axes.u]} - from[axes.u],
                     dv = std::int64_t{to[axes.v]} - from[axes.v];
  const Wide value =
      static_cast<Wide>(du) * (pv - from[axes.v]) - static_cast<Wide>(dv) * (pu - from[axes.u]);
  if (value != 0) return value > 0 ? 1 : -1;
  if (dv != 0) return dv > 0 ? 1 : -1;
  return du > 0 ? 1 : -1;  // 0 only of an edge without length, whose triangle has no area
}

/// Every line with every triangle, in whole numbers.
std::vector<Found> literal(const SnappedMesh& mesh, const Axes& axes, const Lines& lines) {
  std::vector<Found> found;
  for (const Corners& corners : mesh.triangles) {
    const SnappedPoint &a = mesh.points[corners[0]], &b = mesh.points[corners[1]],
                       &c = mesh.points[corners[2]];
    const auto along = [&](const SnappedPoint& p, std::size_t axis) {
      return static_cast<Wide>(p[axis]) - a[axis];
    };
    const Wide area = along(b, axes.u) * along(c, axes.v) - along(c, axes.u) * along(b, axes.v);
    if (area == 0) continue;
    for (std::int32_t v = lines.v.first; v < lines.v.last; ++v) {
      for (std::int32_t u = 0; u < lines.size_u; ++u) {
        const std::int64_t pu = u * kSub + kSub / 2, pv = v * kSub + kSub / 2;
        const int way = area > 0 ? 1 : -1;
        if (side(a, b, axes, pu, pv) != way || side(b, c, axes, pu, pv) != way ||
            side(c, a, axes, pu, pv) != way)
          continue;
        // The plane over (pu, pv): a + s·(b − a) + t·(c − a), with s and t times the area.
        const Wide qu = pu - a[axes.u], qv = pv - a[axes.v];
        const Wide s = qu * along(c, axes.v) - along(c, axes.u) * qv,
                   t = along(b, axes.u) * qv - qu * along(b, axes.v);
        Wide place =
            static_cast<Wide>(a[axes.a]) * area + s * along(b, axes.a) + t * along(c, axes.a);  // times area
        Wide per = area * kSub;
        place -= kSub / 2 * area;
        if (per < 0) per = -per, place = -place;
        Wide first = place / per;
        if (first * per < place) ++first;
        const auto at = static_cast<std::int32_t>(std::clamp<Wide>(first, 0, lines.size_a));
        found.emplace_back(static_cast<std::uint32_t>((v - lines.v.first) * lines.size_u + u), at,
                           area > 0 ? -1 : 1);
      }
    }
  }
  return sorted(found);
}

std::vector<Found> fast(const SnappedMesh& mesh, const std::vector<std::uint32_t>* over, const Axes& axes,
                        const Lines& lines) {
  std::vector<Found> found;
  for (const Crossing& c : cross_lines(mesh, over, axes, lines))
    found.emplace_back(c.line, Crossing::at(c.event), Crossing::step(c.event));
  return sorted(found);
}

/// Triangles of all sizes from less than a voxel to more than the box, some of them on a coarse lattice that
/// holds the lines, the voxels' centres and borders, so that lines pass through edges and corners.
struct Soup {
  std::vector<SnappedPoint> points;
  std::vector<Corners> triangles;

  Soup(int round, std::int32_t edge, std::mt19937& random) {
    const std::size_t count = 1 + random() % 70;
    const auto grain = static_cast<std::int32_t>(round % 3 == 0 ? 1 : kSub / (round % 3 == 1 ? 2 : 4));
    for (std::size_t i = 0; i < 3 * count; i += 3) {
      const auto extent = static_cast<std::int32_t>(kSub / 2) << random() % 6;
      SnappedPoint middle{};
      for (std::size_t axis = 0; axis < 3; ++axis)
        middle[axis] =
            static_cast<std::int32_t>(random() % static_cast<unsigned>((edge + 4) * kSub) - 2 * kSub);
      for (int corner = 0; corner < 3; ++corner) {
        SnappedPoint p{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto away = static_cast<std::int32_t>(random() % static_cast<unsigned>(2 * extent)) - extent;
          p[axis] = (middle[axis] + away) / grain * grain;
        }
        points.push_back(p);
      }
      if (random() % 8 == 0) points[i + 2] = points[i + random() % 2];
      const auto first = static_cast<std::uint32_t>(i);
      triangles.push_back({first, first + 1, first + 2});
    }
  }
  SnappedMesh mesh() const { return {points, triangles}; }
};

void expect_as_literal(const Soup& soup, std::int32_t edge) {
  for (std::size_t a = 0; a < 3; ++a) {
    const Axes axes{a, (a + 1) % 3, (a + 2) % 3};
    for (const Slab v : {Slab{0, edge}, Slab{edge / 3, edge / 2}}) {
      const Lines lines{edge, edge - 1, v};
      EXPECT_EQ(fast(soup.mesh(), nullptr, axes, lines), literal(soup.mesh(), axes, lines)) << "axis " << a;
    }
  }
}

TEST(LineCrossings, AreThoseOfALiteralTwinWithEveryInstructionSet) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    std::mt19937 random(7);
    for (int round = 0; round < 60; ++round) expect_as_literal(Soup(round, 11, random), 11);
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(LineCrossings, OfSomeTrianglesOnly) {
  std::mt19937 random(8);
  const Soup soup(1, 11, random);
  std::vector<std::uint32_t> some;
  Soup rest = soup;
  rest.triangles.clear();
  for (std::uint32_t i = 0; i < soup.triangles.size(); i += 3) {
    some.push_back(i);
    rest.triangles.push_back(soup.triangles[i]);
  }
  const Axes axes{0, 1, 2};
  const Lines lines{11, 11, {0, 11}};
  EXPECT_EQ(fast(soup.mesh(), &some, axes, lines), literal(rest.mesh(), axes, lines));
}

TEST(LineCrossings, OfNoTriangles) {
  EXPECT_TRUE(cross_lines({}, nullptr, {0, 1, 2}, {11, 11, {0, 11}}).empty());
  const std::vector<std::uint32_t> none;
  std::mt19937 random(9);
  EXPECT_TRUE(cross_lines(Soup(0, 11, random).mesh(), &none, {0, 1, 2}, {11, 11, {0, 11}}).empty());
}

}  // namespace
}  // namespace phantom::voxelise::detail
