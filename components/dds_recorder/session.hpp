#pragma once

#include "common/runtime/configuration/deployment.hpp"
#include "components/dds_recorder/config.hpp"

namespace phantom::dds_recorder {

/// The arguments of `dds_recorder record` besides the configuration.
struct RecordRequest {
  std::vector<std::string> topics;  ///< replaces the configuration's unless empty
  std::filesystem::path folder;     ///< likewise
  std::string name;                 ///< likewise
  bool on_event = false;            ///< true: overrides the configuration
  double seconds = 0.0;             ///< ends after this time; 0: on request
};

/// Returns the configuration, overridden by the command line.
Config merged(Config config, const RecordRequest& request);

/// Returns the free bytes of the file system that has or will have the folder. Throws MissingError if no part
/// of the path exists.
std::uint64_t free_bytes(const std::filesystem::path& folder);

/// Throws MissingError if the folder cannot be made or written to, or its disk has no space. Changes nothing.
void check_folder(const Config& config);

/// Logs each wanted topic that is a plain name and none of the project's.
void warn_of_unknown_topics(const Config& config);

/// Records until a stop is requested. Returns the exit code. Throws ConfigError, MissingError, DdsError.
int run_record(const RecordRequest& request, const runtime::Deployment& deployment, const Config& config);

}  // namespace phantom::dds_recorder
