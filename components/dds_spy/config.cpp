#include "components/dds_spy/config.hpp"

#include "common/runtime/config_reader.hpp"

namespace phantom::dds_spy {

Config load_config(const std::filesystem::path& path) {
  const auto file = runtime::ConfigReader::from_file(path);
  Config config;
  config.discovery_s = file.number("discovery_s", config.discovery_s, {0.1, 600, "s"});
  config.measure_s = file.number("measure_s", config.measure_s, {0.1, 1e6, "s"});
  config.refresh_s = file.number("refresh_s", config.refresh_s, {0.1, 60, "s"});
  config.quiet_s = file.number("quiet_s", config.quiet_s, {0, 3600, "s"});
  config.most_events = static_cast<std::size_t>(file.integer("most_events", 1000, {1, 1'000'000, "events"}));
  file.finish();
  return config;
}

}  // namespace phantom::dds_spy
