#pragma once

#include <iosfwd>

#include "components/dds_recorder/files.hpp"

namespace phantom::dds_recorder {

/// `dds_recorder convert`: one file of several, of a part, of chosen topics, or of what can be read of a
/// damaged one.
struct ConvertRequest {
  std::vector<std::filesystem::path> files;
  std::filesystem::path out;        ///< .mcap, or .jsonl: a line of JSON for each sample
  std::vector<std::string> topics;  ///< patterns; none: all
  TimeRange range;
  int zstd_level = 3;  ///< 0: not compressed
};

/// Writes the file anew, under another name first; tells on `said` what was left out. Throws ConfigError,
/// MissingError and std::runtime_error (cannot be written; then no file is left). Returns the exit code.
int run_convert(const ConvertRequest& request, std::ostream& said);

}  // namespace phantom::dds_recorder
