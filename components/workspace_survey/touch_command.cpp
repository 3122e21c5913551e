#include "components/workspace_survey/touch_command.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <fstream>
#include <istream>
#include <mutex>
#include <optional>
#include <ostream>

#include "common/core/text.hpp"
#include "common/messages/ask.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/process/process.hpp"
#include "components/workspace_survey/dds_adapter.hpp"
#include "components/workspace_survey/touch_report.hpp"
#include "components/workspace_survey/touch_watch.hpp"

namespace phantom::workspace_survey {
namespace {

using core::ConfigError;

constexpr double kInside_sigmas = 5.0;    // a place without touch that is so far inside the model is evidence
constexpr double kPlacesApart_m = 0.005;  // such places that lie closer together are one
constexpr std::size_t kMaxPlaces = 50;
constexpr double kKeptWait_s = 1.0;   // for places that were kept: nothing says that there are none
constexpr double kKeptReach_m = 0.1;  // a kept place that is farther from an object is of another one
constexpr double kLook_s = 0.05;      // between looks for what DDS has brought

/// What the arm felt, from the middleware's thread to the command's.
class Gathering {
 public:
  Gathering(const robot::SerialArm& arm, const TouchWatchOptions& options) : watch_(arm, options) {}

  /// Begins to take contacts with an object. `surface` must outlive this.
  void aim(std::uint16_t object, const survey::TouchSurface& surface, const geometry::Pose& X_WO) {
    const std::lock_guard lock(mutex_);
    object_ = object;
    surface_ = &surface;
    X_OW_ = X_WO.inverse();
  }
  void take(const messages::SlaveState& state, core::Nanoseconds received_ns) {
    {
      const std::lock_guard lock(mutex_);
      heard_ = true;
      if (surface_ == nullptr) return;
      const auto felt = watch_.take(state, core::seconds(received_ns), object_);
      if (felt) contacts_.push_back(*felt);
      if (!felt && !note_free_place()) return;
    }
    changed_.notify_one();
  }
  bool heard() const {
    const std::lock_guard lock(mutex_);
    return heard_;
  }

  struct Felt {
    std::vector<FeltContact> contacts;
    std::vector<survey::FreePlace> free;
  };
  /// Waits for something new; empty if nothing comes within `wait_s`.
  Felt next(double wait_s) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(wait_s),
                      [&] { return !contacts_.empty() || !free_.empty(); });
    return {std::exchange(contacts_, {}), std::exchange(free_, {})};
  }

 private:
  bool note_free_place() {
    const auto place = watch_.free_place();
    if (!place || seen_.size() >= kMaxPlaces) return false;
    const double gap_m = surface_->nearest(X_OW_ * place->p_W_m).distance_m - place->radius_m;
    if (gap_m > -kInside_sigmas * place->sigma_m) return false;
    for (const Eigen::Vector3d& seen : seen_)
      if ((seen - place->p_W_m).norm() < kPlacesApart_m) return false;
    seen_.push_back(place->p_W_m);
    free_.push_back(*place);
    return true;
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  TouchWatch watch_;
  bool heard_ = false;
  std::uint16_t object_ = 0;
  const survey::TouchSurface* surface_ = nullptr;
  geometry::Pose X_OW_;
  std::vector<FeltContact> contacts_;
  std::vector<survey::FreePlace> free_;
  std::vector<Eigen::Vector3d> seen_;
};

class TouchRun {
 public:
  TouchRun(const Request& request, const Config& config, const Workspace& workspace, std::istream& in,
           std::ostream& print)
      : request_(request),
        config_(config),
        workspace_(workspace),
        in_(in),
        print_(print),
        quiet_(request.json == "-"),
        arm_(runtime::load_arm(workspace.cell.arm(request.arm))),
        gathering_(arm_, watch_options(request, config)),
        listener_(workspace.network, messages::bounds_of(arm_),
                  [this](const messages::Received<messages::SlaveState>& state) {
                    gathering_.take(state, state.received_ns);
                  }) {
    findings_.object = request.object;
    findings_.confidence = config.options.confidence;
    findings_.voxel_size_m = workspace.voxel_size_m;
    for (const auto& object : workspace.cell.objects) {
      if (object.name != request.object) continue;
      if (object.is_zone())
        throw ConfigError("--object: '" + object.name +
                          "' is a protected zone, which nothing touches; allowed: a body");
      findings_.least_guard_vox = object.profile.guard_vox;
    }
  }

