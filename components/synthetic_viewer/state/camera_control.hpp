#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>

#include "common/percept/view_node.hpp"
#include "components/synthetic_viewer/render/camera.hpp"
#include "components/synthetic_viewer/render/ray_scene.hpp"

namespace phantom::synthetic_viewer {

enum class View { kMain, kHit, kTool, kCamera };
inline constexpr std::array<View, 4> kViews{View::kMain, View::kHit, View::kTool, View::kCamera};
/// Returns "main", "hit", "tool" or "camera".
const char* name_of(View view) noexcept;
std::optional<View> view_from_name(const std::string& name) noexcept;

/// The operator's request for a view, other than for its node: from the page or the window.
struct ViewRequest {
  View view = View::kMain;
  /// Angle by which to turn about the vertical through the looked-at point, from x towards y.
  double azimuth_rad = 0.0;
  double elevation_rad = 0.0;    ///< angle by which to turn upwards
  double zoom = 1.0;             ///< factor for the distance; below 1: closer
  bool home = false;             ///< first return to the default camera
  std::optional<bool> record;    ///< start or end recording this view
  std::optional<bool> approach;  ///< show the way from the tool to the nearest object, or no more
};

/// The operator's offsets of the cameras from their default positions. A plain value; pure.
class CameraControl {
 public:
  struct Offset {
    double azimuth_rad = 0.0, elevation_rad = 0.0, zoom = 1.0;
    bool at_home() const noexcept { return azimuth_rad == 0.0 && elevation_rad == 0.0 && zoom == 1.0; }
  };
  static constexpr double kMinZoom = 0.1, kMaxZoom = 4.0;

  /// A real camera's view stands where that camera stands: requests to move it are ignored.
  void take(const ViewRequest& request) noexcept;
  void home(View view) noexcept { offsets_[static_cast<std::size_t>(view)] = {}; }
  const Offset& offset(View view) const noexcept { return offsets_[static_cast<std::size_t>(view)]; }

  /// Returns the camera of a view with its offset. It never turns over the top: it stays below the zenith and
  /// above the nadir.
  Camera moved(const Camera& camera, View view) const;

 private:
  std::array<Offset, kViews.size()> offsets_{};
};

/// A camera position with a free view, and what blocked the wanted one.
struct UnobstructedCamera {
  Camera camera;
  std::optional<RayScene::BodyName> blocked_by;  ///< the body at the wanted position; none if that was free
  double wanted_m = 0.0, distance_m = 0.0;       ///< distances from the looked-at point
};

/// Moves a camera that is inside a body, or too close to a surface to see past it, along its line of sight to
/// the nearest free distance. If there is none, the camera stays. Pure.
UnobstructedCamera unobstructed(const Camera& camera, const RayScene& bodies);

/// Returns the request for a pointer drag: a drag over the picture's whole height turns the view by half a
/// turn.
ViewRequest drag_request(View view, double dx_px, double dy_px, double height_px);
/// Returns the request for turning the wheel. Positive notches, away from the user, bring the view closer.
ViewRequest wheel_request(View view, double notches);
/// Returns the look-from node for a key: 'N' 'S' 'E' 'W' 'T' 'B', '1' to '8', 'A' automatic. Upper case.
std::optional<percept::ViewNode> node_of_key(char key);

/// Returns the rectangle of a view in a window, in the window's coordinates (y down). The main view fills the
/// window as far as its shape (width ÷ height) allows; the others overlap its right edge, a third as wide.
cv::Rect2d place_in_window(View view, double width, double height, double aspect);

}  // namespace phantom::synthetic_viewer
