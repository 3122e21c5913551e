#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/geometry/box_tree.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/mesh/winding_number.hpp"

namespace phantom::simulation {

/// A mesh's surface, to ask how far a point is from it. Exact; concave shapes as they are. A mesh whose
/// shells overlap is split by closed_shells() before. Immutable; queries are thread-safe and real-time safe.
class MeshSurface {
 public:
  struct Nearest {
    double distance_m = 0.0;                            ///< negative inside
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit vector out of the body, at the nearest point
  };

  /// Builds the trees in O(n log n): 1 µs per triangle. The mesh is in the body's frame, and has a triangle.
  explicit MeshSurface(const geometry::TriangleMesh& mesh);

  /// Returns the distance of `p_m` if it is less than `limit_m`; otherwise `limit_m`, or −limit_m inside. A
  /// point is inside where the winding number's magnitude is ½ or more, which is defined for meshes with
  /// holes, too.
  Nearest nearest(const Eigen::Vector3d& p_m, double limit_m) const noexcept;
  /// Returns the square of the distance of `p_m` from the box around the mesh.
  double square_to_box(const Eigen::Vector3d& p_m) const noexcept {
    return (min_m_ - p_m).cwiseMax(p_m - max_m_).cwiseMax(0.0).squaredNorm();
  }
  double radius_m() const noexcept { return 0.5 * (max_m_ - min_m_).norm(); }
  Eigen::Vector3d centre_m() const noexcept { return 0.5 * (max_m_ + min_m_); }

 private:
  bool inside(const Eigen::Vector3d& p_m) const noexcept;

  Eigen::Vector3d min_m_, max_m_;
  geometry::BoxTree tree_;
  std::vector<std::array<Eigen::Vector3d, 3>> corners_;  // in the tree's order
  geometry::WindingTree winding_;
  bool faces_show_side_ = false;  // closed, every triangle faces outwards
};

/// Splits a mesh into its closed shells, each with the cavities in it, so that faces which lie within another
/// shell are none of its surface. A mesh with a shell that is open or faces inwards stays whole.
std::vector<geometry::TriangleMesh> closed_shells(const geometry::TriangleMesh& mesh);

}  // namespace phantom::simulation
