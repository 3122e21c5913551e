#pragma once

#include "common/runtime/deployment.hpp"
#include "components/dds_recorder/config.hpp"

namespace phantom::dds_recorder {

/// `dds_recorder record`: what the command line says besides the configuration.
struct RecordRequest {
  std::vector<std::string> topics;  ///< instead of the configuration's
  std::filesystem::path folder;     ///< likewise
  std::string name;                 ///< likewise
  bool on_event = false;            ///< whatever the configuration says
  double seconds = 0.0;             ///< end after so long; 0: when asked to
};

/// The configuration with what the command line says over it.
Config merged(Config config, const RecordRequest& request);

/// Free bytes of the file system that the folder is or will be on. Throws MissingError if nothing of the path
/// is there.
std::uint64_t free_bytes(const std::filesystem::path& folder);

/// Records until a stop is requested. Returns the exit code. Throws ConfigError, MissingError, DdsError.
int run_record(const RecordRequest& request, const runtime::Deployment& deployment, const Config& config);

}  // namespace phantom::dds_recorder
