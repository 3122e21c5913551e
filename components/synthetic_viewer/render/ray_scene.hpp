#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/geometry/box_tree.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::synthetic_viewer {

/// A triangle mesh prepared for ray casting: a bounding-box tree, built once. Constant afterwards,
/// thread-safe.
class RayMesh {
 public:
  explicit RayMesh(const geometry::TriangleMesh& mesh);

  /// Returns the distance along the ray (unit `direction`, both in the mesh's frame) to the nearest triangle,
  /// from either side, within (min_m, max_m); nothing if there is none. Real-time safe: yes.
  std::optional<double> nearest(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                double min_m, double max_m) const noexcept;
  /// Returns the point of the surface nearest to `p_m` if it is nearer than `within_m`, all in the mesh's
  /// frame. Real-time safe: yes.
  std::optional<Eigen::Vector3d> closest(const Eigen::Vector3d& p_m, double within_m) const noexcept;
  /// Returns the sides of the box round it; 0 without triangles.
  Eigen::Vector3d size_m() const noexcept;
  /// Returns corners of its triangles, spread over all: `most` at most, if it is above 0.
  std::vector<Eigen::Vector3d> corners(std::size_t most) const;
  /// A point where a ray crosses the surface.
  struct Crossing {
    double distance_m;
    bool entering;  ///< whether the ray comes from the front side, that is, enters the body
  };
  /// Appends every crossing within (min_m, max_m), unordered. Allocates.
  void crossings(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction, double min_m,
                 double max_m, std::vector<Crossing>& found) const;

 private:
  geometry::BoxTree tree_;
  // Three per triangle, in the order in which the tree stores the triangles.
  std::vector<Eigen::Vector3f> corners_m_;
};

/// All bodies that can be between a camera and the point it looks at.
class RayScene {
 public:
  /// Identifies a body: an object's id, or 0 and a link's index.
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
  std::vector<Body> zones;  ///< protected zones, through which all rays but to_zone()'s go

  /// Returns the distance along a ray of W (unit `direction`) to where it enters a zone of that object within
  /// max_m; 0 if it begins inside. Nothing if it does neither. Not real-time safe.
  std::optional<double> to_zone(std::uint16_t object, const Eigen::Vector3d& origin_m,
                                const Eigen::Vector3d& direction, double max_m) const;
  /// Returns the distance to the nearest surface along a ray of W within (min_m, max_m). Real-time safe: yes.
  std::optional<double> nearest(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                double min_m, double max_m) const noexcept;

  struct FreeDistance {
    double distance_m = 0.0;
    BodyName blocked_by;  ///< the body at `wanted_m`
  };
  /// Returns the free distance along a ray of W (unit `direction`) that is nearest to `wanted_m`, if the
  /// point at `wanted_m` lies inside a body or nearer than `clearance_m` to where the ray meets one. Returns
  /// nothing if that point is free, or if no point between 2 × clearance and 3 × `wanted_m` is. A body lies
  /// behind the front sides of its triangles. Surfaces within `clearance_m` of the ray's origin do not count,
  /// because the origin may lie on a skin. Not real-time safe.
  std::optional<FreeDistance> free_distance(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                            double wanted_m, double clearance_m) const;

  /// Returns the share 0…1 of a hit zone that is visible from `eye_m`. Rays run to the eye from points around
  /// the look-at point, a little in front of the skin (towards `pgv`, within radius_m). Surfaces nearer than
  /// radius_m to a ray's start do not count, because the look-at point lies on the skin itself. Real-time
  /// safe: yes.
  double visible_share(const Eigen::Vector3d& look_at_m, const Eigen::Vector3d& pgv, double radius_m,
                       const Eigen::Vector3d& eye_m) const noexcept;
};

}  // namespace phantom::synthetic_viewer
