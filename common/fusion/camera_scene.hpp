#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/fusion/depth_image.hpp"
#include "common/geometry/box_tree.hpp"
#include "common/geometry/mesh/mesh.hpp"

namespace phantom::fusion {

/// What one pixel sees of a scene, without errors.
struct SeenPixel {
  float depth_m = 0.0F;           ///< along z of C; 0: nothing within the camera's range
  float cos_incidence = 0.0F;     ///< of the angle between the line of sight and the surface's normal, 0…1
  float mirrored_depth_m = 0.0F;  ///< specular surfaces: the depth of what they mirror there; 0: nothing
  bool specular = false;
};

/// A scene of triangles for a simulated depth camera. Objects keep the order in which they were added.
/// Queries are thread-safe and allocate nothing.
class CameraScene {
 public:
  /// An object: its surface in W, and whether it is polished metal (stainless steel).
  struct Object {
    geometry::TriangleMesh mesh_W;
    bool specular = false;
  };
  explicit CameraScene(const std::vector<Object>& objects);

  /// Returns the first triangle that a ray origin + s · direction meets for s in (from, to), or nothing.
  struct Hit {
    double s = 0.0;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, towards the origin of the ray
    bool specular = false;
  };
  std::optional<Hit> first_hit(const Eigen::Vector3d& origin_W_m, const Eigen::Vector3d& direction_W,
                               double from, double to) const;
  /// Returns the distance of a point from the nearest triangle, in metres; at most `limit_m`.
  double distance_m(const Eigen::Vector3d& p_W_m, double limit_m) const;

  /// Renders what a camera at `X_WC` sees: the camera's pixels, row by row. Resizes `seen`.
  void render(const PinholeCamera& camera, const geometry::Pose& X_WC, std::vector<SeenPixel>& seen) const;

 private:
  SeenPixel see(const PinholeCamera& camera, const Eigen::Vector3d& eye_W_m,
                const Eigen::Vector3d& direction_W) const;

  struct Triangle {
    Eigen::Vector3d a, b, c;
    bool specular;
  };
  geometry::BoxTree tree_;
  std::vector<Triangle> triangles_;  // in the order of the tree's places
};

}  // namespace phantom::fusion
