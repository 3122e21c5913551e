#include "common/geometry/implicit/primitives.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace phantom::geometry {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

std::uint32_t add_vertex(TriangleMesh& mesh, double x, double y, double z) {
  mesh.vertices_m.emplace_back(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
  return static_cast<std::uint32_t>(mesh.vertices_m.size() - 1);
}

void add_quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

/// Returns the vertex halfway between two others, projected onto the unit sphere. Both triangles at the edge
/// share it.
std::uint32_t midpoint(std::vector<Eigen::Vector3d>& points,
                       std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t>& known,
                       std::uint32_t a, std::uint32_t b) {
  const auto [entry, is_new] = known.try_emplace({std::min(a, b), std::max(a, b)}, 0U);
  if (is_new) {
    points.push_back((points[a] + points[b]).normalized());
    entry->second = static_cast<std::uint32_t>(points.size() - 1);
  }
  return entry->second;
}

}  // namespace

TriangleMesh make_box(const Eigen::Vector3d& size_m) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    add_vertex(mesh, ((corner & 1) - 0.5) * size_m.x(), ((corner >> 1 & 1) - 0.5) * size_m.y(),
               ((corner >> 2 & 1) - 0.5) * size_m.z());
  }
  add_quad(mesh, 0, 2, 3, 1);  // −z
  add_quad(mesh, 4, 5, 7, 6);  // +z
  add_quad(mesh, 0, 1, 5, 4);  // −y
  add_quad(mesh, 2, 6, 7, 3);  // +y
  add_quad(mesh, 0, 4, 6, 2);  // −x
  add_quad(mesh, 1, 3, 7, 5);  // +x
  return mesh;
}

TriangleMesh make_sphere(double radius_m, int subdivisions) {
  const double g = std::numbers::phi;
  std::vector<Eigen::Vector3d> points = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                         {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                         {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
  for (auto& point : points) point.normalize();
  std::vector<std::array<std::uint32_t, 3>> triangles = {
      {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> known;
    std::vector<std::array<std::uint32_t, 3>> finer;
    finer.reserve(triangles.size() * 4);
    for (const auto& [a, b, c] : triangles) {
      const auto ab = midpoint(points, known, a, b);
      const auto bc = midpoint(points, known, b, c);
      const auto ca = midpoint(points, known, c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  TriangleMesh mesh;
  mesh.triangles = std::move(triangles);
  mesh.vertices_m.reserve(points.size());
  for (const auto& point : points) mesh.vertices_m.push_back((radius_m * point).cast<float>());
  return mesh;
}

TriangleMesh make_cylinder(double radius_m, double height_m, int sides) {
  return make_cone(radius_m, radius_m, height_m, sides);
}

TriangleMesh make_cone(double radius_m, double top_radius_m, double height_m, int sides) {
  TriangleMesh mesh;
  const auto bottom = add_vertex(mesh, 0, 0, -height_m / 2);
  const auto top = add_vertex(mesh, 0, 0, height_m / 2);
  const auto ring = [&](double radius, double z) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
    for (int i = 0; i < sides; ++i) {
      const double angle = kTurn * i / sides;
      add_vertex(mesh, radius * std::cos(angle), radius * std::sin(angle), z);
    }
    return first;
  };
  const std::uint32_t low = ring(radius_m, -height_m / 2);
  const std::uint32_t high = top_radius_m > 0 ? ring(top_radius_m, height_m / 2) : top;
  const auto n = static_cast<std::uint32_t>(sides);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t next = (i + 1) % n;
    mesh.triangles.push_back({bottom, low + next, low + i});
    if (high == top) {
      mesh.triangles.push_back({low + i, low + next, top});
      continue;
    }
    add_quad(mesh, low + i, low + next, high + next, high + i);
    mesh.triangles.push_back({top, high + i, high + next});
  }
  return mesh;
}

TriangleMesh make_prism(const std::array<Eigen::Vector2d, 3>& corners_m, double height_m) {
  TriangleMesh mesh;
  for (const double z : {-height_m / 2, height_m / 2}) {
    for (const auto& corner : corners_m) add_vertex(mesh, corner.x(), corner.y(), z);
  }
  mesh.triangles.push_back({0, 2, 1});
  mesh.triangles.push_back({3, 4, 5});
  for (std::uint32_t i = 0; i < 3; ++i) add_quad(mesh, i, (i + 1) % 3, 3 + (i + 1) % 3, 3 + i);
  return mesh;
}

TriangleMesh make_torus(double ring_radius_m, double tube_radius_m, int ring_sides, int tube_sides) {
  TriangleMesh mesh;
  for (int i = 0; i < ring_sides; ++i) {
    const double u = kTurn * i / ring_sides;
    for (int j = 0; j < tube_sides; ++j) {
      const double v = kTurn * j / tube_sides;
      const double from_axis_m = ring_radius_m + tube_radius_m * std::cos(v);
      add_vertex(mesh, from_axis_m * std::cos(u), from_axis_m * std::sin(u), tube_radius_m * std::sin(v));
    }
  }
  const auto n = static_cast<std::uint32_t>(ring_sides), m = static_cast<std::uint32_t>(tube_sides);
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < m; ++j) {
      const std::uint32_t next_i = (i + 1) % n, next_j = (j + 1) % m;
      add_quad(mesh, i * m + j, next_i * m + j, next_i * m + next_j, i * m + next_j);
    }
  }
  return mesh;
}

}  // namespace phantom::geometry
