#include "components/dds_spy/config.hpp"

#include "common/runtime/configuration/fields.hpp"

namespace phantom::dds_spy {

Config load_config(const std::filesystem::path& path) {
  const runtime::Fields file(path, {kParameters});
  Config config;
  file.number("discovery_s", config.discovery_s);
  file.number("measure_s", config.measure_s);
  file.number("refresh_s", config.refresh_s);
  file.number("quiet_s", config.quiet_s);
  file.number("most_events", config.most_events);
  file.finish();
  return config;
}

}  // namespace phantom::dds_spy
