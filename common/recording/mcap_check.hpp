#pragma once

#include <string>
#include <vector>

#include "common/recording/mcap_reader.hpp"

namespace phantom::recording {

/// The result of checking every byte of a file.
struct CheckReport {
  std::uint64_t messages = 0, chunks = 0, bytes = 0;
  std::vector<std::string> problems;  ///< in words, with byte offsets; the first 100
  bool ok() const { return problems.empty(); }
};

/// Reads the whole file once, from the beginning, and compares with its content every checksum, every index,
/// the time ranges of the chunks, and the summary's statistics, channels and schemas. Fails only if the file
/// does not begin as an MCAP file.
core::Expected<CheckReport> check(const std::filesystem::path& file, ReaderLimits limits = {});
core::Expected<CheckReport> check(std::unique_ptr<ByteSource> source, ReaderLimits limits = {});

}  // namespace phantom::recording
