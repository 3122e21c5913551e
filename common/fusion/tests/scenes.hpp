#pragma once

// Scenes and a simulated camera for tests and benchmarks.

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "common/fusion/depth_noise.hpp"
#include "common/fusion/fusion_parameters.hpp"
#include "common/geometry/implicit/primitives.hpp"

namespace phantom::fusion::scenes {

/// Returns the pose of a camera that looks at a point, with its picture upright.
inline geometry::Pose looking_at(const Eigen::Vector3d& eye_W_m, const Eigen::Vector3d& target_W_m) {
  geometry::Pose X_WC{{}, eye_W_m};
  const Eigen::Vector3d z = (target_W_m - eye_W_m).normalized(),
                        x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  X_WC.rotation << x, z.cross(x), z;
  return X_WC;
}

/// A camera of 640 × 480 pixels divided by `divisor`, 59° wide.
inline PinholeCamera depth_camera(int divisor = 1) {
  const int width = 640 / divisor, height = 480 / divisor;
  return {width, height, 565.0 / divisor, 565.0 / divisor, 0.5 * (width - 1), 0.5 * (height - 1), 0.3, 6.0};
}

inline CameraScene::Object placed(const geometry::TriangleMesh& mesh, const Eigen::Vector3d& at_W_m,
                                  bool specular = false) {
  return {mesh.transformed({Eigen::Matrix3d::Identity(), at_W_m}), specular};
}

/// The grid of the targets: 2 × 2 × 1.5 m.
inline workspace::GridSpec cell_grid(double voxel_m = 0.005) {
  const auto count = [voxel_m](double extent_m) {
    return static_cast<std::int32_t>(std::lround(extent_m / voxel_m));
  };
  return {{-1.0, -1.0, 0.0}, voxel_m, {count(2.0), count(2.0), count(1.5)}};
}

/// A cell: floor, back wall, table, a steel drum, a box, a ball and a rod of 10 mm.
inline std::vector<CameraScene::Object> cell_objects() {
  using geometry::make_box;
  return {placed(make_box({3.0, 3.0, 0.04}), {0.0, 0.0, 0.03}),
          placed(make_box({3.0, 0.04, 3.0}), {0.0, 0.9, 1.0}),
          placed(make_box({0.9, 0.7, 0.03}), {0.1, 0.1, 0.5}),
          placed(geometry::make_cylinder(0.15, 0.4), {-0.55, 0.2, 0.25}, true),
          placed(make_box({0.2, 0.15, 0.12}), {0.3, 0.05, 0.575}),
          placed(geometry::make_sphere(0.08), {-0.1, 0.1, 0.595}),
          placed(geometry::make_cylinder(0.005, 0.4), {0.0, -0.1, 0.715})};
}
inline geometry::Pose cell_camera() { return looking_at({0.1, -1.1, 1.3}, {0.0, 0.1, 0.5}); }

/// A camera in one place that measures one scene.
class Simulated {
 public:
  Simulated(const std::vector<CameraScene::Object>& objects, const PinholeCamera& camera,
            const geometry::Pose& X_WC, const DepthNoise& noise = {}, std::uint64_t seed = 1)
      : header_{camera, X_WC, 0.0}, noise_(noise), seed_(seed), scene_(objects), pixels_(camera.pixels()) {
    scene_.render(camera, X_WC, seen_);
  }

  const CameraScene& scene() const { return scene_; }
  const std::vector<SeenPixel>& seen() const { return seen_; }
  const DepthHeader& header() const { return header_; }
  /// Returns a frame with errors; valid until the next call.
  const DepthImage& frame(std::uint64_t number) {
    measure_depth(header_.camera, seen_, noise_, seed_, number, pixels_);
    header_.time_s = static_cast<double>(number) / 30.0;
    if (!image_.load_mm(header_, pixels_)) std::abort();
    return image_;
  }
  /// Returns a frame without errors.
  const DepthImage& exact() {
    std::vector<float> depth_m;
    for (const SeenPixel& pixel : seen_) depth_m.push_back(pixel.depth_m);
    if (!image_.load_m(header_, depth_m)) std::abort();
    return image_;
  }

 private:
  DepthHeader header_;
  DepthNoise noise_;
  std::uint64_t seed_;
  CameraScene scene_;
  std::vector<SeenPixel> seen_;
  std::vector<std::uint16_t> pixels_;
  DepthImage image_;
};

}  // namespace phantom::fusion::scenes
