#pragma once

#include <filesystem>
#include <memory>
#include <utility>

#include "components/dds_recorder/durable_state.hpp"
#include "components/dds_recorder/losses.hpp"
#include "components/dds_recorder/recording_file.hpp"
#include "components/dds_recorder/window.hpp"

namespace phantom::dds_recorder {

/// What counts as an event.
struct Triggers {
  bool hit_alert = true, degraded = true, emergency_stop = true;
};

struct RecorderSettings {
  std::filesystem::path folder = "recordings";
  std::string name = "phantom";
  bool on_event = false;  ///< else continuous
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

/// What the recorder needs of the world.
struct RecorderPorts {
  std::function<core::Expected<std::unique_ptr<recording::ByteSink>>(const std::filesystem::path&)> create;
  std::function<std::uint64_t()> free_bytes;  ///< left on the medium for this process
  DescribeWriter describe;
  InstanceOf instance_of;
};

/// Written into every file.
struct RecordingContext {
  recording::StringMap about;  ///< of kAboutRecord, besides what the recorder adds
  std::vector<recording::Attachment> attachments;
};

/// Where log times come from: the monotonic clock, put beside UTC once. A step of the UTC clock moves no
/// sample.
struct ClockPair {
  core::Nanoseconds monotonic_ns = 0, utc_ns = 0;
  std::uint64_t utc_of(core::Nanoseconds at_monotonic_ns) const {
    return static_cast<std::uint64_t>(utc_ns + at_monotonic_ns - monotonic_ns);
  }
};

enum class RecorderState {
  kRecording,
  kWaiting,     ///< for an event
  kOutOfSpace,  ///< the disk's margin is reached, or a write failed; on_event: until there is space again
};

struct RecorderFigures {
  RecorderState state = RecorderState::kWaiting;
  std::uint64_t samples = 0, bytes = 0;  ///< written
  std::uint64_t files = 0, events = 0;
  TopicLosses losses;  ///< of all topics
  std::size_t window_samples = 0, window_bytes = 0, durable_samples = 0, durable_bytes = 0;
  std::string file;  ///< that is being written
};

/// Decides what of the samples goes into which file, and when a file ends. Knows no DDS, thread or clock. Not
/// thread-safe.
class Recorder {
 public:
  Recorder(RecorderSettings settings, RecordingContext context, RecorderPorts ports, ClockPair clocks);
  ~Recorder();

  TopicNumber add_topic(TopicInfo topic);
  const std::vector<TopicInfo>& topics() const { return topics_; }

  /// A sample, in the order of arrival.
  void take(const SampleView& sample);
  /// Counts so far, kept elsewhere: by the queue, by DDS.
  void count(TopicNumber topic, std::uint64_t overflow, std::uint64_t dds_lost, std::uint64_t dds_rejected);
  /// Something happened at `now_ns`. In mode on_event the window is written and recording goes on for
  /// `after_ns`.
  void trigger(const std::string& reason, core::Nanoseconds now_ns);
  /// Once in a while, ten times a second or more: flushes, splits, looks after the disk.
  void tick(core::Nanoseconds now_ns);
  /// Ends the file in order. In mode on_event what waits in the window is not written.
  void finish(core::Nanoseconds now_ns);

  /// Why nothing more will be recorded (continuous mode: margin reached, a write failed); empty while all is
  /// well.
  const std::string& ended() const { return ended_; }
  RecorderFigures figures() const;
  const std::vector<TopicLosses>& losses() const { return losses_; }
  /// What is worth saying, since the last call.
  std::vector<std::string> take_notices() { return std::exchange(notices_, {}); }

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
};

}  // namespace phantom::dds_recorder
