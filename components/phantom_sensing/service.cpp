#include "components/phantom_sensing/service.hpp"

#include <spdlog/spdlog.h>

#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "common/runtime/process.hpp"
#include "components/phantom_sensing/dds_adapter.hpp"

namespace phantom::phantom_sensing {
namespace {

using Json = nlohmann::ordered_json;

/// An alert as the report and the log tell it.
struct HitRecord {
  percept::Alert alert;
  double raised_s = 0.0;
  double cleared_s = -1.0;  ///< −1: not yet
};

/// Passes everything on to DDS and keeps the alerts for log and report. Logging is left to the main thread: a
/// log that nobody drains must not hold up the haptic path.
class RecordingSink : public PerceptSink {
 public:
  RecordingSink(PerceptSink& next, const runtime::CellConfig& cell, const PhantomModel& model)
      : next_(next), cell_(cell), model_(model) {
    hits_.reserve(kMostHits);
  }

  void on_drag(const StepOutputs& outputs, const TickInfo& info) override { next_.on_drag(outputs, info); }
  void on_percept(const StepOutputs& outputs, const TickInfo& info) override {
    next_.on_percept(outputs, info);
  }
  void on_alert(const percept::Alert& alert, bool cleared) override {
    next_.on_alert(alert, cleared);
    const double now_s = core::seconds(core::monotonic_ns() - start_ns_);
    const std::lock_guard lock(mutex_);
    if (!cleared && hits_.size() < kMostHits) hits_.push_back({alert, now_s});
    if (cleared && !hits_.empty() && hits_.back().alert.number == alert.number)
      hits_.back().cleared_s = now_s;
  }

  /// Logs the alerts that are new. Main thread.
  void log_new() {
    while (const auto hit = record(logged_)) {
      ++logged_;
      spdlog::info("hit alert {}: {} near {} (rule {}, {:.3f} m/s)", hit->alert.number, link_of(hit->alert),
                   object_of(hit->alert), static_cast<int>(hit->alert.rule),
                   hit->alert.at.situation.speed_m_s);
    }
  }

  Json json() {
    Json list = Json::array();
    for (std::size_t i = 0; const auto hit = record(i); ++i) {
      list.push_back({{"t", hit->raised_s},
                      {"alert", hit->alert.number},
                      {"link", link_of(hit->alert)},
                      {"object", object_of(hit->alert)},
                      {"rule", static_cast<int>(hit->alert.rule)},
                      {"mu", hit->alert.at.situation.mu},
                      {"speed_m_s", hit->alert.at.situation.speed_m_s}});
      if (hit->cleared_s >= 0.0) list.back()["cleared_t"] = hit->cleared_s;
    }
    return list;
  }

 private:
  static constexpr std::size_t kMostHits = 10'000;
  std::optional<HitRecord> record(std::size_t index) {
    const std::lock_guard lock(mutex_);
    return index < hits_.size() ? std::optional(hits_[index]) : std::nullopt;
  }
  const std::string& link_of(const percept::Alert& alert) const {
    return model_.arm.links()[alert.at.link].name;
  }
  std::string object_of(const percept::Alert& alert) const {
    const std::uint16_t id = alert.at.object;
    return id >= 1 && id <= cell_.objects.size() ? cell_.objects[id - 1].name
                                                 : "object " + std::to_string(id);
  }

