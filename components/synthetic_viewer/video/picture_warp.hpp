#pragma once

#include "common/camera/lens.hpp"
#include "common/geometry/pose.hpp"
#include "components/synthetic_viewer/render/camera.hpp"
#include "components/synthetic_viewer/render/image.hpp"

namespace phantom::synthetic_viewer {

/// Turns pictures of one lens into what another one would image from the same place. Constant once made.
class PictureWarp {
 public:
  PictureWarp(const camera::LensModel& from, const camera::LensModel& to);
  /// Returns the picture as the lens `to` would image it; dark where `from` sees nothing.
  Image warped(const Image& picture) const;

 private:
  cv::Mat columns_, rows_;  // of each pixel, where it is taken from
};

/// Returns the drawing camera that images as a lens without distortion, with its principal point in the
/// middle, at X_WC.
Camera drawing_camera(const camera::Lens& straight, const geometry::Pose& X_WC);

}  // namespace phantom::synthetic_viewer
