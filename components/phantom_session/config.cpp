#include "components/phantom_session/config.hpp"

#include "common/runtime/configuration/fields.hpp"

namespace phantom::phantom_session {

Config load_config(const std::filesystem::path& path) {
  const runtime::Fields file(path, {kParameters});
  Config config;
  file.number("ready_timeout_s", config.ready_timeout_s);
  file.number("stop_grace_s", config.stop_grace_s);
  file.number("onset_threshold_Nm", config.onset_threshold_Nm);
  file.number("row_interval_s", config.row_interval_s);
  if (!file.text("page_secrets").empty()) config.page_secrets = file.path("page_secrets");
  file.finish();
  return config;
}

}  // namespace phantom::phantom_session
