#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "components/simulated_drive/force_sensor.hpp"
#include "components/simulated_drive/simulated_drive.hpp"

namespace phantom::simulated_drive {

/// Parameters of simulated_drive.yaml.
struct Config {
  std::string bus;
  double bit_rate = 1e6;  ///< of a userspace bus
  std::vector<DriveOptions> drives;
  std::optional<ForceSensorOptions> force_sensor;
};

extern const char* const kParameters;  ///< the shipped simulated_drive.yaml as table of the parameters

/// Reads and checks the file. Throws ConfigError naming file, line, key, value and what is allowed.
Config load_config(const std::filesystem::path& file);

}  // namespace phantom::simulated_drive
