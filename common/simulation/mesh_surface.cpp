#include "common/simulation/mesh_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/geometry/mesh/mesh_topology.hpp"
#include "common/geometry/mesh/weld.hpp"
#include "common/geometry/point_triangle.hpp"

namespace phantom::simulation {
namespace {

using Corners = std::array<Eigen::Vector3d, 3>;

Eigen::Vector3d area_normal(const Corners& t) { return (t[1] - t[0]).cross(t[2] - t[0]); }

// Returns the triangles by vertices that are joined where they coincide, without those of no area.
std::vector<geometry::Triangle> joined(const geometry::TriangleMesh& mesh) {
  const std::vector<std::uint32_t> first = geometry::weld(mesh.vertices_m);
  std::vector<geometry::Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const geometry::Triangle own{first[t[0]], first[t[1]], first[t[2]]};
    if (own[0] != own[1] && own[1] != own[2] && own[2] != own[0]) triangles.push_back(own);
  }
  return triangles;
}

bool contains(const geometry::BoundingBox& box, const geometry::BoundingBox& other) {
  return (box.min_m.array() <= other.min_m.array()).all() && (other.max_m.array() <= box.max_m.array()).all();
}

}  // namespace

MeshSurface::MeshSurface(const geometry::TriangleMesh& mesh)
    : tree_(geometry::triangle_boxes(mesh)),
      winding_(mesh),
      faces_show_side_(geometry::is_oriented_surface(joined(mesh)) &&
                       geometry::enclosed_volume_m3(mesh) > 0.0) {
  const geometry::BoundingBox box = mesh.bounding_box();
  min_m_ = box.min_m.cast<double>();
  max_m_ = box.max_m.cast<double>();
  corners_.reserve(mesh.triangles.size());
  for (const std::uint32_t item : tree_.items()) {
    const auto& t = mesh.triangles[item];
    corners_.push_back({mesh.vertices_m[t[0]].cast<double>(), mesh.vertices_m[t[1]].cast<double>(),
                        mesh.vertices_m[t[2]].cast<double>()});
  }
}

std::vector<geometry::TriangleMesh> closed_shells(const geometry::TriangleMesh& mesh) {
  const std::vector<geometry::Triangle> triangles = joined(mesh);
  const geometry::MeshTopology topology = geometry::topology_of(triangles);
  std::vector<geometry::TriangleMesh> shells(topology.shells.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    geometry::TriangleMesh& shell = shells[topology.shell_of[i]];
    const auto first = static_cast<std::uint32_t>(shell.vertices_m.size());
    for (const std::uint32_t corner : triangles[i]) shell.vertices_m.push_back(mesh.vertices_m[corner]);
    shell.triangles.push_back({first, first + 1, first + 2});
  }
  std::vector<geometry::TriangleMesh> solids, cavities;
  for (std::size_t s = 0; s < shells.size(); ++s) {
    const auto& shell = topology.shells[s];
    if (!shell.closed || !shell.orientable || shell.turned > 0) return {mesh};
    (geometry::enclosed_volume_m3(shells[s]) > 0.0 ? solids : cavities).push_back(std::move(shells[s]));
  }
  for (const geometry::TriangleMesh& cavity : cavities) {
    geometry::TriangleMesh* around = nullptr;
    for (geometry::TriangleMesh& solid : solids) {
      const bool nearer = around == nullptr || contains(around->bounding_box(), solid.bounding_box());
      if (nearer && contains(solid.bounding_box(), cavity.bounding_box())) around = &solid;
    }
    if (around == nullptr) return {mesh};
    around->append(cavity);
  }
  return solids;
}

bool MeshSurface::inside(const Eigen::Vector3d& p_m) const noexcept {
  return square_to_box(p_m) == 0.0 && std::abs(winding_.at(p_m)) >= 0.5;
}

MeshSurface::Nearest MeshSurface::nearest(const Eigen::Vector3d& p_m, double limit_m) const noexcept {
  double square = limit_m * limit_m;
  std::uint32_t triangle = 0;
  Eigen::Vector3d point = p_m;
  bool found = false;
  tree_.near(p_m, square, [&](std::uint32_t place) {
    const Corners& t = corners_[place];
    const Eigen::Vector3d there = geometry::closest_point_on_triangle(p_m, t[0], t[1], t[2]);
    const double there_2 = (there - p_m).squaredNorm();
    if (there_2 >= square) return;
    square = there_2, triangle = place, point = there, found = true;
  });
  if (!found) return {inside(p_m) ? -limit_m : limit_m, Eigen::Vector3d::Zero()};
  const Eigen::Vector3d face = area_normal(corners_[triangle]).normalized();
  const Eigen::Vector3d way = p_m - point;
  const double distance_m = std::sqrt(square);
  // Beside the middle of a face, and not of its edge, the way is along the face's normal.
  const double along = way.dot(face);
  const bool beside_face =
      faces_show_side_ && std::abs(along) > (1.0 - 1e-12) * distance_m && distance_m > 1e-9;
  const bool within = beside_face ? along < 0.0 : inside(p_m);
  if (distance_m < 1e-9) return {within ? -distance_m : distance_m, face};
  return {within ? -distance_m : distance_m, (within ? -1.0 : 1.0) / distance_m * way};
}

}  // namespace phantom::simulation
