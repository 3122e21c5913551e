#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "common/diagnostics/name_filter.hpp"
#include "common/recording/mcap_reader.hpp"

namespace phantom::dds_recorder {

/// Returns the files that the arguments name: a file as given, of a folder all .mcap files by name. Throws
/// MissingError if one does not exist or a folder has none.
std::vector<std::filesystem::path> recordings_in(const std::vector<std::filesystem::path>& given);

/// An open recording.
struct OpenedRecording {
  std::filesystem::path path;
  recording::McapReader reader;
};
/// Opens all files and returns them in the order of their first message. Throws MissingError (does not exist)
/// or ConfigError (not an MCAP file).
std::vector<OpenedRecording> open_recordings(const std::vector<std::filesystem::path>& files);

/// A part of a recording, in seconds from its first message.
struct TimeRange {
  double from_s = 0.0;
  double until_s = -1.0;  ///< −1: to the end
};
/// Converts the range to log times. `first_ns`: log time of the first message.
recording::MessageFilter in_range(const TimeRange& range, std::uint64_t first_ns);
/// A part of a range. A range is read in two parts: first the samples of durable topics from before it, which
/// still hold in it, then the range itself.
struct RangePart {
  recording::MessageFilter filter;
  bool durable_only = false;
};
std::vector<RangePart> parts_of(const recording::MessageFilter& range);
/// Returns the log times of the first and the last message of all files.
std::pair<std::uint64_t, std::uint64_t> times_of(const std::vector<OpenedRecording>& recordings);

/// Receives what is in recordings, one file after the other.
struct RecordingListener {
  virtual ~RecordingListener() = default;
  virtual void begin(const recording::McapReader& /*file*/) {}
  /// `says`: false: a durable sample from before the range.
  virtual void take(const recording::Channel& channel, const recording::Message& message, bool says) = 0;
};
/// Passes all messages of the wanted topics in the range to `listener`, and prints on `notes` what of the
/// files cannot be read. What was carried over from one file into the next comes once. Returns their number.
std::uint64_t read_all(const std::vector<OpenedRecording>& recordings, const recording::MessageFilter& range,
                       const diagnostics::NameFilter& wanted, RecordingListener& listener,
                       std::ostream& notes);

/// Writes the new file `out` by calling `write` with a temporary name; then it has its own, on the disk
/// itself. Throws ConfigError if it is there already, and what `write` throws; no file is left then.
void write_whole(const std::filesystem::path& out,
                 const std::function<void(const std::filesystem::path&)>& write);

/// Returns whether the channel's samples were there before its file began.
bool is_carried_over(const recording::Channel& channel);
/// Returns whether late joiners get the newest sample of each instance.
bool is_durable(const recording::Channel& channel);
/// Returns a value of the channel's metadata; empty if the key does not exist.
std::string metadata_of(const recording::Channel& channel, const std::string& key);

}  // namespace phantom::dds_recorder
