#include "components/synthetic_viewer/output/report.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <condition_variable>
#include <fstream>
#include <mutex>
#include <thread>

#include "common/core/errors.hpp"
#include "common/core/thread_config.hpp"

namespace phantom::synthetic_viewer {
namespace {

void write(const std::filesystem::path& file, const std::string& content) {
  if (!(std::ofstream(file, std::ios::binary) << content).flush())
    spdlog::error("cannot write {}", file.string());
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
    changed_.wait(lock, [this] { return waiting_.size() < kMaxWaiting; });
    waiting_.emplace_back(std::move(file), std::move(image));
    changed_.notify_all();
  }

 private:
  static constexpr std::size_t kMaxWaiting = 8;
  static constexpr int kWriterNiceness = 15;
  void work() {
    core::apply_thread_config(core::ThreadRole::kPictures);
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kWriterNiceness);
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
  std::thread thread_{[this] { work(); }};
};

Report::Report(std::filesystem::path folder, int most_hit_pictures, core::Nanoseconds begin_ns)
    : folder_(std::move(folder)),
      most_hit_pictures_(static_cast<std::size_t>(most_hit_pictures)),
      begin_ns_(begin_ns) {
  if (!wanted()) return;
  std::error_code problem;
  std::filesystem::create_directories(folder_, problem);
  if (problem) throw core::MissingError("report folder " + folder_.string() + ": " + problem.message());
  writer_ = std::make_unique<Writer>();
}

Report::~Report() = default;

void Report::take(const HitSample& alert) {
  if (wants_hit_pictures()) alerts_.push_back(alert);
}

bool Report::make_alert_picture(Drawing& drawing, const CancelCheck& give_up) {
  if (!wants_hit_pictures()) alerts_.clear();
  if (alerts_.empty()) return true;
  const HitSample& hit = alerts_.front();
  auto [picture, view_node] = drawing.picture(hit);
  auto image = drawing.report_picture(std::move(picture), give_up);
  if (!image) return false;
  const std::string node = percept::node_name(view_node);
  // The running number is the report's own, because alerts count from 1 again when the phantom restarts.
  const std::string name = fmt::format("hit_{:03}_{}.png", views_.size() + 1, node);
  writer_->put(folder_ / name, std::move(*image));
  views_.push_back({{"t", core::seconds(hit.received_ns - begin_ns_)},
                    {"utc_ns", hit.utc_ns},
                    {"node", node},
                    {"png", name},
                    {"alert", hit.alert}});
  alerts_.pop_front();
  return true;
}

bool Report::make_main_picture(Drawing& drawing, const char* name, const CancelCheck& give_up) {
  auto image = drawing.report_picture(drawing.picture(View::kMain), give_up);
  if (!image) return false;
  const std::string file = std::string(name) + ".png";
  writer_->put(folder_ / file, std::move(*image));
  pictures_.push_back(file);
  return true;
}

bool Report::make_pictures(Drawing& drawing, const ArmSample& arm, bool complete,
                           const CancelCheck& give_up) {
  if (!wanted()) return true;
  if (!make_alert_picture(drawing, give_up)) return false;
  const std::array<bool, 3> reached{complete && arm.received_ns != 0,
                                    drawing.hit_view().alert != 0 && !drawing.hit_view().approach,
                                    arm.contact};
  for (std::size_t i = 0; i < milestones_.size(); ++i) {
    if (milestones_[i].saved || !reached[i]) continue;
    if (!make_main_picture(drawing, milestones_[i].name, give_up)) return false;
    milestones_[i].saved = true;
  }
  return true;
}

void Report::make_remaining_pictures(Drawing& drawing) {
  if (!wanted()) return;
  // A process has to end within seconds, however busy the host is.
  const core::Nanoseconds begin_ns = core::monotonic_ns();
  const auto later_than = [begin_ns](double s) {
    return [until_ns = begin_ns + core::from_seconds(s)] { return core::monotonic_ns() > until_ns; };
  };
  const CancelCheck alerts_late = later_than(1.0), late = later_than(2.0);
  while (!alerts_.empty() && make_alert_picture(drawing, alerts_late)) {
  }
  make_main_picture(drawing, "main", late);
}

void Report::finish(nlohmann::json summary) {
  if (!wanted()) return;
  writer_.reset();
  summary["views"] = views_;
  summary["pictures"] = pictures_;
  write(folder_ / "synthetic_viewer.json", summary.dump(2) + "\n");
}

}  // namespace phantom::synthetic_viewer