  int run() {
    if (const int code = find_object(); code != runtime::kExitDone) return code;
    gathering_.aim(id_, *surface_, model_WO_);
    say(fmt::format(
        "object:      {} (id {}), {} touches wanted; touch faces that look in different directions\n",
        request_.object, id_, request_.touches));
    if (request_.kept) take_kept();
    listen();
    if (findings_.touches.empty() && findings_.free.empty()) return nothing_felt();
    return conclude();
  }

 private:
  static TouchWatchOptions watch_options(const Request& request, const Config& config) {
    TouchWatchOptions options{.tip_radius_m = std::nullopt, .sigma_m = config.touch_sigma_m};
    if (request.tip_radius_mm) options.tip_radius_m = 1e-3 * *request.tip_radius_mm;
    return options;
  }
  void say(const std::string& text) {
    if (!quiet_) print_ << text << std::flush;
  }

  /// Waits until the object, its mesh and the arm's states have come.
  int find_object() {
    std::map<std::uint16_t, messages::WorkspaceObject> objects;
    for (double waited_s = 0.0; waited_s < request_.timeout_s; waited_s += kLook_s) {
      objects = listener_.objects();
      for (const auto& [id, object] : objects) {
        if (object.name != request_.object) continue;
        id_ = id;
        model_WO_ = object.X_WO;
        const auto mesh = listener_.mesh(object.mesh_hash);
        if (mesh) surface_.emplace(*mesh);
      }
      if (surface_ && gathering_.heard()) return runtime::kExitDone;
      gathering_.next(kLook_s);
    }
    if (objects.empty()) {
      print_ << fmt::format(
          "no object received from wva_server in domain {} for {} s; is it running, and is this its deployment?\n",
          workspace_.network.domain, request_.timeout_s);
      return runtime::kExitMissing;
    }
    if (id_ == 0)
      throw ConfigError("--object: there is no '" + request_.object + "' in the workspace; allowed: " +
                        core::listed(objects, [](const auto& entry) { return entry.second.name; }));
    print_ << (surface_ ? "no slave_state received from the arm" : "the object's mesh has not come")
           << fmt::format(" for {} s\n", request_.timeout_s);
    return runtime::kExitMissing;
  }

  /// Begins with what the arm has felt before, as far as it is near this object.
  void take_kept() {
    for (double waited_s = 0.0; waited_s < kKeptWait_s && listener_.doubts().empty(); waited_s += kLook_s)
      gathering_.next(kLook_s);
    for (const messages::ModelDoubt& doubt : listener_.doubts()) {
      const Eigen::Vector3d p_W_m = messages::eigen(doubt.position_m);
      const double gap_m = surface_->nearest(model_WO_.inverse() * p_W_m).distance_m;
      if (!doubt.located || std::abs(gap_m) > kKeptReach_m) continue;
      if (doubt.kind == percept::DoubtKind::kNoForceInside) {
        findings_.free.push_back({p_W_m, 0.0, config_.touch_sigma_m});
      } else {
        findings_.touches.push_back({p_W_m, 0.0, config_.touch_sigma_m, std::nullopt});
      }
      say(fmt::format("kept:        {} at ({:.4f} {:.4f} {:.4f}) m, {:.1f} mm {} the model\n",
                      doubt.kind == percept::DoubtKind::kNoForceInside ? "no contact" : "a contact",
                      p_W_m.x(), p_W_m.y(), p_W_m.z(), 1e3 * std::abs(gap_m),
                      gap_m < 0.0 ? "inside" : "off"));
    }
    if (findings_.touches.empty() && findings_.free.empty())
      return say("kept:        nothing near this object\n");
    correct();
    widen_guard();
  }

  bool enough() const { return static_cast<int>(findings_.touches.size()) >= request_.touches; }

  void listen() {
    while (!enough()) {
      const auto felt_now = gathering_.next(request_.wait_s);
      if (felt_now.contacts.empty() && felt_now.free.empty()) {
        say(fmt::format("no further contact for {} s\n", request_.wait_s));
        return;
      }
      follow_the_model();
      for (const survey::FreePlace& place : felt_now.free) {
        findings_.free.push_back(place);
        say(fmt::format("no contact   at ({:.4f} {:.4f} {:.4f}) m, inside the model\n", place.p_W_m.x(),
                        place.p_W_m.y(), place.p_W_m.z()));
      }
      if (!felt_now.free.empty()) correct();
      for (const FeltContact& felt : felt_now.contacts) {
        if (!felt.touch) {
          say("a contact is left out: " + felt.refusal + "\n");
          continue;
        }
        findings_.touches.push_back(*felt.touch);
        correct();
        say(touch_line(findings_));
        if (enough()) break;  // several may have come while a correction was calculated
      }
      widen_guard();
    }
  }

