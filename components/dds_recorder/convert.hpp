#pragma once

#include <iosfwd>

#include "components/dds_recorder/files.hpp"

namespace phantom::dds_recorder {

/// The arguments of `dds_recorder convert`, which makes one file of several, of a time range, of chosen
/// topics, or of the readable part of a damaged file.
struct ConvertRequest {
  std::vector<std::filesystem::path> files;
  std::filesystem::path out;        ///< .mcap, or .jsonl: one line of JSON per sample
  std::vector<std::string> topics;  ///< patterns; empty: all
  TimeRange range;
  int zstd_level = 3;  ///< 0: no compression
};

/// Writes the new file, under a temporary name until it is complete. Prints on `notes` what was left out.
/// Throws ConfigError, MissingError and std::runtime_error (cannot be written; no file is left then). Returns
/// the exit code.
int run_convert(const ConvertRequest& request, std::ostream& notes);

}  // namespace phantom::dds_recorder
