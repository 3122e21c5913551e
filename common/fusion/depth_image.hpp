#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::fusion {

/// A pinhole camera without distortion. Frame C: x right, y down, z along the line of sight. Pixel (0, 0) is
/// the centre of the upper left pixel. A point of C is imaged at (fx x/z + cx, fy y/z + cy).
struct PinholeCamera {
  int width_px = 0, height_px = 0;
  double fx_px = 0.0, fy_px = 0.0;               ///< focal lengths
  double cx_px = 0.0, cy_px = 0.0;               ///< principal point
  double min_depth_m = 0.1, max_depth_m = 10.0;  ///< depths that the sensor can measure

  std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  }
  /// Returns the direction (x/z, y/z, 1) that a pixel sees, in C.
  Eigen::Vector3d direction(double u_px, double v_px) const noexcept {
    return {(u_px - cx_px) / fx_px, (v_px - cy_px) / fy_px, 1.0};
  }
  friend bool operator==(const PinholeCamera&, const PinholeCamera&) = default;
};

/// Greatest width or height of a depth image, and greatest number of its pixels.
inline constexpr int kMaxImageEdge_px = 4096;
inline constexpr std::size_t kMaxImagePixels = std::size_t{1} << 22;
/// Farthest that a camera may be from the origin of W, along an axis.
inline constexpr double kMaxCameraDistance_m = 1000.0;
/// The greatest depth that a camera may claim to measure.
inline constexpr double kMaxDepth_m = 100.0;

/// Standard deviation of a measured depth: it grows with the square of the depth, as with every sensor that
/// triangulates.
struct DepthSigma {
  double at_1m_m = 0.0015;

  double at(double depth_m) const noexcept { return at_1m_m * depth_m * depth_m; }
};

/// Checks intrinsics and the range of depths. The error names the value and what is allowed.
core::Status check_camera(const PinholeCamera& camera);

/// What arrives with the pixels of a depth image.
struct DepthHeader {
  PinholeCamera camera;
  geometry::Pose X_WC;  ///< pose of the camera in the workspace frame at `time_s`
  double time_s = 0.0;  ///< when the image was taken
};

/// Checks a header: the camera, a rotation to 1e-4, a place within kMaxCameraDistance_m, a finite time ≥ 0.
core::Status check_header(const DepthHeader& header);

/// A checked depth image. Every pixel holds a depth along z of C in metres within the camera's range, or 0:
/// not measured.
class DepthImage {
 public:
  const DepthHeader& header() const noexcept { return header_; }
  const PinholeCamera& camera() const noexcept { return header_.camera; }
  const geometry::Pose& X_WC() const noexcept { return header_.X_WC; }
  /// Rows from the top, pixels from the left.
  std::span<const float> depth_m() const noexcept { return depth_m_; }
  float depth_m(int u, int v) const noexcept {
    return depth_m_[static_cast<std::size_t>(v) * static_cast<std::size_t>(header_.camera.width_px) +
                    static_cast<std::size_t>(u)];
  }
  std::size_t valid_pixels() const noexcept { return valid_pixels_; }

  /// Takes an image whose pixels are millimetres; 0 is "not measured". Depths out of the camera's range are
  /// not measured either. Refuses a bad header or another number of pixels than the camera's, and then keeps
  /// the former image. Allocates only for more pixels than it held before.
  core::Status load_mm(const DepthHeader& header, std::span<const std::uint16_t> depth_mm);
  /// The same for metres. NaN, infinite, negative and zero depths are not measured.
  core::Status load_m(const DepthHeader& header, std::span<const float> depth_m);

 private:
  template <class Pixel>
  core::Status load(const DepthHeader& header, std::span<const Pixel> pixels, float unit_m);

  DepthHeader header_;
  std::vector<float> depth_m_;
  std::size_t valid_pixels_ = 0;
};

}  // namespace phantom::fusion
