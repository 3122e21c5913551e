#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "components/synthetic_viewer/camera.hpp"
#include "components/synthetic_viewer/ray_scene.hpp"

namespace phantom::synthetic_viewer {

enum class View { kMain, kHit, kTool };
inline constexpr std::array<View, 3> kViews{View::kMain, View::kHit, View::kTool};
/// "main", "hit", "tool".
const char* name_of(View view) noexcept;
std::optional<View> view_from_name(const std::string& name) noexcept;

/// What the operator asks of a view, beside its node: from the page or the window.
struct ViewRequest {
  View view = View::kMain;
  double azimuth_rad =
      0.0;  ///< turn about the vertical through the looked-at point by this; from x towards y
  double elevation_rad = 0.0;  ///< and upwards by this
  double zoom = 1.0;           ///< multiply the distance by this; below 1: closer
  bool home = false;           ///< first back to where the view stands by itself
  std::optional<bool> record;  ///< begin or end recording this view
};

/// How the operator moved the cameras away from where they stand by themselves. A plain value; pure.
class CameraControl {
 public:
  struct Offset {
    double azimuth_rad = 0.0, elevation_rad = 0.0, zoom = 1.0;
    bool at_home() const noexcept { return azimuth_rad == 0.0 && elevation_rad == 0.0 && zoom == 1.0; }
  };
  static constexpr double kLeastZoom = 0.1, kMostZoom = 4.0;

  void take(const ViewRequest& request) noexcept;
  void home(View view) noexcept { offsets_[static_cast<std::size_t>(view)] = {}; }
  const Offset& offset(View view) const noexcept { return offsets_[static_cast<std::size_t>(view)]; }

  /// The camera of a view, moved. It never turns over the top: it stays below the zenith and above the nadir.
  Camera moved(const Camera& camera, View view) const;

 private:
  std::array<Offset, kViews.size()> offsets_{};
};

/// A camera that stands where it can see, and what there is to be said about that; empty: nothing.
struct SettledCamera {
  Camera camera;
  std::optional<RayScene::BodyName> blocked_by;  ///< the body in which it would have stood
  double wanted_m = 0.0, distance_m = 0.0;       ///< from the looked-at point
};

/// Moves a camera that stands inside a body, or too close to a surface to see past it, along its line of
/// sight to the nearest free distance. Where there is none it stays. Pure.
SettledCamera settled(const Camera& camera, const RayScene& bodies);

}  // namespace phantom::synthetic_viewer
