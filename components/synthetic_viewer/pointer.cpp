#include "components/synthetic_viewer/pointer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace phantom::synthetic_viewer {

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

std::optional<ViewNode> node_of_key(char key) {
  if (key == 'A') return ViewNode::kAutomatic;
  return percept::node_from_name({&key, 1});
}

WindowPlace place_in_window(View view, double width, double height, double aspect) {
  const double whole_width = std::min(width, height * aspect), whole_height = whole_width / aspect;
  const WindowPlace whole{(width - whole_width) / 2, (height - whole_height) / 2, whole_width, whole_height};
  if (view == View::kMain) return whole;
  const double share = 1.0 / 3, margin = 0.015 * whole_height;
  WindowPlace place{0, 0, share * whole_width, share * whole_height};
  place.x = whole.x + whole.width - place.width - margin;
  // The strip of gauges at the lower edge stays free.
  place.y = view == View::kHit ? whole.y + margin : whole.y + 0.9 * whole.height - place.height - margin;
  return place;
}

}  // namespace phantom::synthetic_viewer
