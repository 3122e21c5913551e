#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "common/diagnostics/name_filter.hpp"
#include "common/recording/recordings.hpp"

namespace phantom::dds_recorder {

using recording::is_carried_over;
using recording::is_durable;
using recording::metadata_of;
using recording::open_recordings;
using recording::OpenedRecording;
using recording::recordings_in;
using recording::times_of;

/// A part of a recording, in seconds from its first message.
struct TimeRange {
  double from_s = 0.0;
  double until_s = -1.0;  ///< −1: to the end
};
/// Converts the range to log times. `first_ns`: log time of the first message. Throws ConfigError if it ends
/// before it begins.
recording::MessageFilter in_range(const TimeRange& range, std::uint64_t first_ns);
/// A part of a range. A range is read in two parts: first the samples of durable topics from before it, which
/// still hold in it, then the range itself.
struct RangePart {
  recording::MessageFilter filter;
  bool durable_only = false;
};
std::vector<RangePart> parts_of(const recording::MessageFilter& range);

/// Receives what is in recordings, one file after the other.
struct RecordingListener {
  virtual ~RecordingListener() = default;
  virtual void begin(const recording::McapReader& /*file*/) {}
  /// `says`: false: a durable sample from before the range.
  virtual void take(const recording::Channel& channel, const recording::Message& message, bool says) = 0;
};
/// What read_all() has read.
struct ReadFigures {
  std::uint64_t samples = 0;
  std::uint64_t unread = 0;  ///< chunks of the range that cannot be read: damaged, or of another compression
};

/// Passes all messages of the wanted topics in the range to `listener`, and prints on `notes` what of the
/// files cannot be read. What was carried over from one file into the next comes once.
ReadFigures read_all(const std::vector<OpenedRecording>& recordings, const recording::MessageFilter& range,
                     const diagnostics::NameFilter& wanted, RecordingListener& listener, std::ostream& notes);

/// Throws if nothing was read: a file without content must not be made.
void check_any_read(const ReadFigures& read);
/// Returns the exit code of a command that has read recordings: kExitFailed if chunks could not be read,
/// which it prints on `notes`. `made`: what it made of the others.
int exit_code_of(const ReadFigures& read, const std::string& made, std::ostream& notes);

/// Writes the new file `out` by calling `write` with a temporary name; then it has its own, on the disk
/// itself. Throws ConfigError if it is there already, and what `write` throws; no file is left then.
void write_whole(const std::filesystem::path& out,
                 const std::function<void(const std::filesystem::path&)>& write);

}  // namespace phantom::dds_recorder
