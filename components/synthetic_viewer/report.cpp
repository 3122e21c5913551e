#include "components/synthetic_viewer/report.hpp"

#include <spdlog/spdlog.h>

#include <condition_variable>
#include <cstdio>
#include <deque>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "common/core/errors.hpp"
#include "common/core/thread_place.hpp"
#include "components/synthetic_viewer/hud.hpp"

namespace phantom::synthetic_viewer {

namespace {

void write(const std::filesystem::path& file, const std::string& content) {
  std::ofstream out(file, std::ios::binary);
  out.write(content.data(), static_cast<std::streamsize>(content.size()));
  if (!out) spdlog::error("cannot write {}", file.string());
}

}  // namespace

/// Encodes and writes pictures on its own thread. Its destructor waits until all are written.
class Report::Writer {
 public:
  ~Writer() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  void put(std::filesystem::path file, Image image) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waiting_.size() < kMostWaiting; });
    waiting_.emplace_back(std::move(file), std::move(image));
    changed_.notify_all();
  }

 private:
  static constexpr std::size_t kMostWaiting = 32;
  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      const auto [file, image] = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      changed_.notify_all();
      try {
        write(file, encode_png(image));
      } catch (const std::exception& problem) {
        spdlog::error("{}: {}", file.string(), problem.what());
      }
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::pair<std::filesystem::path, Image>> waiting_;
  bool ended_ = false;
  std::thread thread_{[this] {
    core::take_place(core::ThreadRole::kPictures);
    work();
  }};
};

Report::Report(std::filesystem::path folder, int most_hit_pictures)
    : folder_(std::move(folder)), most_hit_pictures_(static_cast<std::size_t>(most_hit_pictures)) {
  if (!wanted()) return;
  std::error_code problem;
  std::filesystem::create_directories(folder_, problem);
  if (problem) throw core::MissingError("report folder " + folder_.string() + ": " + problem.message());
  writer_ = std::make_unique<Writer>();
}

Report::~Report() = default;
Report::Report(Report&&) noexcept = default;

void Report::save(const std::string& name, Image image) {
  if (!wanted()) return;
  writer_->put(folder_ / (name + ".png"), std::move(image));
  pictures_.push_back(name + ".png");
}

void Report::save_hit(std::uint32_t alert, const std::string& node, double t_s, std::int64_t utc_ns,
                      Image image) {
  if (!wants_hit_pictures()) return;
  char name[64];
  std::snprintf(name, sizeof name, "hit_%03zu_%s.png", views_.size() + 1, node.c_str());
  writer_->put(folder_ / name, std::move(image));
  views_.push_back({t_s, utc_ns, node, name, alert});
}

void Report::finish(const Summary& summary) {
  if (!wanted()) return;
  writer_.reset();
  nlohmann::json views = nlohmann::json::array();
  for (const View& view : views_) {
    views.push_back({{"t", view.t_s},
                     {"utc_ns", view.utc_ns},
                     {"node", view.node},
                     {"png", view.png},
                     {"alert", view.alert}});
  }
  const nlohmann::json json{
      {"frames", summary.frames},
      {"seconds", summary.seconds},
      {"fps", summary.seconds > 0 ? static_cast<double>(summary.frames) / summary.seconds : 0.0},
      {"frame_p50_ms", summary.frame_p50_s * 1e3},
      {"frame_max_ms", summary.frame_max_s * 1e3},
      {"alerts", summary.alerts},
      {"alert_to_picture_max_ms", summary.alert_to_picture_max_s * 1e3},
      {"views", views},
      {"pictures", pictures_},
      {"page", summary.page},
      {"graphics", summary.graphics}};
  write(folder_ / "synthetic_viewer.json", json.dump(2) + "\n");
}

}  // namespace phantom::synthetic_viewer
