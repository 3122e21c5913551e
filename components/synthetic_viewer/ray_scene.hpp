#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/geometry/box_tree.hpp"
#include "common/geometry/mesh.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::synthetic_viewer {

/// A triangle mesh prepared for rays: in a tree of boxes, built once. Constant afterwards, thread-safe.
class RayMesh {
 public:
  explicit RayMesh(const geometry::TriangleMesh& mesh);

  /// Distance along the ray (unit `direction`, both in the mesh's frame) to the nearest triangle, from either
  /// side, within (min_m, max_m); nothing if there is none. Real-time safe: yes.
  std::optional<double> nearest(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                double min_m, double max_m) const noexcept;
  /// A place where a ray meets the surface.
  struct Crossing {
    double distance_m;
    bool entering;  ///< from the front side, that is into the body
  };
  /// Appends every crossing within (min_m, max_m), in no order. Allocates.
  void crossings(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction, double min_m,
                 double max_m, std::vector<Crossing>& found) const;

 private:
  geometry::BoxTree tree_;
  std::vector<Eigen::Vector3f> corners_m_;  // three per triangle, in the order of the tree's places
};

/// Everything that can stand between a camera and what it looks at.
class RayScene {
 public:
  /// Whose body it is: an object's id, or 0 and a link's index.
  struct BodyName {
    std::uint16_t object = 0;
    std::size_t link = 0;
  };
  struct Body {
    std::shared_ptr<const RayMesh> mesh;
    geometry::Pose X_WM;
    BodyName name;
  };
  std::vector<Body> bodies;

  /// Nearest surface along a ray of W within (min_m, max_m). Real-time safe: yes.
  std::optional<double> nearest(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                double min_m, double max_m) const noexcept;

  struct FreeDistance {
    double distance_m = 0.0;
    BodyName blocked_by;  ///< the body at `wanted_m`
  };
  /// If the place `wanted_m` along a ray of W (unit `direction`) lies inside a body, or nearer than
  /// `clearance_m` to where the ray meets one: the free distance along the ray that is nearest to it. Nothing
  /// if the place is free, or if there is no free one between 2 × clearance and 3 × `wanted_m`. What the ray
  /// leaves lies behind its triangles' front sides; what it meets within `clearance_m` of its origin does not
  /// count, for the origin may lie on a skin. Not real-time safe.
  std::optional<FreeDistance> free_distance(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                            double wanted_m, double clearance_m) const;

  /// Share 0…1 of a hit zone that `eye_m` sees: rays from points around the look-at point, a little in front
  /// of the skin (towards `pgv`, of radius_m), to the eye. Surfaces nearer than radius_m to their start do
  /// not count, because the look-at point lies on the skin itself. Real-time safe: yes.
  double visible_share(const Eigen::Vector3d& look_at_m, const Eigen::Vector3d& pgv, double radius_m,
                       const Eigen::Vector3d& eye_m) const noexcept;
};

}  // namespace phantom::synthetic_viewer
