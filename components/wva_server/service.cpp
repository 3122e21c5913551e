#include "components/wva_server/service.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/runtime/process.hpp"
#include "components/wva_server/dds_adapter.hpp"

namespace phantom::wva_server {
namespace {

constexpr double kLongestWait_s = 0.2;  // bounds the delay of a requested stop

double now_s() { return core::seconds(core::monotonic_ns()); }

void warn_of(const ServedObject& object) {
  for (const std::string& note : object.notes) spdlog::warn("{}: {}", object.config.name, note);
  if (!object.report.mesh.closed)
    spdlog::warn("{}: the mesh is not closed; check the activated shape", object.config.name);
}

/// The running server: serves one cell until a stop is requested.
class Service {
 public:
  Service(const WvaServerConfig& config, const core::NetworkOptions& network, const ServedCell& served)
      : config_(config),
        cell_(served.cell, {config.mesh_import, config.max_voxel_bytes}, served.changes),
        adapter_(network, config.accept_commands),
        changes_file_(served.changes_file),
        report_dir_(served.report_dir) {}

  void run(std::vector<runtime::CellBody> bodies) {
    report_progress(0.0, "activating the workspace");
    if (!activate(std::move(bodies))) return;
    leave_report();
    while (!runtime::stop_requested()) {
      if (now_s() >= next_report_s_) report(health("", 1.0));
      const double wait_s = std::clamp(next_report_s_ - now_s(), 0.0, kLongestWait_s);
      if (const auto request = adapter_.next_command(wait_s)) carry_out(*request);
    }
    leave_report();
    core::Health stopped = health("stopped on request", 1.0);
    stopped.state = core::ComponentState::kStopped;
    adapter_.report(stopped);
  }

 private:
  bool activate(std::vector<runtime::CellBody> bodies);
  void carry_out(const Request& request);
  std::string keep_changes();
  layers::ActivationOptions options(const std::string& doing);
  std::uint64_t next_version() const;
  core::Health health(const std::string& doing, double progress) const;
  void report_progress(double share, const std::string& doing);
  void report(const core::Health& health);
  void leave_report() const;

