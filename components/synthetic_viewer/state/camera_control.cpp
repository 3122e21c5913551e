#include "components/synthetic_viewer/state/camera_control.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/units.hpp"
#include "common/percept/view_node.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr std::array<const char*, kViews.size()> kNames{"main", "hit", "tool", "camera"};
constexpr double kSteepest_rad = 89.0 * core::kRadPerDegree;

}  // namespace

const char* name_of(View view) noexcept { return kNames[static_cast<std::size_t>(view)]; }

std::optional<View> view_from_name(const std::string& name) noexcept {
  for (const View view : kViews) {
    if (name == name_of(view)) return view;
  }
  return std::nullopt;
}

void CameraControl::take(const ViewRequest& request) noexcept {
  if (request.view == View::kCamera) return;
  if (request.home) home(request.view);
  Offset& offset = offsets_[static_cast<std::size_t>(request.view)];
  offset.azimuth_rad = std::remainder(offset.azimuth_rad + request.azimuth_rad, 2 * std::numbers::pi);
  offset.elevation_rad =
      std::clamp(offset.elevation_rad + request.elevation_rad, -2 * kSteepest_rad, 2 * kSteepest_rad);
  offset.zoom = std::clamp(offset.zoom * request.zoom, kMinZoom, kMaxZoom);
}

Camera CameraControl::moved(const Camera& camera, View view) const {
  const Offset& by = offset(view);
  if (by.at_home()) return camera;
  const Eigen::Vector3d away = camera.eye_m - camera.target_m;
  const double distance_m = away.norm();
  const double azimuth_rad = std::atan2(away.y(), away.x()) + by.azimuth_rad;
  const double elevation_rad =
      std::clamp(std::asin(std::clamp(away.z() / distance_m, -1.0, 1.0)) + by.elevation_rad, -kSteepest_rad,
                 kSteepest_rad);
  Camera result = camera;
  result.eye_m = camera.target_m + distance_m * by.zoom * percept::direction_at(azimuth_rad, elevation_rad);
  result.near_m = std::min(camera.near_m, 0.1 * distance_m * by.zoom);
  result.far_m = camera.far_m + distance_m * std::max(0.0, by.zoom - 1);
  return result;
}

UnobstructedCamera unobstructed(const Camera& camera, const RayScene& bodies) {
  UnobstructedCamera result{camera, std::nullopt, 0.0, 0.0};
  const Eigen::Vector3d away = camera.eye_m - camera.target_m;
  result.wanted_m = result.distance_m = away.norm();
  const auto free =
      bodies.free_distance(camera.target_m, away / result.wanted_m, result.wanted_m, camera.clearance_m);
  if (!free) return result;
  result.blocked_by = free->blocked_by;
  result.distance_m = free->distance_m;
  result.camera.eye_m = camera.target_m + away * (free->distance_m / result.wanted_m);
  result.camera.near_m = std::min(camera.near_m, 0.5 * camera.clearance_m);
  return result;
}

ViewRequest drag_request(View view, double dx_px, double dy_px, double height_px) {
  const double rad_per_px = std::numbers::pi / std::max(1.0, height_px);
  ViewRequest request;
  request.view = view;
  // The scene follows the pointer, so the camera turns the opposite way around it.
  request.azimuth_rad = -dx_px * rad_per_px;
  request.elevation_rad = dy_px * rad_per_px;
  return request;
}

ViewRequest wheel_request(View view, double notches) {
  ViewRequest request;
  request.view = view;
  request.zoom = std::clamp(std::pow(0.9, notches), 0.1, 10.0);
  return request;
}

std::optional<percept::ViewNode> node_of_key(char key) {
  if (key == 'A') return percept::ViewNode::kAutomatic;
  return percept::node_from_name({&key, 1});
}

cv::Rect2d place_in_window(View view, double width, double height, double aspect) {
  const double whole_width = std::min(width, height * aspect), whole_height = whole_width / aspect;
  const cv::Rect2d whole{(width - whole_width) / 2, (height - whole_height) / 2, whole_width, whole_height};
  if (view == View::kMain) return whole;
  const double share = 1.0 / 3, margin = 0.015 * whole_height;
  cv::Rect2d place{0, 0, share * whole_width, share * whole_height};
  place.x = view == View::kCamera ? whole.x + margin : whole.x + whole.width - place.width - margin;
  // The strip of gauges at the lower edge stays free.
  place.y = view == View::kHit ? whole.y + margin : whole.y + 0.9 * whole.height - place.height - margin;
  return place;
}

}  // namespace phantom::synthetic_viewer
