#include "components/wva_server/service.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <deque>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/runtime/process/process.hpp"
#include "components/wva_server/change_under_way.hpp"
#include "components/wva_server/dds_adapter.hpp"
#include "components/wva_server/following/dds_adapter_leader.hpp"
#include "components/wva_server/live/live_serving.hpp"
#include "components/wva_server/service_setup.hpp"

namespace phantom::wva_server {
namespace {

constexpr double kMaxWait_s = 0.2;     // bounds the delay of a requested stop
constexpr double kLook_s = 0.02;       // at commands and the clock, while a change is under way
constexpr double kLiveLook_s = 0.004;  // at what depth cameras see

double now_s() { return core::seconds(core::monotonic_ns()); }

/// The running server: serves one cell until a stop is requested.
class Service {
 public:
  Service(const WvaServerConfig& config, const core::NetworkOptions& network, const ServedCell& served)
      : config_(config),
        cell_(served.cell, add_limits(config), served.changes),
        carriers_(load_carriers(served.cell), config.arm, config.arm_staleness_s),
        grasps_(grasp_watch(served.cell, carriers_, config)),
        adapter_(network, refusal_of(config, served)),
        changes_file_(served.changes_file),
        report_(served.report) {
    if (served.leader) leader_.emplace(network, *served.leader);
  }

  void run(std::vector<runtime::CellBody> bodies) {
    if (const robot::SerialArm* arm = carriers_.followed(); arm != nullptr) adapter_.follow(*arm);
    if (grasps_.has_gripper()) adapter_.follow_gripper();
    if (config_.live.wanted())
      live_.emplace(live_rules(config_.live, cell_.cell()), cell_, adapter_, config_.threads);
    report_progress(0.0, "activating the workspace");
    if (!activate(std::move(bodies))) return;
    leave_report();
    while (!runtime::stop_requested()) {
      if (now_s() >= next_report_s_) report_serving();
      if (change_) {
        if (change_->wait(kLook_s)) finish_change();
        if (const auto command = adapter_.next_command(0.0)) take(*command);
      } else if (live_ && (live_turn_ || waiting_.empty()) && live_->is_due(core::monotonic_ns())) {
        serve_live();
      } else if (!waiting_.empty()) {
        begin_change();
      } else if (const auto grasp = watch_gripper()) {
        take(*grasp);
      } else if (const auto difference = follow()) {
        take(*difference);
      } else if (const auto command =
                     adapter_.next_command(std::clamp(next_report_s_ - now_s(), 0.0, longest_wait_s()))) {
        take(*command);
      }
    }
    change_.reset();  // ends it
    leave_report();
    core::Health stopped = health("stopped on request", 1.0);
    stopped.state = core::ComponentState::kStopped;
    adapter_.report(stopped);
  }

 private:
  bool activate(std::vector<runtime::CellBody> bodies);
  layers::WorkspaceChange first_version(const layers::WorkspaceChange& activated) const;
  void take(const WorkspaceCommand& command);
  double longest_wait_s() const {
    return live_ ? kLiveLook_s : grasps_.has_gripper() || leader_ ? kLook_s : kMaxWait_s;
  }
  void serve_live();
  std::optional<WorkspaceCommand> watch_gripper();
  std::optional<WorkspaceCommand> follow();
  void look_at_arm();
  void end_add(const WorkspaceCommand& add, const std::string& doing, const WorkspaceCommand& later);
  void begin_change();
  bool decide_live(const WorkspaceCommand& command);
  void finish_change();
  bool publish_bricks(const layers::WorkspaceChange& change, const std::string& doing);
  void publish(const WorkspaceCommand& command, CellChange change);
  void refuse(const WorkspaceCommand& command, const std::string& doing, const std::string& why);
  void report_serving();
  void note_figures();
  std::string keep_changes();
  layers::ActivationOptions options(const std::string& doing);
  std::uint64_t next_version() const;
  core::Health health(const std::string& doing, double progress) const;
  void report_progress(double share, const std::string& doing);
  void report(const core::Health& health);
  void leave_report() const;

