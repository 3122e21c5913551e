#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "components/synthetic_viewer/video/video_source.hpp"

namespace phantom::synthetic_viewer {

/// How a camera's video stands.
struct VideoStatus {
  std::shared_ptr<const VideoPicture> newest;  ///< null: none yet
  std::uint64_t number = 0;                    ///< of that picture, from 1
  std::uint64_t refused = 0;                   ///< pictures that were refused
  core::Nanoseconds changed_ns =
      0;  ///< when a picture came that differs from the one before; a stuck camera sends one again and again
  std::string problem;  ///< why nothing comes now, or why the last picture was refused; empty: all is well
};

/// Reads a camera's pictures on a thread of its own, and opens the source again after it was lost. Holds only
/// the newest picture.
class VideoFeed {
 public:
  using Open = std::function<std::unique_ptr<VideoSource>()>;

  /// `open` is called on the feed's thread; what it throws is the problem that is told, until it succeeds.
  explicit VideoFeed(Open open, core::Nanoseconds retry_ns = 2 * core::kNsPerSecond);
  ~VideoFeed();
  VideoFeed(const VideoFeed&) = delete;
  VideoFeed& operator=(const VideoFeed&) = delete;

  /// Thread-safe.
  VideoStatus status() const;

 private:
  void work();
  void play();
  void take(VideoPicture picture);
  void report(const std::string& problem);

  Open open_;
  core::Nanoseconds retry_ns_;
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  VideoStatus status_;
  std::string told_;                                 // the problem that the log was last told of
  core::Nanoseconds told_ns_ = -core::kNsPerSecond;  // and when
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace phantom::synthetic_viewer
