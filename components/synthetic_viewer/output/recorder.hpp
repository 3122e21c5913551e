#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "common/core/clock.hpp"
#include "common/web/broadcast.hpp"
#include "components/synthetic_viewer/render/image.hpp"
#include "components/synthetic_viewer/state/state.hpp"

namespace phantom::synthetic_viewer {

enum class VideoFormat { kMp4, kAvi };

/// Settings for recording a view.
struct RecordingConfig {
  std::filesystem::path folder;  ///< empty: the report folder, or the working directory
  VideoFormat format = VideoFormat::kMp4;
  double rate_hz = 10.0;
  std::optional<View> at_start;  ///< view to record from the viewer's start
};

/// Records the published pictures of a view into a video file, in real time: a still picture is repeated, and
/// one that comes late is shown late. It encodes on its own thread, so that a slow disk or codec costs only
/// frames of the recording. MP4 needs a codec of the system's FFmpeg; without it AVI (motion JPEG) is
/// written.
class Recorder {
 public:
  using Clock = core::Nanoseconds (*)();

  /// `clock`: the clock of the videos, which never goes back; called on the recording's thread.
  explicit Recorder(RecordingConfig config, Clock clock = core::monotonic_ns)
      : config_(std::move(config)), clock_(clock) {}
  /// Ends a running recording.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Starts a file called <view>_<UTC>.mp4, after ending a running recording. `source` must outlive the
  /// recording.
  void begin(View view, web::Broadcast<Image>& source);
  void end();
  /// Thread-safe.
  RecordingState state() const;

 private:
  void work(View view, web::Broadcast<Image>& source);
  void fail(const std::string& problem);

  RecordingConfig config_;
  Clock clock_;
  mutable std::mutex mutex_;
  RecordingState state_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace phantom::synthetic_viewer