  const WvaServerConfig& config_;
  LiveCell cell_;
  DdsAdapter adapter_;
  std::filesystem::path changes_file_, report_dir_;
  double build_s_ = 0.0, next_report_s_ = 0.0;
  std::size_t changes_ = 0;
};

/// Returns milliseconds since 1970, or more where that would not rise. Versions rise across restarts, too, so
/// that consumers can tell bricks of a server that has ended from this server's.
std::uint64_t Service::next_version() const {
  const auto now_ms = static_cast<std::uint64_t>(core::utc_ns() / core::kNsPerMillisecond);
  return std::max(now_ms, cell_.workspace().version + 1);
}

layers::ActivationOptions Service::options(const std::string& doing) {
  layers::ActivationOptions options;
  options.threads = config_.threads;
  options.stopwatch = now_s;
  options.keep_going = [] { return !runtime::stop_requested(); };
  options.on_progress = [this, doing](double share) { report_progress(share, doing); };
  return options;
}

bool Service::activate(std::vector<runtime::CellBody> bodies) {
  const double from_s = now_s();
  const std::size_t all = bodies.size();
  const auto on_object = [&](const ServedObject& object, std::size_t done) {
    spdlog::info("{} of {}: {}", done, all, describe(object));
    warn_of(object);
    // Viewers show it while the others are activated.
    adapter_.publish_object(object, config_.mesh_chunk_bytes);
    report_progress(static_cast<double>(done) / static_cast<double>(all),
                    fmt::format("activated {} of {} objects", done, all));
  };
  const auto change =
      cell_.activate(std::move(bodies), next_version(), options("activating the workspace"), on_object);
  if (!change && runtime::stop_requested()) return false;
  if (!change) throw core::ConfigError("object " + change.status().message());
  build_s_ = now_s() - from_s;
  adapter_.publish_change(cell_, *change, config_.threads);
  const workspace::Workspace& workspace = cell_.workspace();
  spdlog::info(
      "workspace of cell {}: {} objects, {} bricks, {:.1f} MiB, built in {:.2f} s; "
      "version {} published {:.2f} s after the start",
      cell_.cell().name, cell_.objects().size(), workspace.brick_count(),
      static_cast<double>(workspace.bytes()) / (1 << 20), build_s_, workspace.version, now_s() - from_s);
  return true;
}

void Service::carry_out(const Request& request) {
  const double from_s = now_s();
  const CellCommand& command = request.command;
  const std::string doing = fmt::format("{} {}", name_of(command.operation),
                                        command.object.empty() ? "an object" : "'" + command.object + "'");
  const auto change = cell_.apply(command, next_version(), options(doing));
  Reply reply;
  reply.object = command.object;
  reply.object_id = command.id;
  if (change) {
    adapter_.publish_change(cell_, change->workspace, config_.threads);
    if (command.operation == Operation::kRemove) {
      adapter_.withdraw_object(change->id);
    } else {
      adapter_.publish_object(cell_.objects().at(change->id), config_.mesh_chunk_bytes);
    }
    ++changes_;
    if (command.operation == Operation::kAdd) warn_of(cell_.objects().at(change->id));
    const std::string said = change->said + keep_changes();
    reply = {Outcome::kDone,
             said,
             change->id,
             change->name,
             change->workspace.version,
             change->workspace.changed.size(),
             change->workspace.removed.size(),
             0.0};
  } else {
    reply.outcome = Outcome::kRefused;
    reply.message = change.status().message();
  }
  reply.seconds = now_s() - from_s;
  adapter_.reply(request, reply);
  if (change) {
    spdlog::info("{} (asked by {}): {} bricks changed, {} removed; version {} published after {:.0f} ms",
                 reply.message, request.requester, reply.changed_bricks, reply.removed_bricks, reply.version,
                 1e3 * reply.seconds);
  } else {
    spdlog::warn("refused to {} (asked by {}): {}", doing, request.requester, reply.message);
  }
  report(health("", 1.0));
}

/// Writes the changes to their file. Returns an addition to the reply if that fails, otherwise "".
std::string Service::keep_changes() {
  if (changes_file_.empty()) return "";
  try {
    write_changes(cell_.changes(), cell_.cell(), changes_file_);
    return "";
  } catch (const std::exception& problem) {
    spdlog::error("{}", problem.what());
    return std::string("; it will be lost when wva_server ends: ") + problem.what();
  }
}

core::Health Service::health(const std::string& doing, double progress) const {
  const workspace::Workspace& workspace = cell_.workspace();
  if (workspace.version == 0)
    return {core::ComponentState::kStarting, doing, {}, {{"progress", progress, ""}}};
  const auto figure = [](const char* name, auto value, const char* unit) {
    return core::HealthFigure{name, static_cast<double>(value), unit};
  };
  return {core::ComponentState::kRunning,
          doing.empty() ? fmt::format("{} objects in {} bricks are published", cell_.objects().size(),
                                      workspace.brick_count())
                        : doing,
          {},
          {figure("progress", progress, ""), figure("version", workspace.version, ""),
           figure("objects", cell_.objects().size(), ""), figure("bricks", workspace.brick_count(), ""),
           figure("bytes", workspace.bytes(), "B"), figure("build_seconds", build_s_, "s"),
           figure("changes", changes_, "")}};
}

void Service::report_progress(double share, const std::string& doing) {
  if (now_s() >= next_report_s_) report(health(doing, share));
}

void Service::report(const core::Health& health) {
  adapter_.report(health);
  next_report_s_ = now_s() + 1.0 / config_.status_rate_hz;
}

void Service::leave_report() const {
  if (report_dir_.empty()) return;
  nlohmann::json objects = nlohmann::json::array();
  for (const auto& [id, object] : cell_.objects()) {
    objects.push_back({{"id", id},
                       {"name", object.config.name},
                       {"triangles", object.report.mesh.triangles},
                       {"closed", object.report.mesh.closed},
                       {"boundary_voxels", object.report.boundary_voxels},
                       {"interior_voxels", object.report.interior_voxels}});
  }
  const workspace::Workspace& workspace = cell_.workspace();
  const nlohmann::json report = {
      {"cell", cell_.cell().name},  {"version", workspace.version}, {"bricks", workspace.brick_count()},
      {"bytes", workspace.bytes()}, {"build_seconds", build_s_},    {"changes", changes_},
      {"objects", objects}};
  std::filesystem::create_directories(report_dir_);
  std::ofstream(report_dir_ / "wva_server.json") << report.dump(2) << '\n';
}

}  // namespace

ServedCell load_served_cell(const std::filesystem::path& cell_file, const std::filesystem::path& changes_file,
                            const geometry::MeshImportOptions& limits) {
  ServedCell served;
  served.cell = runtime::load_cell(cell_file, runtime::CellArms::kOptional);
  served.changes = no_changes(served.cell);
  served.changes_file = changes_file;
  if (!changes_file.empty()) {
    const auto folder = std::filesystem::absolute(changes_file).parent_path();
    if (!std::filesystem::is_directory(folder)) {
      throw core::MissingError("--keep-changes: " + changes_file.string() + ": there is no folder " +
                               folder.string() + " to keep it in");
    }
    if (auto kept = read_changes(served.cell, changes_file)) served.changes = std::move(*kept);
  }
  apply(served.changes, served.cell);
  if (!served.changes.objects.empty()) {
    spdlog::info("differing from the cell file, as commands left them: {} ({})",
                 served.changes.objects.size(), changes_file.string());
  }
  served.bodies = runtime::load_bodies(served.cell, limits);
  return served;
}

void run_service(const WvaServerConfig& config, const core::NetworkOptions& network, ServedCell served) {
  Service(config, network, served).run(std::move(served.bodies));
}

}  // namespace phantom::wva_server
