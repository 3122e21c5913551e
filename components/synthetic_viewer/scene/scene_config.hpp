#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/core/units.hpp"
#include "common/runtime/cell/other_arms.hpp"
#include "components/synthetic_viewer/render/renderer.hpp"
#include "components/synthetic_viewer/scene/aids.hpp"
#include "components/synthetic_viewer/scene/camera_view.hpp"
#include "components/synthetic_viewer/state/state.hpp"
#include "components/synthetic_viewer/state/synthetic_viewer.hpp"

namespace phantom::synthetic_viewer {

struct MainViewConfig {
  PictureFormat format{1280, 720, 1, true};
  /// Azimuth of the camera, seen from the middle of the workspace.
  double azimuth_rad = -50 * core::kRadPerDegree;
  double elevation_rad = 26 * core::kRadPerDegree;
  double field_of_view_rad = 34 * core::kRadPerDegree;  ///< vertical
  double margin = 0.8;  ///< 1: the workspace's corners touch the edge of the picture
};

struct HitZoneViewConfig {
  PictureFormat format{640, 360, 1, true};
  HitViewConfig rule;
  double field_of_view_rad = 42 * core::kRadPerDegree;
};

/// The camera on the arm's last link.
struct ToolViewConfig {
  bool enabled = true;
  PictureFormat format{640, 360, 1, true};
  Eigen::Vector3d eye_m{0.16, 0.0, 0.06};      ///< in the tip link's frame
  Eigen::Vector3d look_at_m{0.0, 0.0, -0.12};  ///< also in the tip link's frame
  double field_of_view_rad = 60 * core::kRadPerDegree;
};

/// The view of a real camera, with the model over it.
struct CameraViewConfig {
  std::optional<VideoCamera> camera;  ///< calibrated; none: there is no such view
  PictureFormat format{1280, 720, 1, false};
  VideoStaleness staleness;
  std::optional<View> inset = View::kHit;  ///< what stands in the picture's upper right; none: nothing
};

/// What is drawn in the views, and in which language; part of synthetic_viewer.yaml.
struct SceneConfig {
  Language language = Language::kEnglish;  ///< of what is written into pictures and window
  MainViewConfig main_view;
  HitZoneViewConfig hit_view;
  ToolViewConfig tool_view;
  CameraViewConfig camera_view;
  PgvArrow pgv_arrow;
  Staleness staleness;
  GraphicsPlatform graphics = GraphicsPlatform::kAuto;
  int report_samples = 4;                           ///< samples per pixel in the report's pictures
  std::string arm;                                  ///< arm of the cell; empty: the only one
  std::vector<runtime::OtherArmConfig> other_arms;  ///< drawn as they move; at most runtime::kMaxOtherArms
};

}  // namespace phantom::synthetic_viewer
