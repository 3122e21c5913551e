#include "components/synthetic_viewer/video/picture_warp.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace phantom::synthetic_viewer {

PictureWarp::PictureWarp(const camera::LensModel& from, const camera::LensModel& to) {
  const camera::Lens& made = to.lens();
  cv::Mat places(made.height_px, made.width_px, CV_32FC2);
  for (int v = 0; v < made.height_px; ++v)
    for (int u = 0; u < made.width_px; ++u) {
      const auto direction = to.direction({u, v});
      const auto pixel = direction ? from.project(direction->homogeneous()) : std::nullopt;
      places.at<cv::Point2f>(v, u) =
          pixel ? cv::Point2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()))
                : cv::Point2f(-1e4F, -1e4F);
    }
  cv::convertMaps(places, cv::noArray(), columns_, rows_, CV_16SC2);
}

Image PictureWarp::warped(const Image& picture) const {
  Image made;
  cv::remap(picture, made, columns_, rows_, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(14, 12, 10));
  return made;
}

Camera drawing_camera(const camera::Lens& straight, const geometry::Pose& X_WC) {
  Camera camera;
  camera.eye_m = X_WC.translation_m;
  camera.target_m = X_WC.translation_m + X_WC.rotation.col(2);
  camera.up = -X_WC.rotation.col(1);
  camera.vertical_fov_rad = 2 * std::atan(straight.height_px / (2 * straight.fy_px));
  camera.near_m = 0.05;
  camera.far_m = 30.0;
  return camera;
}

}  // namespace phantom::synthetic_viewer
