#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/geometry/box_tree.hpp"
#include "common/geometry/mesh.hpp"

namespace phantom::geometry {

/// Generalised winding number of a mesh at a point: its signed solid angle ÷ 4π (Jacobson, Kavan,
/// Sorkine-Hornung 2013). Inside a closed mesh that faces outwards 1, outside 0; with holes something
/// between, changing smoothly everywhere off the surface. Every triangle is summed: slow. A triangle whose
/// plane holds the point contributes 0.
double winding_number(const TriangleMesh& mesh, const Eigen::Vector3d& p_m);

/// The same, fast: far groups of triangles act as a dipole and its first moment (Barill et al. 2018), near
/// triangles are summed exactly. Off by less than 0.02 for meshes whose triangles agree on outside.
class WindingTree {
 public:
  /// Copies what it needs. O(n log n).
  explicit WindingTree(const TriangleMesh& mesh);

  /// Thread-safe. Allocates nothing.
  double at(const Eigen::Vector3d& p_m) const;

 private:
  struct Group {             // the triangles below a node of the tree, as they look from afar
    Eigen::Vector3d centre;  ///< of area
    Eigen::Vector3d normal;  ///< sum of area normals, m²
    Eigen::Matrix3d moment;  ///< Σ (centre of triangle − centre) · area normalᵀ
    double radius = 0;       ///< of the ball around `centre` that holds the triangles
  };
  struct Corners {  // of a triangle, and what stands for it from afar
    Eigen::Vector3d a, b, c, centre, area_normal;
    double radius_2;  ///< square of the farthest corner's distance from the centre
  };
  Group group_of(std::uint32_t first, std::uint32_t count) const;

  BoxTree tree_;
  std::vector<Corners> triangles_;  // in the order of the tree's places
  std::vector<Group> groups_;       // per node of the tree
};

}  // namespace phantom::geometry
