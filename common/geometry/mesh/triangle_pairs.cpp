#include "common/geometry/mesh/triangle_pairs.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/geometry/box_tree.hpp"

namespace phantom::geometry::detail {
namespace {

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

constexpr double kRounding = 1e-14;  // of a determinant, relative to the products in it

/// Returns −1, 0 or 1: the side of the plane abc on which d lies.
int side(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = a - d, v = b - d, w = c - d;
  const double value = u.dot(v.cross(w));
  const double scale = u.norm() * v.norm() * w.norm();
  return value > kRounding * scale ? 1 : value < -kRounding * scale ? -1 : 0;
}

/// Returns the side of each corner of `t`, relative to the other triangle's plane.
std::array<int, 3> sides_of(const Corners& t, const Corners& plane) {
  return {side(plane[0], plane[1], plane[2], t[0]), side(plane[0], plane[1], plane[2], t[1]),
          side(plane[0], plane[1], plane[2], t[2])};
}

bool on_both_sides(const std::array<int, 3>& sides) {
  return std::max({sides[0], sides[1], sides[2]}) > 0 && std::min({sides[0], sides[1], sides[2]}) < 0;
}

/// Returns the triangle, with its orientation kept, starting at the corner that lies alone on its side of the
/// other triangle's plane. `sides`: of its corners.
Corners lone_corner_first(const Corners& t, const std::array<int, 3>& sides) {
  const int all = sides[0] + sides[1] + sides[2];  // two on one side; or one on each side, one on it
  for (std::size_t i = 0; i < 3; ++i) {
    const bool alone = all == 0 ? sides[i] > 0 : sides[i] == -all;
    if (alone) return {t[i], t[(i + 1) % 3], t[(i + 2) % 3]};
  }
  return t;
}

/// Returns whether two triangles, each with corners on both sides of the other's plane, have more than a
/// point in common. They have if their segments of the line in which the planes intersect overlap (Guigue &
/// Devillers 2003, strictly).
bool segments_overlap(const Corners& s, std::array<int, 3> s_sides, const Corners& t,
                      std::array<int, 3> t_sides) {
  Corners a = lone_corner_first(s, s_sides), b = lone_corner_first(t, t_sides);
  // The theorem requires each lone corner to be on the positive side of the other triangle's plane.
  if (side(b[0], b[1], b[2], a[0]) > 0) std::swap(b[1], b[2]);
  if (side(a[0], a[1], a[2], b[0]) > 0) std::swap(a[1], a[2]);
  return side(a[0], a[1], b[0], b[1]) * side(a[0], a[2], b[2], b[0]) > 0;
}

struct Point2 {
  double x, y;
};

int orientation(const Point2& a, const Point2& b, const Point2& c) {
  const double left = (b.x - a.x) * (c.y - a.y), right = (b.y - a.y) * (c.x - a.x);
  const double doubt = kRounding * (std::abs(left) + std::abs(right));
  return left - right > doubt ? 1 : left - right < -doubt ? -1 : 0;
}

bool inside(const Point2& p, const std::array<Point2, 3>& t) {
  const int first = orientation(t[0], t[1], p);
  return first != 0 && orientation(t[1], t[2], p) == first && orientation(t[2], t[0], p) == first;
}

bool overlap_in_plane(const Corners& s, const Corners& t) {
  const Vector3d normal = (s[1] - s[0]).cross(s[2] - s[0]);
  int drop = 0;
  normal.cwiseAbs().maxCoeff(&drop);
  std::array<Point2, 3> a{}, b{};
  for (std::size_t i = 0; i < 3; ++i) {
    a[i] = {s[i][(drop + 1) % 3], s[i][(drop + 2) % 3]};
    b[i] = {t[i][(drop + 1) % 3], t[i][(drop + 2) % 3]};
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (inside(a[i], b) || inside(b[i], a)) return true;
    for (std::size_t k = 0; k < 3; ++k) {
      const Point2 &p = a[i], &q = a[(i + 1) % 3], &u = b[k], &v = b[(k + 1) % 3];
      if (orientation(p, q, u) * orientation(p, q, v) < 0 && orientation(u, v, p) * orientation(u, v, q) < 0)
        return true;
    }
  }
  return false;
}

}  // namespace

bool triangles_cross(const Corners& s, const Corners& t) {
  const std::array<int, 3> t_sides = sides_of(t, s);
  if (t_sides == std::array{0, 0, 0}) return overlap_in_plane(s, t);
  if (!on_both_sides(t_sides)) return false;
  const std::array<int, 3> s_sides = sides_of(s, t);
  return on_both_sides(s_sides) && segments_overlap(s, s_sides, t, t_sides);
}

TrianglePairs crossing_pairs(const TriangleMesh& mesh, std::size_t max_pairs) {
  const std::vector<BoundingBox> boxes = triangle_boxes(mesh);
  const BoxTree tree(boxes);
  const auto corners_of = [&](std::uint32_t triangle) {
    Corners corners;
    for (std::size_t i = 0; i < 3; ++i)
      corners[i] = mesh.vertices_m[mesh.triangles[triangle][i]].cast<double>();
    return corners;
  };
  TrianglePairs pairs;
  std::size_t left = max_pairs;
  pairs.complete = tree.pairs([&](std::uint32_t place, std::uint32_t other_place) {
    if (left == 0) return false;
    --left;
    const std::uint32_t p = tree.items()[place], q = tree.items()[other_place];
    if (boxes[p].intersects(boxes[q]) && triangles_cross(corners_of(p), corners_of(q))) ++pairs.intersecting;
    return true;
  });
  return pairs;
}

}  // namespace phantom::geometry::detail
