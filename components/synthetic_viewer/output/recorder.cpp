#include "components/synthetic_viewer/output/recorder.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <opencv2/videoio.hpp>

#include "common/core/thread_config.hpp"
#include "components/synthetic_viewer/output/frame_pace.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr int kNiceness = 15;

std::string stamp_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y%m%dT%H%M%SZ", &utc);
  return text;
}

/// Returns a path with this name that does not exist yet.
std::filesystem::path fresh(const std::filesystem::path& folder, const std::string& name,
                            const char* ending) {
  std::filesystem::path path = folder / (name + ending);
  for (int number = 2; std::filesystem::exists(path); ++number)
    path = folder / (name + "_" + std::to_string(number) + ending);
  return path;
}

/// Opens the file in the requested format, or as AVI if the system cannot write that. Returns its path; empty
/// if neither works.
std::filesystem::path open(cv::VideoWriter& writer, const RecordingConfig& config, const std::string& name,
                           cv::Size size) {
  if (config.format == VideoFormat::kMp4) {
    std::filesystem::path path = fresh(config.folder, name, ".mp4");
    if (writer.open(path.string(), cv::VideoWriter::fourcc('m', 'p', '4', 'v'), config.rate_hz, size))
      return path;
    spdlog::warn("recording: this system writes no MP4; AVI is written instead");
  }
  const std::filesystem::path path = fresh(config.folder, name, ".avi");
  const bool good = writer.open(path.string(), cv::CAP_OPENCV_MJPEG,
                                cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), config.rate_hz, size);
  return good ? path : std::filesystem::path();
}

}  // namespace

Recorder::~Recorder() { end(); }

void Recorder::begin(View view, web::Broadcast<Image>& source) {
  end();
  stop_ = false;
  {
    const std::lock_guard lock(mutex_);
    state_ = {.running = true, .view = view};
  }
  source.followers.fetch_add(1);
  thread_ = std::thread([this, view, &source] {
    core::apply_thread_config(core::ThreadRole::kFilm);
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNiceness);
    try {
      work(view, source);
    } catch (const std::exception& problem) {
      fail(problem.what());
    }
    source.followers.fetch_sub(1);
    const std::lock_guard lock(mutex_);
    state_.running = false;
  });
}

void Recorder::end() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

RecordingState Recorder::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void Recorder::fail(const std::string& problem) {
  spdlog::error("recording: {}", problem);
  const std::lock_guard lock(mutex_);
  state_.problem = problem;
}

void Recorder::work(View view, web::Broadcast<Image>& source) {
  std::error_code folder_problem;
  if (!config_.folder.empty()) std::filesystem::create_directories(config_.folder, folder_problem);
  if (folder_problem)
    return fail("cannot make the folder " + config_.folder.string() + ": " + folder_problem.message());
  cv::VideoWriter writer;
  web::Broadcast<Image>::Content picture;
  std::uint64_t seen = 0;
  FramePace pace(config_.rate_hz);
  const auto write_due = [&] {
    const int frames = pace.due(clock_());
    for (int left = frames; left > 0; --left) writer.write(*picture);
    const std::lock_guard lock(mutex_);
    state_.frames += frames;
  };
  const std::chrono::milliseconds patience(std::lround(std::min(200.0, 1e3 / config_.rate_hz)));
  while (!stop_) {
    if (auto next = source.next(seen, patience)) picture = std::move(next);
    if (!picture) continue;
    if (!writer.isOpened()) {
      const std::filesystem::path path =
          open(writer, config_, std::string(name_of(view)) + "_" + stamp_now(), picture->size());
      if (path.empty())
        return fail("no video file can be written in " + std::filesystem::absolute(config_.folder).string());
      spdlog::info("recording the {} view to {}", name_of(view), path.string());
      write_due();  // the video has its first frame before its file is reported
      const std::lock_guard lock(mutex_);
      state_.file = path.string();
    }
    write_due();
  }
  if (writer.isOpened()) write_due();  // the request to stop may have come while a frame was encoded
  writer.release();
  const std::string file = state().file;
  std::error_code unreadable;
  if (!file.empty() && (std::filesystem::file_size(file, unreadable) == 0 || unreadable))
    fail(file + " could not be written");
}

}  // namespace phantom::synthetic_viewer
