#include "components/synthetic_viewer/render/camera.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/percept/view_node.hpp"

namespace phantom::synthetic_viewer {

double scene_scale(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m) noexcept {
  constexpr double kUsual_m = 1.5;
  return std::min(1.0, (max_m - min_m).norm() / kUsual_m);
}

Camera at_scale(Camera camera, double scale) noexcept {
  camera.near_m *= scale;
  camera.far_m *= scale;
  camera.clearance_m *= scale;
  return camera;
}

Eigen::Matrix4d view_matrix(const Camera& camera) {
  const Eigen::Vector3d backward = (camera.eye_m - camera.target_m).normalized();
  Eigen::Matrix3d rows = percept::view_axes(backward);
  if (!camera.up.isZero()) {
    const Eigen::Vector3d right = camera.up.cross(backward).normalized();
    rows << right.transpose(), backward.cross(right).transpose(), backward.transpose();
  }
  Eigen::Matrix4d view = Eigen::Matrix4d::Identity();
  view.topLeftCorner<3, 3>() = rows;
  view.topRightCorner<3, 1>() = -(rows * camera.eye_m);
  return view;
}

Eigen::Matrix4d projection_matrix(const Camera& camera, double aspect) {
  const double scale = 1.0 / std::tan(camera.vertical_fov_rad / 2);
  const double depth = camera.near_m - camera.far_m;
  Eigen::Matrix4d projection = Eigen::Matrix4d::Zero();
  projection(0, 0) = scale / aspect;
  projection(1, 1) = scale;
  projection(2, 2) = (camera.far_m + camera.near_m) / depth;
  projection(2, 3) = 2 * camera.far_m * camera.near_m / depth;
  projection(3, 2) = -1;
  return projection;
}

Eigen::Vector3d corner_of(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m, int number) {
  return {(number & 1 ? max_m : min_m).x(), (number & 2 ? max_m : min_m).y(),
          (number & 4 ? max_m : min_m).z()};
}

Camera frame_box(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m, double azimuth_rad,
                 double elevation_rad, double vertical_fov_rad, double aspect, double margin) {
  Camera camera;
  camera.vertical_fov_rad = vertical_fov_rad;
  camera.target_m = (min_m + max_m) / 2;
  const Eigen::Vector3d away = percept::direction_at(azimuth_rad, elevation_rad);
  const Eigen::Matrix3d rows = percept::view_axes(away);
  const double tan_y = std::tan(vertical_fov_rad / 2) / margin, tan_x = tan_y * aspect;
  double distance_m = 0, reach_m = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d c =  // c.z: towards the camera
        rows * (corner_of(min_m, max_m, corner) - camera.target_m);
    distance_m = std::max({distance_m, c.z() + std::abs(c.x()) / tan_x, c.z() + std::abs(c.y()) / tan_y});
    reach_m = std::max(reach_m, c.norm());
  }
  camera.eye_m = camera.target_m + distance_m * away;
  camera.near_m = std::max(0.002 * distance_m, 0.2 * (distance_m - reach_m));
  camera.far_m = distance_m + 6 * reach_m;
  return camera;
}

}  // namespace phantom::synthetic_viewer
