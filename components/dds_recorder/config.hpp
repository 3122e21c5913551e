#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "components/dds_recorder/dds_recorder.hpp"

namespace phantom::dds_recorder {

/// The checked values of dds_recorder.yaml.
struct Config {
  RecorderSettings recorder;
  std::vector<std::string> topics;  ///< patterns; empty: all
  std::size_t queue_bytes = 64'000'000;
};

extern const char* const kParameters;  ///< the parameter table: the shipped dds_recorder.yaml

/// Reads and checks the parameters. Throws ConfigError (file, line, key, value, what is allowed).
Config load_config(const std::filesystem::path& file);

}  // namespace phantom::dds_recorder
