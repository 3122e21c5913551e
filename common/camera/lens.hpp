#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

namespace phantom::camera {

/// A pinhole camera with Brown's distortion. Frame C: x right, y down, z along the line of sight. Pixel (0,
/// 0) is the middle of the upper left pixel. A point of C projects to n = (x/z, y/z), which is distorted to
///     n (1 + k1 r² + k2 r⁴ + k3 r⁶) + (2 p1 nx ny + p2 (r² + 2 nx²), p1 (r² + 2 ny²) + 2 p2 nx ny),  r =
///     |n|,
/// and then scaled by the focal lengths and shifted by the principal point.
struct Lens {
  int width_px = 0, height_px = 0;
  double fx_px = 0.0, fy_px = 0.0;  ///< focal lengths
  double cx_px = 0.0, cy_px = 0.0;  ///< principal point
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0;

  friend bool operator==(const Lens&, const Lens&) = default;
};

/// Returns what is wrong with a lens, in words; empty if nothing is: sizes and focal lengths must be
/// positive, the principal point within the picture, and every pixel of its border must see some direction.
std::string fault_of(const Lens& lens);

/// Projects points to pixels and back. Constant, thread-safe, real-time safe.
class LensModel {
 public:
  explicit LensModel(const Lens& lens);

  const Lens& lens() const noexcept { return lens_; }
  /// Returns the pixel of a point of C, which may lie outside of the picture; nothing for a point that is not
  /// in front of the camera, or so far aside that the distortion folds back.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_C_m) const noexcept;
  /// Returns ∂ pixel / ∂ p_C of a point that project() accepts, px/m.
  Eigen::Matrix<double, 2, 3> jacobian(const Eigen::Vector3d& p_C_m) const noexcept;
  /// Returns the direction (x/z, y/z) that a pixel sees; nothing where no direction is imaged there.
  std::optional<Eigen::Vector2d> direction(const Eigen::Vector2d& pixel) const noexcept;
  /// Greatest |n| that the distortion images one to one.
  double largest_radius() const noexcept { return largest_radius_; }

 private:
  Eigen::Vector2d distorted(const Eigen::Vector2d& n) const noexcept;
  Eigen::Matrix2d distorted_by(const Eigen::Vector2d& n) const noexcept;

  Lens lens_;
  double largest_radius_;
};

/// Returns the lens without distortion, of that size, with its principal point in the middle and square
/// pixels, whose picture just contains the middles of all four borders of `lens`.
Lens straightened(const LensModel& lens, int width_px, int height_px);

}  // namespace phantom::camera