  const WvaServerConfig& config_;
  LiveCell cell_;
  Carriers carriers_;
  GraspWatch grasps_;
  ArmSample arm_;  // the newest state
  DdsAdapter adapter_;
  std::filesystem::path changes_file_, report_;
  double build_s_ = 0.0, next_report_s_ = 0.0;
  double begun_s_ = 0.0;  // when the change under way began
  std::size_t changes_ = 0;
  std::vector<core::HealthFigure> figures_;  // of the cell between two changes
  std::string published_;                    // likewise, in words
  std::uint64_t version_ = 0;                // likewise
  std::deque<WorkspaceCommand> waiting_;
  std::optional<ChangeUnderWay> change_;
  std::optional<LeaderAdapter> leader_;
  LeaderObjects leader_objects_;  // newest
  Following following_;
  std::optional<LiveServing> live_;
  bool degraded_ = false;   // by the newest report
  bool live_turn_ = false;  // a command was carried out since live matter was served
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
  for (const auto& [id, object] : cell_.objects()) {
    if (!object.carrier) continue;
    spdlog::info("{}: carried by arm '{}' at its link '{}'", object.config.name, object.carrier->arm,
                 object.carrier->frame);
    adapter_.publish_object(object, config_.mesh_chunk_bytes);
  }
  if (live_) live_->begin(next_version());
  if (!publish_bricks(first_version(*change), "publishing the workspace")) return false;
  note_figures();
  const workspace::Workspace& workspace = cell_.workspace();
  spdlog::info(
      "workspace of cell {}: {} objects, {} bricks, {:.1f} MiB, built in {:.2f} s; "
      "version {} published {:.2f} s after the start",
      cell_.cell().name, cell_.objects().size(), workspace.brick_count(),
      static_cast<double>(workspace.bytes()) / (1 << 20), build_s_, workspace.version, now_s() - from_s);
  return true;
}

/// Returns the change that the first version to be published is: all bricks that there are.
layers::WorkspaceChange Service::first_version(const layers::WorkspaceChange& activated) const {
  layers::WorkspaceChange first = activated;
  first.version = cell_.workspace().version;
  first.changed = cell_.workspace().bricks();
  return first;
}

/// Between two commands live matter has its turn, so that neither waits for the other for long.
void Service::serve_live() {
  live_turn_ = false;
  if (live_->step(core::monotonic_ns(), next_version())) note_figures();
}

/// Takes a command, to be carried out after those before it. A change that it overtakes is ended. An object
/// that waits to be added and is to be removed is not added at all.
void Service::take(const WorkspaceCommand& command) {
  if (change_ && change_->is_overtaken_by(command)) change_->end();
  const auto adds_it = [&](const WorkspaceCommand& earlier) {
    return command.operation == WorkspaceOperation::kRemove && !command.object.empty() &&
           earlier.operation == WorkspaceOperation::kAdd && cell_.name_in(earlier) == command.object;
  };
  const auto earlier = std::find_if(waiting_.begin(), waiting_.end(), adds_it);
  if (earlier == waiting_.end()) return waiting_.push_back(command);
  end_add(*earlier, "add '" + command.object + "'", command);
  waiting_.erase(earlier);
}

/// Answers the command to add an object, which a later one has ended, and that one.
void Service::end_add(const WorkspaceCommand& add, const std::string& doing, const WorkspaceCommand& later) {
  refuse(add, doing, "was ended by a later command for the same object");
  adapter_.reply(later, {.object = later.object,
                         .outcome = messages::WorkspaceOutcome::kDone,
                         .message = "ended what was to " + doing + ": it was not added",
                         .version = version_});
}

void Service::look_at_arm() {
  if (adapter_.newest_arm(arm_)) carriers_.take(arm_);
}

/// Returns what follows from the gripper's newest state. The workspace must not be changing.
std::optional<WorkspaceCommand> Service::watch_gripper() {
  GripperSample gripper;
  if (!grasps_.has_gripper() || !adapter_.newest_gripper(gripper)) return std::nullopt;
  look_at_arm();
  const auto X_WL = carriers_.link_poses(core::monotonic_ns());
  if (!X_WL) return std::nullopt;  // what it does meanwhile is seen once the arm is heard
  return grasps_.step(gripper, *X_WL, cell_);
}

/// Returns what follows from the leader's objects. The workspace must not be changing.
std::optional<WorkspaceCommand> Service::follow() {
  if (!leader_) return std::nullopt;
  if (auto newest = leader_->take()) leader_objects_ = *std::move(newest);
  const auto command =
      following_.next(leader_objects_, cell_, [this](std::uint64_t hash) { return leader_->mesh(hash); });
  if (command && command->operation == WorkspaceOperation::kAdd) cell_.prefer_id(command->id);
  return command;
}

void Service::begin_change() {
  begun_s_ = now_s();
  const WorkspaceCommand asked = std::move(waiting_.front());
  waiting_.pop_front();
  if (decide_live(asked)) return;
  look_at_arm();
  const auto completed = carriers_.complete(asked, cell_, core::monotonic_ns());
  if (!completed)
    return refuse(asked, fmt::format("{} '{}'", name_of(asked.operation), cell_.name_in(asked)),
                  completed.status().message());
  const WorkspaceCommand& command = *completed;
  layers::ActivationOptions options;
  options.threads = config_.threads;
  options.stopwatch = now_s;
  change_.emplace(cell_, command, next_version(), std::move(options), runtime::stop_requested);
}

/// Carries out what a person decides about what cameras see. Returns whether the command was about that.
bool Service::decide_live(const WorkspaceCommand& command) {
  const auto id = live_ ? live_->subject(command) : std::nullopt;
  if (!id) return false;
  const auto decided = live_->decide(command, *id, core::monotonic_ns());
  if (!decided) {
    const std::string& name = command.object.empty() ? messages::live_name(*id) : command.object;
    refuse(command, fmt::format("{} '{}'", name_of(command.operation), name), decided.status().message());
    return true;
  }
  const std::uint64_t version = next_version();
  const bool is_new = live_->step(core::monotonic_ns(), version);
  if (is_new) note_figures();
  const messages::WorkspaceReply reply{.object = command.object,
                                       .id = *id,
                                       .outcome = messages::WorkspaceOutcome::kDone,
                                       .message = *decided,
                                       .version = version_,
                                       .changed_bricks = is_new ? live_->figures().changed_bricks : 0,
                                       .removed_bricks = is_new ? live_->figures().removed_bricks : 0,
                                       .seconds = now_s() - begun_s_};
  adapter_.reply(command, reply);
  if (adapter_.is_logged(reply.outcome)) spdlog::info("{} (asked by {})", reply.message, command.requester);
  return true;
}

void Service::finish_change() {
  const WorkspaceCommand command = change_->command();
  const std::string doing = change_->doing();
  const bool was_ended = change_->was_ended();
  auto change = change_->take();
  // A command to remove what was being added is done with that.
  const auto overtaking =
      std::find_if(waiting_.begin(), waiting_.end(),
                   [this](const WorkspaceCommand& later) { return change_->is_overtaken_by(later); });
  change_.reset();
  live_turn_ = true;
  if (change) {
    if (live_) live_->model_changed();
    publish(command, *std::move(change));
  } else if (!was_ended) {
    refuse(command, doing, change.status().message());
  } else if (command.operation == WorkspaceOperation::kAdd && overtaking != waiting_.end()) {
    end_add(command, doing, *overtaking);
    waiting_.erase(overtaking);
  } else {
    refuse(command, doing, "was ended by a later command for the same object");
  }
  note_figures();
  report(health("", 1.0));
}

/// Reports meanwhile. Returns false if a stop was requested: then no version tells of the bricks that went
/// out, and who asked is not answered.
bool Service::publish_bricks(const layers::WorkspaceChange& change, const std::string& doing) {
  return adapter_.publish_change(cell_, change, config_.threads, [&] {
    report_progress(1.0, doing);
    return !runtime::stop_requested();
  });
}

void Service::publish(const WorkspaceCommand& command, CellChange change) {
  // Kept before anybody sees it: whatever ends the server, its successor never has an object where it is not.
  std::string lost = keep_changes();
  if (command.operation == WorkspaceOperation::kAttach && changes_file_.empty())
    lost += "; a restarted wva_server will not have it, since this one runs without --keep-changes";
  // A viewer that draws it in the arm until the version comes draws it where it stands from then on.
  if (command.operation == WorkspaceOperation::kRelease)
    adapter_.publish_object(cell_.objects().at(change.id), config_.mesh_chunk_bytes);
  if (!publish_bricks(change.workspace, "publishing: " + change.message)) return;
  if (command.operation == WorkspaceOperation::kRemove) {
    adapter_.withdraw_object(change.id);
  } else if (command.operation == WorkspaceOperation::kAdd ||
             command.operation == WorkspaceOperation::kMove) {
    adapter_.publish_object(cell_.objects().at(change.id), config_.mesh_chunk_bytes);
  }
  ++changes_;
  if (command.operation == WorkspaceOperation::kAdd) warn_of(cell_.objects().at(change.id));
  const messages::WorkspaceReply reply{
      .object = change.name,
      .id = change.id,
      .outcome = messages::WorkspaceOutcome::kDone,
      .message = change.message + lost,
      .version = change.workspace.version,
      .changed_bricks = static_cast<std::uint32_t>(change.workspace.changed.size()),
      .removed_bricks = static_cast<std::uint32_t>(change.workspace.removed.size()),
      .seconds = now_s() - begun_s_};
  adapter_.reply(command, reply);
  if (!adapter_.is_logged(reply.outcome)) return;
  spdlog::info("{} (asked by {}): {} bricks changed, {} removed; version {} published after {:.0f} ms",
               reply.message, command.requester, reply.changed_bricks, reply.removed_bricks, reply.version,
               1e3 * reply.seconds);
}

void Service::refuse(const WorkspaceCommand& command, const std::string& doing, const std::string& why) {
  if (Following::is_own(command)) following_.refused(why);
  adapter_.reply(command, {.object = command.object,
                           .id = command.id,
                           .outcome = messages::WorkspaceOutcome::kRefused,
                           .message = why,
                           .seconds = now_s() - begun_s_});
  if (adapter_.is_logged(messages::WorkspaceOutcome::kRefused))
    spdlog::warn("refused to {} (asked by {}): {}", doing, command.requester, why);
}

/// Reports how far the change under way is, also to who asked for it.
void Service::report_serving() {
  if (!change_) return report(health("", 1.0));
  const double share = change_->share();
  if (now_s() - begun_s_ > 0.5)
    adapter_.notify(change_->command(), fmt::format("is being carried out: {:.0f} %", 1e2 * share));
  report(health(change_->doing(), share));
}

void Service::note_figures() {
  const workspace::Workspace& workspace = cell_.workspace();
  const auto figure = [](const char* name, auto value, const char* unit) {
    return core::HealthFigure{name, static_cast<double>(value), unit};
  };
  version_ = workspace.version;
  published_ = fmt::format("{} objects are published", cell_.objects().size());
  for (const messages::CarriedObject& carried : cell_.carried())
    published_ +=
        fmt::format("; arm '{}' carries {}", carried.arm, cell_.objects().at(carried.id).config.name);
  figures_ = {figure("version", workspace.version, ""),      figure("objects", cell_.objects().size(), ""),
              figure("bricks", workspace.brick_count(), ""), figure("bytes", workspace.bytes(), "B"),
              figure("build_seconds", build_s_, "s"),        figure("changes", changes_, "")};
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
  core::Health health{
      core::ComponentState::kRunning, doing.empty() ? published_ : doing, {}, {{"progress", progress, ""}}};
  if (figures_.empty()) health.state = core::ComponentState::kStarting;
  health.figures.insert(health.figures.end(), figures_.begin(), figures_.end());
  if (leader_ && !leader_->is_heard()) health.message += "; the wva_server that it follows is not heard";
  if (const std::string faults = following_.faults(); !faults.empty()) {
    if (health.state == core::ComponentState::kRunning) health.state = core::ComponentState::kDegraded;
    health.message += "; OBJECTS DO NOT FOLLOW the other wva_server's: " + faults;
  }
  return live_ ? live_->told(std::move(health), core::monotonic_ns()) : health;
}

void Service::report_progress(double share, const std::string& doing) {
  if (now_s() >= next_report_s_) report(health(doing, share));
}

void Service::report(const core::Health& health) {
  adapter_.report(health);
  const bool is_degraded = health.state == core::ComponentState::kDegraded;
  if (is_degraded && !degraded_) spdlog::warn("degraded: {}", health.message);
  if (!is_degraded && degraded_) spdlog::info("no longer degraded: {}", health.message);
  degraded_ = is_degraded;
  next_report_s_ = now_s() + 1.0 / config_.status_rate_hz;
}

void Service::leave_report() const {
  if (report_.empty()) return;
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
  nlohmann::json report = {
      {"cell", cell_.cell().name},  {"version", workspace.version}, {"bricks", workspace.brick_count()},
      {"bytes", workspace.bytes()}, {"build_seconds", build_s_},    {"changes", changes_},
      {"objects", objects}};
  if (live_) report["live"] = report_of(live_->figures());
  std::filesystem::create_directories(report_.parent_path());
  std::ofstream(report_) << report.dump(2) << '\n';
}

}  // namespace

void run_service(const WvaServerConfig& config, const core::NetworkOptions& network, ServedCell served) {
  Service(config, network, served).run(std::move(served.bodies));
}

}  // namespace phantom::wva_server
