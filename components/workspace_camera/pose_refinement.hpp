#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/fusion/depth_image.hpp"
#include "common/geometry/mesh/mesh.hpp"

namespace phantom::workspace_camera {

/// What a depth image says of an object at poses near one another: the object is drawn there and compared
/// with what was measured. A pixel at whose depth the object is drawn speaks for the pose, the more the
/// nearer; one that was measured behind speaks against it. So silhouettes count, which points of a surface
/// say nothing of. Deterministic; not thread-safe; not real-time safe.
class PoseRefinement {
 public:
  /// The pixels' evidence.
  struct Evidence {
    std::vector<float> seen_m;            ///< measured; 0: says nothing
    std::vector<float> tolerance_m;       ///< within which a measured depth is a drawn one
    std::vector<std::uint8_t> explained;  ///< 1: another object is seen there, which speaks for no pose
  };

  /// `camera`, `evidence` and `mesh_O` must outlive this; `centre_O_m`: about which it is turned, `radius_m`:
  /// of its farthest point from that.
  PoseRefinement(const fusion::PinholeCamera& camera, const geometry::Pose& X_WC, const Evidence& evidence,
                 const geometry::TriangleMesh& mesh_O, const Eigen::Vector3d& centre_O_m, double radius_m);

  /// Returns for how many pixels the pose speaks, less those that speak against it.
  double score(const geometry::Pose& X_WO);
  /// Returns the best pose near one, by pattern search (Hooke and Jeeves 1961) along and about the axes of W.
  /// A direction in which no pixel tells the poses apart is left as it is.
  geometry::Pose best_near(const geometry::Pose& X_WO);
  /// Returns whether the image tells a pose from those that are moved by ±motion (θ, d) about the centre.
  bool tells_apart(const geometry::Pose& X_WO, const Eigen::Matrix<double, 6, 1>& motion);

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  geometry::Pose moved(const geometry::Pose& X_WO, const Vector6& motion) const;

  const fusion::PinholeCamera& camera_;
  const geometry::Pose X_CW_;
  const Evidence& evidence_;
  const geometry::TriangleMesh& mesh_O_;
  const Eigen::Vector3d centre_O_m_;
  const double radius_m_;
  std::vector<float> drawn_m_;  // by pixel; 0: nothing
  std::vector<std::size_t> covered_;
  std::vector<Eigen::Vector3d> corners_m_;
};

}  // namespace phantom::workspace_camera
