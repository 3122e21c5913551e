#pragma once

#include <filesystem>

#include "components/synthetic_viewer/output/output_config.hpp"
#include "components/synthetic_viewer/page/page_config.hpp"
#include "components/synthetic_viewer/scene/scene_config.hpp"

namespace phantom::synthetic_viewer {

/// A window on this host's desktop, beside the page.
struct WindowConfig {
  bool wanted = false;  ///< also set by --window
};

/// The checked content of synthetic_viewer.yaml.
struct ViewerConfig : SceneConfig, OutputConfig {
  double frame_rate_hz = 10.0;
  int niceness = 10;  ///< of the rendering threads
  PageConfig page;
  WindowConfig window;
  double pictures_Hz = 0.0;   ///< of each view at most, on the topic; 0: none
  int report_pictures = 200;  ///< greatest number of hit pictures in the report
};

extern const char* const kParameters;  ///< the shipped synthetic_viewer.yaml, which defines the parameters

/// Reads and checks a configuration. Throws core::ConfigError with file, line, key, value and what is
/// allowed. `page_secrets`: stands for page.secrets where that is empty; may be empty itself.
ViewerConfig load_config(const std::filesystem::path& path, const std::filesystem::path& page_secrets = {});

}  // namespace phantom::synthetic_viewer
