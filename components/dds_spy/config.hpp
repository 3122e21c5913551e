#pragma once

#include <cstddef>
#include <filesystem>

namespace phantom::dds_spy {

/// The values of dds_spy.yaml.
struct Config {
  double discovery_s = 2.0;
  double measure_s = 5.0;
  double refresh_s = 1.0;
  double quiet_s = 1.0;
  std::size_t most_events = 1000;
};

extern const char* const kParameters;  ///< the parameter table: the shipped dds_spy.yaml

/// Reads and checks a configuration. Throws runtime::ConfigError (file, line, key, value, what is allowed).
Config load_config(const std::filesystem::path& path);

}  // namespace phantom::dds_spy
