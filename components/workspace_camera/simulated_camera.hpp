#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/fusion/camera_scene.hpp"
#include "components/workspace_camera/arm_view.hpp"
#include "components/workspace_camera/config.hpp"

namespace phantom::workspace_camera {

/// An object that stands elsewhere from a time on.
struct DisplacedMesh {
  geometry::TriangleMesh mesh_W;  ///< before
  Eigen::Vector3d by_m = Eigen::Vector3d::Zero();
  double from_s = 0.0;
};

/// A depth camera that is fixed in a simulated cell: it sees the cell's objects where they really stand, the
/// arm, and things that the model does not know, with a sensor's errors. Pure: equal inputs give equal
/// images. What the arm carries is not seen. One thread.
class SimulatedCamera {
 public:
  /// Looks at the cell once: its objects do not move, but for those of `displaced`, which are not in `cell`.
  /// `cell`: must not be changed by the caller later.
  SimulatedCamera(const SimulatedOptions& options, const geometry::Pose& X_WC,
                  const fusion::CameraScene& cell, const std::vector<Thing>& things,
                  std::vector<DisplacedMesh> displaced = {});

  /// Returns the image of a time, counted from the start; valid until the next call. `arm`: null: there is
  /// none, or where it is is not known.
  std::span<const std::uint16_t> image(double time_s, const ArmView* arm, const ArmPose* pose);
  const fusion::PinholeCamera& camera() const { return options_.camera; }

 private:
  void draw(const geometry::TriangleMesh& mesh, const geometry::Pose& X_WM, bool steel);

  SimulatedOptions options_;
  geometry::Pose X_CW_;
  std::vector<Thing> things_;
  std::vector<DisplacedMesh> displaced_;
  std::vector<geometry::TriangleMesh> shapes_;  // of the things
  std::vector<fusion::SeenPixel> cell_, seen_;
  std::vector<std::uint16_t> depth_mm_;
  std::vector<Eigen::Vector3d> corners_m_;
  std::uint64_t frame_ = 0;
};

}  // namespace phantom::workspace_camera
