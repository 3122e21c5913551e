#include "tests/experiments/specimens.hpp"

#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "common/geometry/implicit/primitives.hpp"

namespace phantom::experiments {
namespace {

using Corners = std::vector<Eigen::Vector2d>;

double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

bool within(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
            const Eigen::Vector2d& c) {
  return turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
}

bool is_ear(const Corners& corners, const std::vector<std::uint32_t>& left, std::size_t i) {
  const std::size_t n = left.size(), before = (i + n - 1) % n, after = (i + 1) % n;
  const auto &a = corners[left[before]], &b = corners[left[i]], &c = corners[left[after]];
  if (turn(a, b, c) <= 0.0) return false;
  for (std::size_t k = 0; k < n; ++k) {
    if (k != before && k != i && k != after && within(corners[left[k]], a, b, c)) return false;
  }
  return true;
}

/// Triangles of a polygon by cutting off ears: n − 2 of them.
std::vector<std::array<std::uint32_t, 3>> triangulated(const Corners& corners) {
  std::vector<std::uint32_t> left(corners.size());
  std::iota(left.begin(), left.end(), 0U);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::size_t i = 0, tried = 0;
  while (left.size() > 3) {
    const std::size_t n = left.size();
    i %= n;
    if (is_ear(corners, left, i)) {
      triangles.push_back({left[(i + n - 1) % n], left[i], left[(i + 1) % n]});
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
      tried = 0;
    } else if (++tried > n) {
      throw std::logic_error("a polygon whose edges cross, or that is not counter-clockwise");
    }
    ++i;  // not the next corner, so that the triangles do not all fan out from one
  }
  triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

}  // namespace

std::vector<Eigen::Vector2d> complex_section(double radius_m, double depth) {
  constexpr int kCorners = 56;
  Corners corners;
  for (int i = 0; i < kCorners; ++i) {
    const double psi = 2.0 * std::numbers::pi * i / kCorners;
    const double r_m = radius_m / (1.0 + depth) * (1.0 - depth * std::sin(3.0 * psi));
    corners.emplace_back(r_m * std::cos(psi), r_m * std::sin(psi));
  }
  return corners;
}

geometry::TriangleMesh complex_cylinder(double radius_m, double height_m, double depth) {
  return drawn_polygon(complex_section(radius_m, depth), height_m);
}

geometry::TriangleMesh drawn_polygon(const std::vector<Eigen::Vector2d>& corners_m, double height_m) {
  geometry::TriangleMesh mesh;
  const auto n = static_cast<std::uint32_t>(corners_m.size());
  for (const double z_m : {-0.5 * height_m, 0.5 * height_m}) {
    for (const auto& corner : corners_m) {
      mesh.vertices_m.emplace_back(Eigen::Vector3d(corner.x(), corner.y(), z_m).cast<float>());
    }
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
  }
  for (const auto& [a, b, c] : triangulated(corners_m)) {
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({n + a, n + b, n + c});
  }
  return mesh;
}

geometry::TriangleMesh wedge_block(const Eigen::Vector3d& size_m, const Eigen::Vector2d& groove_m,
                                   double taper_m) {
  const double x = 0.5 * size_m.x(), z = 0.5 * size_m.z(), depth = groove_m.x(), half = 0.5 * groove_m.y();
  // In the plane (x, z); drawn along z and then turned so that the drawing's y is W's z.
  const Corners outline{{-x, -z},         {x, -z},    {x - taper_m, z}, {half, z},
                        {0.0, z - depth}, {-half, z}, {taper_m - x, z}};
  geometry::Pose upright;
  upright.rotation = geometry::rotation_from_rpy(0.5 * std::numbers::pi, 0.0, 0.0);
  return drawn_polygon(outline, size_m.y()).transformed(upright);
}

double wedge_volume_m3(const Eigen::Vector3d& size_m, const Eigen::Vector2d& groove_m, double taper_m) {
  return size_m.y() * (size_m.z() * (size_m.x() - taper_m) - 0.5 * groove_m.x() * groove_m.y());
}

geometry::TriangleMesh hollow_cylinder(double outer_radius_m, double inner_radius_m, double height_m,
                                       int sides) {
  geometry::TriangleMesh mesh;
  const auto n = static_cast<std::uint32_t>(sides);
  // Rings: outer low, outer high, inner high, inner low; neighbours in this circle are joined.
  const std::array<std::array<double, 2>, 4> rings{{{outer_radius_m, -0.5 * height_m},
                                                    {outer_radius_m, 0.5 * height_m},
                                                    {inner_radius_m, 0.5 * height_m},
                                                    {inner_radius_m, -0.5 * height_m}}};
  for (const auto& [r_m, z_m] : rings) {
    for (int i = 0; i < sides; ++i) {
      const double psi = 2.0 * std::numbers::pi * i / sides;
      mesh.vertices_m.emplace_back(
          Eigen::Vector3d(r_m * std::cos(psi), r_m * std::sin(psi), z_m).cast<float>());
    }
  }
  for (std::uint32_t ring = 0; ring < 4; ++ring) {
    const std::uint32_t here = ring * n, next = (ring + 1) % 4 * n;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t j = (i + 1) % n;
      mesh.triangles.push_back({here + i, here + j, next + j});
      mesh.triangles.push_back({here + i, next + j, next + i});
    }
  }
  return mesh;
}

geometry::TriangleMesh bar() { return geometry::make_box({0.8, 0.05, 0.05}); }

geometry::TriangleMesh placed(const geometry::TriangleMesh& mesh, const Eigen::Vector3d& p_W_m,
                              double yaw_rad) {
  return mesh.transformed({geometry::rotation_from_rpy(0.0, 0.0, yaw_rad), p_W_m});
}

}  // namespace phantom::experiments
