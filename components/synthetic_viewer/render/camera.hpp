#pragma once

#include <Eigen/Core>

namespace phantom::synthetic_viewer {

/// A pinhole camera in the workspace frame W; image x to the right, y down. All functions here are pure.
struct Camera {
  Eigen::Vector3d eye_m = Eigen::Vector3d(1, 1, 1);
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();  ///< the looked-at point; never equal to eye_m
  double vertical_fov_rad = 0.7;
  double near_m = 0.02;
  double far_m = 20.0;
  double clearance_m = 0.03;  ///< least distance to a surface
  /// The direction of W that is upwards in the picture. Zero: z of W, or y of W if the camera looks straight
  /// up or down.
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
};

/// Returns the factor for the lengths of views and aids that are not measures themselves, in a workspace with
/// these corners: 1 if its diagonal is 1.5 m or more, less in proportion. So a small cell looks as a large
/// one.
double scene_scale(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m) noexcept;
/// Returns a camera like `camera` for a scene of that scale: with its planes and clearance, where it stands.
Camera at_scale(Camera camera, double scale) noexcept;

/// Returns the view matrix (W → camera: x right, y up, −z forward).
Eigen::Matrix4d view_matrix(const Camera& camera);

/// Returns the OpenGL perspective matrix (camera → clip). `aspect` = width ÷ height.
Eigen::Matrix4d projection_matrix(const Camera& camera, double aspect);

/// Returns one of the eight corners of a box.
Eigen::Vector3d corner_of(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m, int number);

/// Returns a camera that looks at the middle of a box of W from a direction (azimuth from x towards y,
/// elevation above the floor). It is as close as possible with all eight corners in the picture and a border
/// of `margin` (1 = none).
Camera frame_box(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m, double azimuth_rad,
                 double elevation_rad, double vertical_fov_rad, double aspect, double margin = 1.0);

}  // namespace phantom::synthetic_viewer
