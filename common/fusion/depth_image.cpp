#include "common/fusion/depth_image.hpp"

#include <cmath>
#include <string>

#include "common/core/text.hpp"

namespace phantom::fusion {
namespace {

using core::formatted;
using core::Status;

/// Returns OK for low ≤ value ≤ high; NaN is refused.
Status within(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return Status::ok();
  return Status::invalid_argument(
      formatted("depth camera: %s is %g; allowed: %g to %g", name, value, low, high));
}

constexpr double kMinFocalLength_px = 10.0, kMaxFocalLength_px = 1e5;

}  // namespace

Status check_camera(const PinholeCamera& camera) {
  for (const auto& [name, edge] :
       {std::pair{"width_px", camera.width_px}, std::pair{"height_px", camera.height_px}}) {
    if (Status checked = within(name, edge, 1, kMaxImageEdge_px); !checked) return checked;
  }
  if (camera.pixels() > kMaxImagePixels)
    return Status::invalid_argument(formatted("depth camera: %d x %d pixels; allowed: %zu in all",
                                              camera.width_px, camera.height_px, kMaxImagePixels));
  struct Range {
    const char* name;
    double value, low, high;
  };
  const Range ranges[] = {{"fx_px", camera.fx_px, kMinFocalLength_px, kMaxFocalLength_px},
                          {"fy_px", camera.fy_px, kMinFocalLength_px, kMaxFocalLength_px},
                          {"cx_px", camera.cx_px, -0.5, camera.width_px - 0.5},
                          {"cy_px", camera.cy_px, -0.5, camera.height_px - 0.5},
                          {"min_depth_m", camera.min_depth_m, 0.01, kMaxDepth_m},
                          {"max_depth_m", camera.max_depth_m, camera.min_depth_m, kMaxDepth_m}};
  for (const Range& range : ranges) {
    if (Status checked = within(range.name, range.value, range.low, range.high); !checked) return checked;
  }
  return Status::ok();
}

Status check_header(const DepthHeader& header) {
  if (Status checked = check_camera(header.camera); !checked) return checked;
  const Eigen::Matrix3d& R = header.X_WC.rotation;
  const double off = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const double determinant = R.row(0).cross(R.row(1)).dot(R.row(2));
  if (!R.allFinite() || !(off <= 1e-4) || !(determinant > 0.0))
    return Status::invalid_argument(formatted(
        "depth image: the pose's rotation is %g off; allowed: a right-handed rotation to 1e-4", off));
  static constexpr const char* kAxes[] = {"pose x_m", "pose y_m", "pose z_m"};
  for (int axis = 0; axis < 3; ++axis) {
    if (Status checked =
            within(kAxes[axis], header.X_WC.translation_m[axis], -kMaxCameraDistance_m, kMaxCameraDistance_m);
        !checked)
      return checked;
  }
  return within("time_s", header.time_s, 0.0, 1e12);
}

template <class Pixel>
Status DepthImage::load(const DepthHeader& header, std::span<const Pixel> pixels, float unit_m) {
  if (Status checked = check_header(header); !checked) return checked;
  if (pixels.size() != header.camera.pixels())
    return Status::invalid_argument(formatted("depth image: %zu pixels; allowed: %d x %d", pixels.size(),
                                              header.camera.width_px, header.camera.height_px));
  header_ = header;
  depth_m_.resize(pixels.size());
  const auto low = static_cast<float>(header.camera.min_depth_m),
             high = static_cast<float>(header.camera.max_depth_m);
  std::uint32_t valid = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const float depth = unit_m * static_cast<float>(pixels[i]);
    const bool measured = depth >= low && depth <= high;  // false for NaN
    depth_m_[i] = measured ? depth : 0.0F;
    valid += measured ? 1 : 0;
  }
  valid_pixels_ = valid;
  return Status::ok();
}

Status DepthImage::load_mm(const DepthHeader& header, std::span<const std::uint16_t> depth_mm) {
  return load(header, depth_mm, 0.001F);
}

Status DepthImage::load_m(const DepthHeader& header, std::span<const float> depth_m) {
  return load(header, depth_m, 1.0F);
}

}  // namespace phantom::fusion
