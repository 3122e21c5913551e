#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/units.hpp"
#include "common/runtime/other_arms.hpp"
#include "common/runtime/role_secrets.hpp"
#include "components/synthetic_viewer/aids.hpp"
#include "components/synthetic_viewer/camera_view.hpp"
#include "components/synthetic_viewer/recorder.hpp"
#include "components/synthetic_viewer/renderer.hpp"
#include "components/synthetic_viewer/state.hpp"
#include "components/synthetic_viewer/synthetic_viewer.hpp"

namespace phantom::synthetic_viewer {

class TlsContext;

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

struct PageConfig {
  bool enabled = true;
  std::string address = "127.0.0.1";
  int port = 8080;      ///< 0: any free port
  int stream_port = 0;  ///< port of pictures and events; 0: any free port
  /// Further host names and addresses under which the page may be asked for.
  std::vector<std::string> host_names;
  std::optional<runtime::RoleSecrets> secrets;  ///< none: everybody may watch and command
  std::shared_ptr<const TlsContext> tls;        ///< none: HTTP without encryption
  bool allow_commands = true;                   ///< whether the page may send commands
  bool headset_hand = false;                    ///< whether a headset's controller may lead the arm
  double hand_silent_s = 0.1;                   ///< so long without its pose, and it does not any more
  double scene_Hz = 60.0;                       ///< greatest rate of the scene stream's poses
  int max_streams = 24;      ///< number of streams (pictures and events) at once, all pages together
  int max_connections = 64;  ///< on each port, whose request has not come yet
  int max_connections_per_address = 32;  ///< of these, from one address
};

/// A window on this host's desktop, beside the page.
struct WindowConfig {
  bool wanted = false;  ///< also set by --window
};

/// The checked content of synthetic_viewer.yaml.
struct ViewerConfig {
  GraphicsPlatform graphics = GraphicsPlatform::kAuto;
  Language language = Language::kEnglish;  ///< of what is written into pictures and window
  double frame_rate_hz = 10.0;
  int niceness = 10;  ///< of the rendering threads
  MainViewConfig main_view;
  HitZoneViewConfig hit_view;
  ToolViewConfig tool_view;
  CameraViewConfig camera_view;
  PgvArrow pgv_arrow;
  Staleness staleness;
  PageConfig page;
  WindowConfig window;
  RecordingConfig recording;
  int jpeg_quality = 80;
  double pictures_Hz = 0.0;                         ///< of each view at most, on the topic; 0: none
  int report_samples = 4;                           ///< samples per pixel in the report's pictures
  int report_pictures = 200;                        ///< greatest number of hit pictures in the report
  std::string arm;                                  ///< arm of the cell; empty: the only one
  std::vector<runtime::OtherArmConfig> other_arms;  ///< drawn as they move; at most runtime::kMostOtherArms
};

extern const char* const kParameters;  ///< the shipped synthetic_viewer.yaml, which defines the parameters

/// Reads and checks a configuration. Throws core::ConfigError with file, line, key, value and what is
/// allowed. `page_secrets`: stands for page.secrets where that is empty; may be empty itself.
ViewerConfig load_config(const std::filesystem::path& path, const std::filesystem::path& page_secrets = {});

}  // namespace phantom::synthetic_viewer
