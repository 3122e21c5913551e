#pragma once

#include <filesystem>

namespace phantom::phantom_session {

/// The checked values of phantom_session.yaml.
struct Config {
  double ready_timeout_s = 120.0;
  double stop_grace_s = 5.0;
  double onset_threshold_Nm = 0.02;
  double row_interval_s = 0.01;
  std::filesystem::path page_secrets;  ///< folder of the operator's page's secrets; empty: none are made
};

extern const char* const kParameters;  ///< the parameter table: the shipped phantom_session.yaml

/// Throws ConfigError.
Config load_config(const std::filesystem::path& path);

}  // namespace phantom::phantom_session
