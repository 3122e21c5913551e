#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "common/geometry/box_tree.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/mesh/winding_number.hpp"

namespace phantom::survey {

/// The surface of an object, from which touches are measured. Frame O is the mesh's frame. Immutable; queries
/// are thread-safe. Not real-time safe.
class TouchSurface {
 public:
  /// The place of the surface that a ball touches, or would touch.
  struct Place {
    double distance_m = 0.0;                              ///< of the ball's centre; negative inside
    Eigen::Vector3d normal_O = Eigen::Vector3d::UnitZ();  ///< in which the distance grows, unit
    Eigen::Vector3d point_O_m = Eigen::Vector3d::Zero();  ///< the nearest point of the surface
  };

  /// `mesh_O`: its triangles all face outwards, or all inwards; degenerate ones are left out.
  explicit TouchSurface(const geometry::TriangleMesh& mesh_O);

  bool empty() const { return facets_.empty(); }  ///< there is nothing to touch
  /// Returns the nearest place of the surface, which must not be empty.
  Place nearest(const Eigen::Vector3d& p_O_m) const;
  /// Returns the nearest place among the triangles whose outward normal is within acos(`least_cosine`) of
  /// `normal_O`; none if there is no such triangle. The distance is positive on the side to which `normal_O`
  /// points.
  std::optional<Place> nearest_facing(const Eigen::Vector3d& p_O_m, const Eigen::Vector3d& normal_O,
                                      double least_cosine) const;

  /// Corners of the bounding box: in a small motion no point of the object moves farther than one of them.
  const std::vector<Eigen::Vector3d>& extremes_O_m() const { return extremes_O_m_; }
  const Eigen::Vector3d& centre_O_m() const { return centre_O_m_; }  ///< of the bounding box

 private:
  struct Facet {
    std::array<Eigen::Vector3d, 3> corners_m;
    Eigen::Vector3d normal;  // unit, outwards
  };

  geometry::BoxTree tree_;
  geometry::WindingTree winding_;
  std::vector<Facet> facets_;  // in the tree's order
  std::vector<Eigen::Vector3d> extremes_O_m_;
  Eigen::Vector3d centre_O_m_ = Eigen::Vector3d::Zero();
};

}  // namespace phantom::survey