  PerceptSink& next_;
  const runtime::CellConfig& cell_;
  const PhantomModel& model_;
  core::Nanoseconds start_ns_ = core::monotonic_ns();
  std::mutex mutex_;
  std::vector<HitRecord> hits_;
  std::size_t logged_ = 0;  // main thread only
};

core::Health health_of(const LoopFigures& figures, const PhantomModel& model,
                       const WorkspaceKeeper& workspace, double tick_rate_hz) {
  core::Health health;
  if (workspace.version() == 0) {
    health.state = core::ComponentState::kStarting;
    health.message = "waiting for the workspace";
  } else if (!figures.state_seen) {
    health.state = core::ComponentState::kReady;
    health.message = "waiting for slave_state";
  } else if (!figures.valid) {
    health.state = core::ComponentState::kDegraded;
    health.message = "slave_state is stale: no percept";
  } else {
    health.state = core::ComponentState::kRunning;
  }
  health.figures = {{"sensors", static_cast<double>(model.skin.size()), ""},
                    {"active_sensors", static_cast<double>(figures.active_sensors), ""},
                    {"workspace_version", static_cast<double>(workspace.version()), ""},
                    {"ticks", static_cast<double>(figures.ticks), ""},
                    {"tick_rate", tick_rate_hz, "Hz"},
                    {"tick_p50", figures.tick_p50_us, "us"},
                    {"tick_p99", figures.tick_p99_us, "us"},
                    {"tick_max", figures.tick_max_us, "us"},
                    {"model_age", 1e3 * figures.model_age_s, "ms"}};
  return health;
}

void write_report(const std::filesystem::path& folder, const LoopFigures& figures, const PhantomModel& model,
                  std::uint64_t workspace_version, double seconds, const Json& hits) {
  const Json report = {{"component", "phantom_sensing"},
                       {"seconds", seconds},
                       {"sensors", model.skin.size()},
                       {"workspace_version", workspace_version},
                       {"tick",
                        {{"n", figures.ticks},
                         {"p50_us", figures.tick_p50_us},
                         {"p99_us", figures.tick_p99_us},
                         {"max_us", figures.tick_max_us}}},
                       {"invalid_turns", figures.invalid_turns},
                       {"hits", hits}};
  std::filesystem::create_directories(folder);
  const std::filesystem::path path = folder / "phantom_sensing.json";
  std::ofstream file(path);
  file << report.dump(2) << '\n';
  if (!file.flush()) throw std::runtime_error(path.string() + ": cannot be written");
}

}  // namespace

int run_service(const runtime::ProcessOptions& options, const runtime::Deployment& deployment,
                const runtime::CellConfig& cell, const Config& config, const PhantomModel& model) {
  DdsAdapter adapter(deployment.network, model.arm);
  RecordingSink sink(adapter, cell, model);
  WorkspaceKeeper workspace([&adapter](const std::string& why) { adapter.count_refused_workspace(why); });
  SensingLoop loop(model, config, workspace, sink);
  spdlog::info("{} sensors on {} joints; waiting for workspace and slave_state", model.skin.size(),
               model.arm.joint_count());
  const core::Nanoseconds start_ns = core::monotonic_ns();
  std::thread sensing([&loop] { loop.run(); });
  adapter.start_reading(loop, workspace);

  core::Nanoseconds before_ns = start_ns;
  std::uint64_t ticks_before = 0;
  core::ComponentState said = core::ComponentState::kStarting;
  do {
    const LoopFigures figures = loop.figures();
    const core::Nanoseconds now_ns = core::monotonic_ns();
    const double rate_hz = now_ns > before_ns ? static_cast<double>(figures.ticks - ticks_before) /
                                                    core::seconds(now_ns - before_ns)
                                              : 0.0;
    before_ns = now_ns;
    ticks_before = figures.ticks;
    const core::Health health = health_of(figures, model, workspace, rate_hz);
    if (health.state != said) spdlog::info("{}", health.message.empty() ? "sensing" : health.message);
    said = health.state;
    adapter.publish_status(health);
    sink.log_new();
  } while (runtime::sleep_unless_stopped(0.5));

  adapter.stop_reading();
  loop.stop();
  sensing.join();
  sink.log_new();
  core::Health ended = health_of(loop.figures(), model, workspace, 0.0);
  ended.state = core::ComponentState::kStopped;
  ended.message.clear();
  adapter.publish_status(ended);
  if (!options.report_dir.empty()) {
    write_report(options.report_dir, loop.figures(), model, workspace.version(),
                 core::seconds(core::monotonic_ns() - start_ns), sink.json());
  }
  return runtime::kExitDone;
}

}  // namespace phantom::phantom_sensing