  /// Someone else may move the object in the model meanwhile: touches are then held against its new pose.
  void follow_the_model() {
    const auto objects = listener_.objects();
    const auto found = objects.find(id_);
    if (found == objects.end())
      throw ConfigError("'" + request_.object + "' was removed from the workspace meanwhile");
    const geometry::Pose& X_WO = found->second.X_WO;
    if (X_WO.rotation.isApprox(model_WO_.rotation) && X_WO.translation_m.isApprox(model_WO_.translation_m))
      return;
    model_WO_ = X_WO;
    gathering_.aim(id_, *surface_, model_WO_);
    say("the object was moved in the workspace meanwhile: touches are held against its new pose\n");
  }

  void correct() {
    auto correction =
        survey::correct_by_touch(*surface_, model_WO_, findings_.touches, findings_.free, config_.touch);
    if (!correction) throw ConfigError(correction.status().message());
    findings_.correction = *std::move(correction);
  }

  messages::WorkspaceCommand move_to(const geometry::Pose& X_WO, int guard_vox) const {
    messages::WorkspaceCommand command;
    command.operation = messages::WorkspaceOperation::kMove;
    command.object = request_.object;
    command.X_WO = X_WO;
    command.guard_vox = static_cast<std::uint16_t>(guard_vox);
    return command;
  }

  void widen_guard() {
    const int wanted_vox = guard_before(findings_);
    if (!findings_.correction.contradicts || wanted_vox <= std::max(guard_vox_, findings_.least_guard_vox))
      return;
    const auto reply = messages::ask(workspace_.network, "workspace_survey", move_to(model_WO_, wanted_vox),
                                     request_.timeout_s);
    if (reply && reply->outcome == messages::WorkspaceOutcome::kDone) guard_vox_ = wanted_vox;
    say(guard_vox_ == wanted_vox
            ? fmt::format("the model is contradicted: its guard is {} voxels until it is corrected\n",
                          wanted_vox)
            : "the guard is not widened: " + (reply ? reply->message : "wva_server does not answer") + "\n");
  }

  int nothing_felt() {
    print_ << "nothing was touched: the model is as it was\n";
    return runtime::kExitFailed;
  }

  int conclude() {
    const auto& c = findings_.correction;
    say(change_text(findings_));
    int code = c.refusal.empty() || !c.contradicts ? runtime::kExitDone : runtime::kExitFailed;
    bool applied = false;
    if (c.contradicts && c.refusal.empty()) {
      if (request_.apply || agreed()) {
        code = apply();
        applied = code == runtime::kExitDone;
      } else {
        say(fmt::format("not applied; the guard stays at {} voxels\n",
                        std::max(guard_vox_, findings_.least_guard_vox)));
      }
    }
    const std::string json = json_text(findings_, applied);
    if (quiet_) print_ << json;
    if (!quiet_ && !request_.json.empty() && !(std::ofstream(request_.json) << json).flush())
      throw ConfigError(request_.json.string() + ": cannot be written");
    return code;
  }

  bool agreed() {
    if (quiet_) return false;
    say("apply this change? [y/N] ");
    std::string answer;
    return std::getline(in_, answer) && (answer == "y" || answer == "Y" || answer == "yes");
  }

  int apply() {
    const auto reply =
        messages::ask(workspace_.network, "workspace_survey",
                      move_to(findings_.correction.fit.X_WO, guard_after(findings_)), request_.timeout_s);
    if (!reply) {
      print_ << fmt::format("no answer from wva_server in domain {} for {} s\n", workspace_.network.domain,
                            request_.timeout_s);
      return runtime::kExitMissing;
    }
    const bool done = reply->outcome == messages::WorkspaceOutcome::kDone;
    say((done ? "workspace:   " : "workspace refused: ") + reply->message + "\n");
    if (done) say(fmt::format("version {}\n", reply->version));
    return done ? runtime::kExitDone : runtime::kExitFailed;
  }

  const Request& request_;
  const Config& config_;
  const Workspace& workspace_;
  std::istream& in_;
  std::ostream& print_;
  bool quiet_;
  robot::SerialArm arm_;
  std::uint16_t id_ = 0;
  geometry::Pose model_WO_;
  std::optional<survey::TouchSurface> surface_;
  int guard_vox_ = 0;  // that was asked for here
  TouchFindings findings_;
  Gathering gathering_;
  SystemListener listener_;  // last: its callbacks end before what they use
};

}  // namespace

int run_touch(const Request& request, const Config& config, const Workspace& workspace, std::istream& in,
              std::ostream& print) {
  return TouchRun(request, config, workspace, in, print).run();
}

}  // namespace phantom::workspace_survey
