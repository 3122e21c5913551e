#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/geometry/box_tree.hpp"
#include "common/geometry/mesh/mesh.hpp"

namespace phantom::geometry {

/// Returns the generalised winding number of a mesh at a point: its signed solid angle ÷ 4π (Jacobson, Kavan,
/// Sorkine-Hornung 2013). Inside a closed mesh that faces outwards it is 1, outside 0. For a mesh with holes
/// it lies between and changes smoothly everywhere off the surface. Slow: sums every triangle. A triangle
/// whose plane contains the point contributes 0.
double winding_number(const TriangleMesh& mesh, const Eigen::Vector3d& p_m);

/// Computes winding numbers fast: far groups of triangles are approximated by a dipole and its first moment
/// (Barill et al. 2018), and near triangles are summed exactly. The error is below 0.02 for meshes that are
/// oriented consistently.
class WindingTree {
 public:
  /// Builds the tree in O(n log n). Copies what it needs of the mesh.
  explicit WindingTree(const TriangleMesh& mesh);

  /// Returns the winding number at a point. Thread-safe. Allocates nothing.
  /// If `steps` is not null, it becomes what that cost, in steps of a formula (Formula::work()).
  double at(const Eigen::Vector3d& p_m, std::uint64_t* steps = nullptr) const;

  /// Steps for each group and each triangle that at() looks at. Measured on 500,000 loose triangles.
  static constexpr std::uint64_t kGroupSteps = 4, kTriangleSteps = 8;

 private:
  struct Group {             // far-field approximation of the triangles below a node of the tree
    Eigen::Vector3d centre;  ///< area centroid
    Eigen::Vector3d normal;  ///< sum of area normals, m²
    Eigen::Matrix3d moment;  ///< Σ (centre of triangle − centre) · area normalᵀ
    double radius = 0;       ///< radius of the ball around `centre` that holds the triangles
  };
  struct Corners {  // a triangle's corners and its far-field approximation
    Eigen::Vector3d a, b, c, centre, area_normal;
    double radius_2;  ///< square of the farthest corner's distance from the centre
  };
  Group group_of(std::uint32_t first, std::uint32_t count) const;

  BoxTree tree_;
  std::vector<Corners> triangles_;  // in the order of the tree's places
  std::vector<Group> groups_;       // per node of the tree
};

}  // namespace phantom::geometry
