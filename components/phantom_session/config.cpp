#include "components/phantom_session/config.hpp"

#include "common/runtime/config_reader.hpp"

namespace phantom::phantom_session {

Config load_config(const std::filesystem::path& path) {
  const auto file = runtime::ConfigReader::from_file(path);
  Config config;
  config.ready_timeout_s = file.number("ready_timeout_s", config.ready_timeout_s, {1, 3600, "s"});
  config.stop_grace_s = file.number("stop_grace_s", config.stop_grace_s, {0.1, 60, "s"});
  config.onset_threshold_Nm =
      file.number("onset_threshold_Nm", config.onset_threshold_Nm, {1e-6, 100, "N·m"});
  config.row_interval_s = file.number("row_interval_s", config.row_interval_s, {0.001, 10, "s"});
  file.finish();
  return config;
}

}  // namespace phantom::phantom_session
