#pragma once

// Private to this library: the exact distance from any point to a mesh.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/geometry/mesh.hpp"
#include "common/voxel/grid.hpp"

namespace phantom::voxel::detail {

/// Where the mesh is nearest to a point.
struct NearestPoint {
  double distance_vox = std::numeric_limits<double>::infinity();
  Eigen::Vector3d point_vox = Eigen::Vector3d::Zero();
  std::uint32_t triangle = 0;  ///< its place in the tree
};

/// A tree of boxes around the triangles of a mesh, in voxels of a grid (whole numbers are borders between
/// voxels). Immutable; nearest() is thread-safe.
class TriangleTree {
 public:
  TriangleTree(const geometry::TriangleMesh& mesh_W, const GridSpec& grid);

  bool empty() const { return corners_.empty(); }
  /// The nearest point of all triangles, exactly, if it is not farther than `limit_vox`; else infinitely far.
  NearestPoint nearest(const Eigen::Vector3d& p_vox, double limit_vox = 1e30) const {
    return search(p_vox, limit_vox, {});
  }
  /// The same without limit, faster if `guess` is the place in the tree of a triangle that lies near.
  NearestPoint nearest_with_guess(const Eigen::Vector3d& p_vox, std::uint32_t guess) const;

 private:
  struct Node {
    Eigen::Vector3d low, high;           // of the box
    std::uint32_t first = 0, count = 0;  // triangles of a leaf
    std::uint32_t right = 0;             // else its second child; the first one stands next
  };
  NearestPoint search(const Eigen::Vector3d& p_vox, double limit_vox, NearestPoint best) const;
  NearestPoint on_triangle(const Eigen::Vector3d& p_vox,
                           std::uint32_t triangle) const;  // with the distance squared
  double square_to(const Node& node, const Eigen::Vector3d& p_vox) const {
    return (node.low - p_vox).cwiseMax(p_vox - node.high).cwiseMax(0.0).squaredNorm();
  }
  std::uint32_t build(std::vector<std::uint32_t>& order, std::size_t from, std::size_t to);

  std::vector<std::array<Eigen::Vector3d, 3>> corners_;  // in leaf order
  std::vector<Node> nodes_;
};

}  // namespace phantom::voxel::detail
