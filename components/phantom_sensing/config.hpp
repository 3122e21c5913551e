#pragma once

#include <filesystem>
#include <string>

#include "common/core/thread_place.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {

/// phantom_sensing.yaml, checked.
struct Config {
  std::filesystem::path file;
  std::string arm;  ///< empty: the cell's only arm
  robot::SkinOptions skin{.max_sensors = 100'000};
  PerceptSettings percept;
  double percept_rate_hz = 100.0;         ///< topic percept, at most the rate of slave_state
  double staleness_s = 0.1;               ///< slave_state older than this makes the percept invalid
  double workspace_behind_after_s = 1.0;  ///< a version announced and not whole for so long marks the percept
  double workspace_stale_after_s = 5.0;   ///< and for so long ends it
  int servo_priority = core::kServoPriority;  ///< SCHED_FIFO of the servos that this serves; 0: do not ask
};

extern const char* const kParameters;  ///< the shipped phantom_sensing.yaml: their table

/// Reads and checks the parameters. Throws ConfigError (file, line, key, value, what is allowed).
Config load_config(const std::filesystem::path& file);

}  // namespace phantom::phantom_sensing
