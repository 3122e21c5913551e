#include "components/phantom_sensing/service.hpp"

#include <spdlog/spdlog.h>

#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/runtime/process.hpp"
#include "components/phantom_sensing/dds_adapter.hpp"

namespace phantom::phantom_sensing {
namespace {

using Json = nlohmann::ordered_json;

/// Passes everything on to DDS and keeps a list of the alerts for the report.
class RecordingSink : public PerceptSink {
 public:
  RecordingSink(PerceptSink& next, const runtime::CellConfig& cell, const PhantomModel& model)
      : next_(next), cell_(cell), model_(model) {}

  void on_drag(const StepOutputs& outputs, const TickInfo& info) override { next_.on_drag(outputs, info); }
  void on_percept(const StepOutputs& outputs, const TickInfo& info) override {
    next_.on_percept(outputs, info);
  }
  void on_alert(const percept::Alert& alert, bool cleared) override {
    next_.on_alert(alert, cleared);
    const double t_s = core::seconds(core::monotonic_ns() - start_ns_);
    if (cleared) {
      if (!hits_.empty() && hits_.back()["alert"] == alert.number) hits_.back()["cleared_t"] = t_s;
      return;
    }
    const std::string object = name_of(alert.at.object), link = model_.arm.links()[alert.at.link].name;
    spdlog::info("hit alert {}: {} near {} (rule {}, {:.3f} m/s)", alert.number, link, object,
                 static_cast<int>(alert.rule), alert.at.situation.speed_m_s);
    if (hits_.size() >= kMostHits) return;
    hits_.push_back({{"t", t_s},
                     {"alert", alert.number},
                     {"link", link},
                     {"object", object},
                     {"rule", static_cast<int>(alert.rule)},
                     {"mu", alert.at.situation.mu},
                     {"speed_m_s", alert.at.situation.speed_m_s}});
  }
  /// Only once the loop has ended.
  const Json& hits() const { return hits_; }

 private:
  static constexpr std::size_t kMostHits = 100'000;
  std::string name_of(std::uint16_t object) const {
    return object >= 1 && object <= cell_.objects.size() ? cell_.objects[object - 1].name : std::string("?");
  }

  PerceptSink& next_;
  const runtime::CellConfig& cell_;
  const PhantomModel& model_;
  core::Nanoseconds start_ns_ = core::monotonic_ns();
  Json hits_ = Json::array();
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
  } while (runtime::sleep_unless_stopped(0.5));

  adapter.stop_reading();
  loop.stop();
  sensing.join();
  core::Health ended = health_of(loop.figures(), model, workspace, 0.0);
  ended.state = core::ComponentState::kStopped;
  ended.message.clear();
  adapter.publish_status(ended);
  if (!options.report_dir.empty()) {
    write_report(options.report_dir, loop.figures(), model, workspace.version(),
                 core::seconds(core::monotonic_ns() - start_ns), sink.hits());
  }
  return runtime::kExitDone;
}

}  // namespace phantom::phantom_sensing
