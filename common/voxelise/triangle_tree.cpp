#include "common/voxelise/triangle_tree.hpp"

#include <cmath>

#include "common/geometry/point_triangle.hpp"

namespace phantom::voxelise {
namespace {

/// Returns the float box around corners of double precision, rounded outwards so that nothing is cut off.
geometry::BoundingBox box_around(const std::array<Eigen::Vector3d, 3>& corners) {
  geometry::BoundingBox box;
  for (const Eigen::Vector3d& corner : corners) box.extend(corner.cast<float>());
  constexpr float kFar = std::numeric_limits<float>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    box.min_m[axis] = std::nextafter(box.min_m[axis], -kFar);
    box.max_m[axis] = std::nextafter(box.max_m[axis], kFar);
  }
  return box;
}

}  // namespace

TriangleTree::TriangleTree(const geometry::TriangleMesh& mesh_W, const workspace::GridSpec& grid) {
  std::vector<Eigen::Vector3d> vertices;
  vertices.reserve(mesh_W.vertices_m.size());
  for (const Eigen::Vector3f& vertex : mesh_W.vertices_m)
    vertices.push_back((vertex.cast<double>() - grid.origin_m) / grid.voxel_size_m.reference_m());
  const auto corners_of = [&](const std::array<std::uint32_t, 3>& t) {
    return std::array{vertices[t[0]], vertices[t[1]], vertices[t[2]]};
  };
  std::vector<geometry::BoundingBox> boxes;
  boxes.reserve(mesh_W.triangles.size());
  for (const auto& t : mesh_W.triangles) boxes.push_back(box_around(corners_of(t)));
  tree_ = geometry::BoxTree(boxes);
  corners_.reserve(boxes.size());
  for (const std::uint32_t item : tree_.items()) corners_.push_back(corners_of(mesh_W.triangles[item]));
}

NearestPoint TriangleTree::on_triangle(const Eigen::Vector3d& p_vox, std::uint32_t triangle) const {
  const auto& t = corners_[triangle];
  const Eigen::Vector3d point = geometry::closest_point_on_triangle(p_vox, t[0], t[1], t[2]);
  return {(point - p_vox).squaredNorm(), point, triangle};
}

NearestPoint TriangleTree::nearest_with_guess(const Eigen::Vector3d& p_vox, std::uint32_t guess) const {
  const NearestPoint there = on_triangle(p_vox, guess);
  return search(p_vox, std::sqrt(there.distance_vox), there);
}

NearestPoint TriangleTree::search(const Eigen::Vector3d& p_vox, double limit_vox, NearestPoint best) const {
  constexpr double kRounding = 1.0 + 1e-12;  // keeps points that are equally near
  double least = limit_vox * limit_vox * kRounding;
  std::uint32_t looked_at = 0;
  tree_.near(p_vox, least, [&](std::uint32_t triangle) {
    ++looked_at;
    const NearestPoint there = on_triangle(p_vox, triangle);
    if (there.distance_vox > least) return;
    least = there.distance_vox;
    best = there;
  });
  best.distance_vox = std::sqrt(best.distance_vox);
  best.looked_at = looked_at;
  return best;
}

}  // namespace phantom::voxelise
