#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/geometry/box_tree.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/workspace/grid.hpp"

namespace phantom::voxelise {

/// The point of the mesh nearest to a given point.
struct NearestPoint {
  double distance_vox = std::numeric_limits<double>::infinity();
  Eigen::Vector3d point_vox = Eigen::Vector3d::Zero();
  std::uint32_t triangle = 0;   ///< its index in the tree
  std::uint32_t looked_at = 0;  ///< triangles of which the distance was computed to find it
};

/// The triangles of a mesh in a tree of boxes, in coordinates from a grid's corner in its reference length,
/// so that distances are true ones. Of cubes, whole numbers are borders between voxels; of others, voxel
/// coordinates times the stretch. Immutable; nearest() is thread-safe.
class TriangleTree {
 public:
  TriangleTree(const geometry::TriangleMesh& mesh_W, const workspace::GridSpec& grid);

  bool empty() const { return corners_.empty(); }
  /// Returns the exact nearest point of all triangles if it is at most `limit_vox` away; otherwise its
  /// distance is infinite.
  NearestPoint nearest(const Eigen::Vector3d& p_vox, double limit_vox = 1e30) const {
    return search(p_vox, limit_vox, {});
  }
  /// The same without a limit. It is faster if `guess` is the tree index of a triangle that is near.
  NearestPoint nearest_with_guess(const Eigen::Vector3d& p_vox, std::uint32_t guess) const;

 private:
  NearestPoint search(const Eigen::Vector3d& p_vox, double limit_vox, NearestPoint best) const;
  NearestPoint on_triangle(const Eigen::Vector3d& p_vox,
                           std::uint32_t triangle) const;  // with the distance squared

  geometry::BoxTree tree_;
  std::vector<std::array<Eigen::Vector3d, 3>> corners_;  // in the tree's order
};

}  // namespace phantom::voxelise
