#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "common/core/clock.hpp"
#include "components/synthetic_viewer/broadcast.hpp"
#include "components/synthetic_viewer/image.hpp"
#include "components/synthetic_viewer/state.hpp"

namespace phantom::synthetic_viewer {

enum class VideoFormat { kMp4, kAvi };

/// How a view is recorded.
struct RecordingConfig {
  std::filesystem::path folder;  ///< empty: the report's, or the working directory
  VideoFormat format = VideoFormat::kMp4;
  double rate_hz = 10.0;
  std::optional<View> at_start;  ///< begin with this view when the viewer starts
};

/// Records a view's pictures as they are published into a video file, in real time: a picture that stands
/// still is repeated, one that comes late is shown late. Encodes on a thread of its own, so that a slow disk
/// or codec costs frames of the recording only. MP4 needs a codec of the system's FFmpeg; without it AVI
/// (motion JPEG) is written.
class Recorder {
 public:
  using Clock = core::Nanoseconds (*)();

  /// `clock`: the time that films keep; never goes back; called by the recording's thread.
  explicit Recorder(RecordingConfig config, Clock clock = core::monotonic_ns)
      : config_(std::move(config)), clock_(clock) {}
  /// Ends a recording that runs.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Begins a file called <view>_<UTC>.mp4. One that runs is ended first. `source` must outlive the
  /// recording.
  void begin(View view, Broadcast<Image>& source);
  void end();
  /// Thread-safe.
  RecordingState state() const;

 private:
  void work(View view, Broadcast<Image>& source);
  void fail(const std::string& problem);

  RecordingConfig config_;
  Clock clock_;
  mutable std::mutex mutex_;
  RecordingState state_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace phantom::synthetic_viewer
