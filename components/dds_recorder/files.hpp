#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/recording/mcap_reader.hpp"

namespace phantom::dds_recorder {

/// The files that are meant: each as given, of a folder all its .mcap files by name. Throws MissingError if
/// one is not there or a folder has none.
std::vector<std::filesystem::path> recordings_in(const std::vector<std::filesystem::path>& given);

/// Opens them all, in the order of their first message. Throws MissingError (not there) or ConfigError (no
/// MCAP file).
struct OpenedRecording {
  std::filesystem::path path;
  recording::McapReader reader;
};
std::vector<OpenedRecording> open_recordings(const std::vector<std::filesystem::path>& files);

/// Which part of a recording is meant, in seconds from its first message.
struct TimeRange {
  double from_s = 0.0;
  double until_s = -1.0;  ///< −1: to the end
};
/// The range in log times. `first_ns`: log time of the first message.
recording::MessageFilter in_range(const TimeRange& range, std::uint64_t first_ns);
/// A range as it is read: first, of durable topics, what came before it and still holds in it.
struct RangePart {
  recording::MessageFilter filter;
  bool durable_only = false;
};
std::vector<RangePart> parts_of(const recording::MessageFilter& range);
/// Log times of the first and last message of all files.
std::pair<std::uint64_t, std::uint64_t> times_of(const std::vector<OpenedRecording>& recordings);

/// Whether the channel's samples were there before its file began.
bool is_carried_over(const recording::Channel& channel);
/// Whether late joiners get the newest sample of each instance.
bool is_durable(const recording::Channel& channel);
/// A key of the channel's metadata; empty if it is not there.
std::string metadata_of(const recording::Channel& channel, const std::string& key);

}  // namespace phantom::dds_recorder
