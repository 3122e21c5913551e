#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "common/core/units.hpp"
#include "components/synthetic_viewer/recorder.hpp"
#include "components/synthetic_viewer/renderer.hpp"
#include "components/synthetic_viewer/state.hpp"
#include "components/synthetic_viewer/synthetic_viewer.hpp"

namespace phantom::synthetic_viewer {

struct MainViewConfig {
  PictureFormat format{1280, 720, 1, true};
  double azimuth_rad = -50 * core::kRadPerDegree;  ///< of the camera, seen from the workspace's middle
  double elevation_rad = 26 * core::kRadPerDegree;
  double field_of_view_rad = 34 * core::kRadPerDegree;  ///< vertical
  double margin = 0.8;  ///< 1: the workspace's corners touch the picture's border
};

struct HitZoneViewConfig {
  PictureFormat format{640, 360, 1, true};
  HitViewConfig rule;
  double field_of_view_rad = 42 * core::kRadPerDegree;
};

/// Camera on the arm's last link.
struct ToolViewConfig {
  bool enabled = true;
  PictureFormat format{640, 360, 1, true};
  Eigen::Vector3d eye_m{0.16, 0.0, 0.06};      ///< in the tip link's frame
  Eigen::Vector3d look_at_m{0.0, 0.0, -0.12};  ///< likewise
  double field_of_view_rad = 60 * core::kRadPerDegree;
};

struct PageConfig {
  bool enabled = true;
  std::string address = "127.0.0.1";
  int port = 8080;             ///< 0: any free one
  int stream_port = 0;         ///< of pictures and events; 0: any free one
  bool allow_commands = true;  ///< whether the page may command the system
  int max_streams = 24;        ///< pictures and events that may be followed at once, all pages together
};

/// A window on this host's desktop, beside the page.
struct WindowConfig {
  bool wanted = false;  ///< also by --window
};

/// synthetic_viewer.yaml.
struct ViewerConfig {
  GraphicsPlatform graphics = GraphicsPlatform::kAuto;
  double frame_rate_hz = 10.0;
  int niceness = 10;  ///< of the rendering threads
  MainViewConfig main_view;
  HitZoneViewConfig hit_view;
  ToolViewConfig tool_view;
  Staleness staleness;
  PageConfig page;
  WindowConfig window;
  RecordingConfig recording;
  int jpeg_quality = 80;
  int report_samples = 4;     ///< per pixel, in the pictures of the report
  int report_pictures = 200;  ///< hit pictures at most
  std::string arm;            ///< of the cell; empty: the only one
};

extern const char* const kParameters;  ///< the shipped synthetic_viewer.yaml: their table

/// Reads and checks a configuration. Throws core::ConfigError (file, line, key, value, what is allowed).
ViewerConfig load_config(const std::filesystem::path& path);

}  // namespace phantom::synthetic_viewer
