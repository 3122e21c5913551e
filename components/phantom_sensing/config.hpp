#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/thread_config.hpp"
#include "common/runtime/cell/other_arms.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {

/// Links whose skin another process senses.
struct ShareConfig {
  std::string name;
  std::vector<std::string> links;  ///< of the arm's URDF or DH table
  std::filesystem::path cell;      ///< in whose voxels that process senses; empty: in the arm's
  std::string partition;           ///< DDS partition in which a wva_server sends those; empty: no such cell
};

using runtime::kMaxOtherArms, runtime::OtherArmConfig;

/// The checked content of phantom_sensing.yaml.
struct Config {
  std::filesystem::path file;
  std::string arm;  ///< empty: the cell's only arm
  robot::SkinOptions skin{.max_sensors = 100'000};
  PerceptSettings percept;
  double percept_rate_hz = 100.0;         ///< rate of the topic percept; at most that of slave_state
  double staleness_s = 0.1;               ///< slave_state older than this makes the percept invalid
  double workspace_behind_after_s = 1.0;  ///< an announced version incomplete for this long marks the percept
  double workspace_stale_after_s = 5.0;   ///< and for this long ends it
  double max_view_age_s = 3.0;  ///< space that depth cameras saw longer ago is unseen; 0: that is not said
  std::uint64_t workspace_max_bytes = 0;   ///< of one server's workspace
  std::vector<OtherArmConfig> other_arms;  ///< at most kMaxOtherArms
  std::vector<ShareConfig> shares;
  std::string first_feeling_link;  ///< from which on the arm feels what touches it; empty: all links
  double share_wait_s = 0.0005;    ///< for what others have sensed; then it is sensed here
  std::string own_share;           ///< by the command line: the share that this process senses; empty: none
  int servo_priority = core::kServoPriority;  ///< SCHED_FIFO priority of the servos; 0: none requested
};

extern const char* const kParameters;  ///< the shipped phantom_sensing.yaml, which defines the parameters

/// Reads and checks the parameters. Throws ConfigError with file, line, key, value and what is allowed.
Config load_config(const std::filesystem::path& file);

}  // namespace phantom::phantom_sensing
