#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/recording/mcap_reader.hpp"

// Recordings of this project as their readers find them: one or several files of a series, and what their
// channels say about themselves.

namespace phantom::recording {

/// Key in a channel's metadata; "yes": its samples were there before the file began.
inline constexpr const char* kCarriedOver = "carried_over";
/// Key in a channel's metadata: the DDS partition that its samples came from; empty: the default one.
inline constexpr const char* kPartition = "partition";

/// Returns the files that the arguments name: a file as given, of a folder all .mcap files by name. Throws
/// MissingError if one does not exist or a folder has none.
std::vector<std::filesystem::path> recordings_in(const std::vector<std::filesystem::path>& given);

/// An open recording.
struct OpenedRecording {
  std::filesystem::path path;
  McapReader reader;
};
/// Opens all files and returns them in the order of their first message. Throws MissingError (does not exist)
/// or ConfigError (not an MCAP file).
std::vector<OpenedRecording> open_recordings(const std::vector<std::filesystem::path>& files,
                                             ReaderLimits limits = {});

/// Returns the log times of the first and the last message of all files.
std::pair<std::uint64_t, std::uint64_t> times_of(const std::vector<OpenedRecording>& recordings);

/// Returns whether the channel's samples were there before its file began.
bool is_carried_over(const Channel& channel);
/// Returns whether late joiners get the newest sample of each instance.
bool is_durable(const Channel& channel);
/// Returns a value of the channel's metadata; empty if the key does not exist.
std::string metadata_of(const Channel& channel, const std::string& key);

}  // namespace phantom::recording
