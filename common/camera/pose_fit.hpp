#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "common/camera/lens.hpp"
#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::camera {

/// A point whose position in W is known, and where it is seen in the picture.
struct SeenPoint {
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

struct PoseFitOptions {
  double pixel_sigma_px = 1.0;  ///< standard deviation of a pixel that was picked, each coordinate
  double largest_rms_px = 6.0;  ///< a fit that is worse is refused
  /// A pose that is roughly right. Decides between poses that the points alone do not tell apart.
  std::optional<geometry::Pose> prior;
};

/// A camera's pose and how sure it is. X_WC: frame C as that of a Lens.
struct PoseFit {
  geometry::Pose X_WC;
  std::vector<double>
      residual_px;      ///< of each point: distance between where it is seen and where it should be
  double rms_px = 0.0;  ///< root of the mean square of residual_px
  double rms_mm =
      0.0;  ///< the same at the points: by so much the overlay is off the thing there, across the view
  double distance_m = 0.0;  ///< mean distance of the points
  /// Covariance of small errors (θ, d): the true camera stands at X_WC · (turn θ, shift d), in C; rad, m.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  int solutions = 1;  ///< number of poses that explain the points about as well, this one included
  /// √ of the greatest variance of the shift along any direction, and of the turn about any axis.
  double position_sigma_m() const;
  double orientation_sigma_rad() const;
};

/// Returns all poses X_WC from which three points are seen exactly where they are (at most four). Empty for
/// points in line, or where no direction is imaged.
std::vector<geometry::Pose> poses_of_three(const LensModel& lens, const std::array<SeenPoint, 3>& points);

/// Returns ∂ pixel / ∂ (θ, d) of a point, with (θ, d) as in PoseFit::covariance.
Eigen::Matrix<double, 2, 6> pixel_by_pose(const LensModel& lens, const geometry::Pose& X_WC,
                                          const Eigen::Vector3d& position_W_m);

/// Finds the camera's pose by least squares of the pixels, from every pose that three of the points allow.
/// Three points alone have up to four poses: the prior decides, and without one they are refused. So are
/// points in line, poses that more points leave open without a prior, and a residual that is too large: then
/// a point was picked wrongly, or the lens is not this one. Not real-time safe.
core::Expected<PoseFit> fit_pose(const LensModel& lens, std::span<const SeenPoint> points,
                                 const PoseFitOptions& options = {});

}  // namespace phantom::camera
