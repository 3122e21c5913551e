#pragma once

#include <filesystem>
#include <memory>
#include <utility>

#include "components/dds_recorder/durable_state.hpp"
#include "components/dds_recorder/losses.hpp"
#include "components/dds_recorder/recording_file.hpp"
#include "components/dds_recorder/window.hpp"

namespace phantom::dds_recorder {

/// Which samples count as events.
struct Triggers {
  bool hit_alert = true, degraded = true, emergency_stop = true;
};

struct RecorderSettings {
  std::filesystem::path folder = "recordings";
  std::string name = "phantom";
  bool on_event = false;  ///< false: continuous
  core::Nanoseconds before_ns = 30 * core::kNsPerSecond, after_ns = 10 * core::kNsPerSecond;
  std::size_t window_bytes = 256'000'000, durable_bytes = 512'000'000;
  Triggers triggers;
  std::uint64_t split_bytes = 1024'000'000;
  core::Nanoseconds split_ns = 600 * core::kNsPerSecond;
  std::uint64_t margin_bytes = 1024'000'000;
  std::size_t chunk_bytes = 1024'000;
  core::Nanoseconds flush_ns = core::kNsPerSecond, sync_ns = 5 * core::kNsPerSecond;
  int zstd_level = 1;
};

/// The recorder's access to files, disk space and discovery.
struct RecorderPorts {
  std::function<core::Expected<std::unique_ptr<recording::ByteSink>>(const std::filesystem::path&)> create;
  std::function<std::uint64_t()> free_bytes;  ///< on the disk, for this process
  DescribeWriter describe;
  InstanceOf instance_of;
};

/// Content of every file besides samples.
struct RecordingContext {
  recording::StringMap about;  ///< of the record kAboutRecord; the recorder adds to it
  std::vector<recording::Attachment> attachments;
};

/// Converts the monotonic clock to log times. It reads UTC only once, so that a step of the UTC clock moves
/// no sample.
struct ClockPair {
  core::Nanoseconds monotonic_ns = 0, utc_ns = 0;
  std::uint64_t utc_of(core::Nanoseconds at_monotonic_ns) const {
    return static_cast<std::uint64_t>(utc_ns + at_monotonic_ns - monotonic_ns);
  }
};

enum class RecorderState {
  kRecording,
  kWaiting,     ///< for an event
  kOutOfSpace,  ///< disk margin reached, or a write failed; on_event: until there is space again
};

struct RecorderFigures {
  RecorderState state = RecorderState::kWaiting;
  std::uint64_t samples = 0, bytes = 0;  ///< written
  std::uint64_t files = 0, events = 0;
  TopicLosses losses;  ///< sum of all topics
  std::size_t window_samples = 0, window_bytes = 0, durable_samples = 0, durable_bytes = 0;
  std::uint64_t durable_forgotten = 0;  ///< durable samples that are not at the next file's start: no memory
  std::string file;                     ///< file that is being written
};

/// Decides which samples go into which file, and when a file ends. Uses no DDS, thread or clock. Not
/// thread-safe.
class Recorder {
 public:
  static constexpr std::size_t kMaxNotices = 256;    ///< between two calls of take_notices()
  static constexpr std::size_t kMaxTriggers = 1024;  ///< that a file notes; further ones are counted

  Recorder(RecorderSettings settings, RecordingContext context, RecorderPorts ports, ClockPair clocks);
  ~Recorder();

  TopicNumber add_topic(TopicInfo topic);
  const std::vector<TopicInfo>& topics() const { return topics_; }

  /// Takes the next sample, in the order of arrival.
  void take(const SampleView& sample);
  /// Sets a topic's counts so far that the queue and DDS keep: those of `input`.
  void count(TopicNumber topic, const TopicLosses& input);
  /// Notes an event at `now_ns`. In mode on_event it writes the window, and recording continues for
  /// `after_ns`.
  void trigger(const std::string& reason, core::Nanoseconds now_ns);
  /// Flushes, splits and checks the disk's free space. To be called ten times a second or more.
  void tick(core::Nanoseconds now_ns);
  /// Ends the file in order. In mode on_event the samples in the window are not written.
  void finish(core::Nanoseconds now_ns);

  /// Returns why recording has ended for good (continuous mode: margin reached, a write failed); empty if it
  /// has not.
  const std::string& ended() const { return ended_; }
  RecorderFigures figures() const;
  const std::vector<TopicLosses>& losses() const { return losses_; }
  /// Returns messages for the log since the last call: kMaxNotices of them, and how many more there were.
  std::vector<std::string> take_notices();

 private:
  bool open(core::Nanoseconds now_ns);
  void close(const std::string& reason, core::Nanoseconds now_ns);
  bool write(const SampleView& sample);
  void put(const SampleView& sample);
  void keep(Sample sample);
  bool write_prefix(core::Nanoseconds now_ns);
  void write_losses(core::Nanoseconds now_ns);
  void fail(const core::Status& status, core::Nanoseconds now_ns);
  void look_at_disk(core::Nanoseconds now_ns);
  void stop_for(const std::string& reason);
  void note(std::string notice);
  std::vector<TopicLosses> losses_of_file() const;

  RecorderSettings settings_;
  RecordingContext context_;
  RecorderPorts ports_;
  ClockPair clocks_;
  std::vector<TopicInfo> topics_;
  std::vector<TopicLosses> losses_, losses_at_start_, losses_written_;
  GapCounter gaps_;
  DurableState durable_;
  Window window_;

  std::unique_ptr<RecordingFile> file_;
  std::string series_;
  int number_ = 0;
  core::Nanoseconds opened_ns_ = 0, flushed_ns_ = 0, synced_ns_ = 0, noted_ns_ = 0, looked_ns_ = 0,
                    event_until_ns_ = 0;
  std::uint64_t bytes_at_look_ = 0;
  bool out_of_space_ = false;
  std::uint64_t samples_ = 0, bytes_ = 0, files_ = 0, events_ = 0;
  std::string ended_;
  std::vector<std::string> notices_;
  std::uint64_t notices_left_out_ = 0;
  std::size_t triggers_noted_ = 0;  // in this file
};

}  // namespace phantom::dds_recorder
