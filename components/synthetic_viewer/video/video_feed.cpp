#include "components/synthetic_viewer/video/video_feed.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <opencv2/core.hpp>

#include "common/core/thread_config.hpp"

namespace phantom::synthetic_viewer {
constexpr int kFeedNiceness = 15;

VideoFeed::VideoFeed(Open open, core::Nanoseconds retry_ns) : open_(std::move(open)), retry_ns_(retry_ns) {
  thread_ = std::thread([this] { work(); });
}

VideoFeed::~VideoFeed() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

VideoStatus VideoFeed::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void VideoFeed::work() {
  core::apply_thread_config(core::ThreadRole::kFilm);
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kFeedNiceness);
  while (!stop_) {
    try {
      play();
    } catch (const std::exception& problem) {
      report(problem.what());
    }
    std::unique_lock lock(mutex_);
    ended_.wait_for(lock, std::chrono::nanoseconds(retry_ns_), [this] { return stop_.load(); });
  }
}

void VideoFeed::play() {
  const std::unique_ptr<VideoSource> source = open_();
  while (!stop_) {
    core::Expected<std::optional<VideoPicture>> next = source->next();
    if (!next) {
      report(next.status().message());
      const std::lock_guard lock(mutex_);
      ++status_.refused;
    } else if (next->has_value()) {
      take(std::move(**next));
    }
  }
}

void VideoFeed::take(VideoPicture picture) {
  const auto before = status().newest;
  const bool same = before && before->image.size() == picture.image.size() &&
                    cv::norm(before->image, picture.image, cv::NORM_INF) == 0.0;
  const std::lock_guard lock(mutex_);
  if (!same) status_.changed_ns = picture.arrived_ns;
  status_.newest = std::make_shared<const VideoPicture>(std::move(picture));
  ++status_.number;
  status_.problem.clear();
  told_.clear();
}

void VideoFeed::report(const std::string& problem) {
  const std::lock_guard lock(mutex_);
  const core::Nanoseconds now_ns = core::monotonic_ns();
  // Who sends nonsense must not fill the log.
  if (told_ != problem && now_ns - told_ns_ > core::kNsPerSecond) {
    spdlog::warn("camera: {}", problem);
    told_ = problem;
    told_ns_ = now_ns;
  }
  status_.problem = problem;
}

}  // namespace phantom::synthetic_viewer
