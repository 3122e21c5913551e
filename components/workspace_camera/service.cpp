#include "components/workspace_camera/service.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "common/core/clock.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/runtime/process/process.hpp"
#include "common/runtime/process/spread_json.hpp"
#include "components/workspace_camera/dds_adapter.hpp"
#include "components/workspace_camera/held_images.hpp"
#include "components/workspace_camera/local_cameras.hpp"
#include "components/workspace_camera/model_watch.hpp"
#include "components/workspace_camera/workspace_camera.hpp"

namespace phantom::workspace_camera {
namespace {

constexpr double kMaxWait_s = 0.05;    // bounds the delay of a requested stop
constexpr double kHeldWait_s = 0.002;  // while an image waits for the arm's states
constexpr core::Nanoseconds kMaxHold_ns = 60 * core::kNsPerMillisecond;
constexpr core::Nanoseconds kViewPeriod_ns = 500 * core::kNsPerMillisecond;

std::vector<ModelObject> objects_of(const LoadedCell& loaded) {
  std::vector<ModelObject> objects;
  for (std::size_t i = 0; i < loaded.cell.objects.size(); ++i)
    objects.push_back({loaded.cell.objects[i].id, loaded.cell.objects[i].name, loaded.meshes[i].second});
  return objects;
}

messages::PoseFinding message_of(const PoseFinding& finding) {
  messages::PoseFinding message;
  message.id = finding.id;
  message.X_WO = finding.X_WO;
  message.corrected_WO = finding.X_WO;
  switch (finding.verdict) {
    case PoseVerdict::kUnseen:
    case PoseVerdict::kAgrees:
      message.verdict = messages::PoseVerdict::kAgrees;
      break;
    case PoseVerdict::kGone:
      message.verdict = messages::PoseVerdict::kGone;
      break;
    case PoseVerdict::kUnclear:
      message.verdict = messages::PoseVerdict::kUnclear;
      break;
    case PoseVerdict::kElsewhere:
      message.verdict = messages::PoseVerdict::kElsewhere;
      message.corrected_WO = finding.corrected_WO;
      message.shift_m = finding.shift_m.norm();
      message.turn_rad = finding.turned_rad;
      message.residual_m = finding.residual_m;
      message.unseen = fmt::format("{}", fmt::join(finding.open, ", "));
  }
  return message;
}

bool says_the_same(const messages::PoseFinding& a, const messages::PoseFinding& b) {
  return a.verdict == b.verdict && a.camera == b.camera && a.unseen == b.unseen &&
         geometry::same_pose(a.X_WO, b.X_WO) && geometry::same_pose(a.corrected_WO, b.corrected_WO);
}

/// What the report tells.
struct Tally {
  std::uint64_t samples = 0, whole = 0, unsent = 0;
  std::vector<float> age_ms;          // of the image that a change rests on, when it was sent
  std::vector<float> fuse_ms;         // what an image took: drawing the arm, and fusing
  std::vector<std::uint32_t> blocks;  // that a change had
  static constexpr std::size_t kMaxValues = 500'000;
};

class Service {
 public:
  Service(const WorkspaceCameraConfig& config, const core::NetworkOptions& network, LoadedCell loaded,
          const std::string& name)
      : config_(config),
        loaded_(std::move(loaded)),
        camera_(config, name, loaded_.cell.name, runtime::grid_of(loaded_.cell), loaded_.arm.get(), history_),
        local_(config, loaded_, history_),
        held_(config.cameras.size(), kMaxHold_ns) {
    std::vector<std::string> heard;
    for (std::size_t i = 0; i < config.cameras.size(); ++i) {
      if (config.cameras[i].driver != CameraDriver::kTopic) continue;
      heard.push_back(config.cameras[i].name);
      heard_.push_back(i);
    }
    if (config.pose_check.every_s > 0.0) {
      std::vector<std::optional<geometry::Pose>> places;
      for (const runtime::ObjectConfig& object : loaded_.cell.objects) places.emplace_back(object.X_WO);
      model_.emplace(config, objects_of(loaded_), std::move(places));
    }
    adapter_.emplace(network, name, heard, loaded_.arm ? &loaded_.arm->arm() : nullptr, history_);
  }

  void run(const std::filesystem::path& report_dir) {
    spdlog::info("fuses {} cameras, {} of them simulated, in cell {}", config_.cameras.size(),
                 local_.simulated(), loaded_.cell.name);
    local_.start([this] { adapter_->wake(); });
    while (!runtime::stop_requested()) {
      take_carried();
      take_objects();
      local_.take_due([this](const CameraImage& image) { fuse(image); });
      hold_arrived();
      held_.release(loaded_.arm ? history_.newest_ns() : std::numeric_limits<core::Nanoseconds>::max(),
                    core::monotonic_ns(), [this](const ArrivedImage& image) {
                      fuse({image.camera, image.pinhole, image.exposed_ns, image.depth_mm});
                    });
      const core::Nanoseconds now_ns = core::monotonic_ns();
      const bool changed = camera_.watch(now_ns);
      publish(now_ns, changed);
      publish_view(now_ns);
      if (changed || now_ns >= next_report_ns_) report(now_ns);
    }
    core::Health last = camera_.health(core::monotonic_ns());
    last.state = core::ComponentState::kStopped;
    last.message = "stopped on request";
    adapter_->report(last);
    if (!report_dir.empty()) leave_report(report_dir);
  }

 private:
  double wait_s() const {
    core::Nanoseconds due_ns = std::min(next_report_ns_, sent_ns_ + core::from_seconds(config_.heartbeat_s));
    due_ns = std::min(due_ns, local_.due_ns());
    return std::clamp(core::seconds(due_ns - core::monotonic_ns()), 0.0,
                      held_.any() ? kHeldWait_s : kMaxWait_s);
  }

  /// An object that was added by a command has a mesh that is not of the cell file: it is not masked.
  void take_carried() {
    const auto carried = adapter_->carried();
    if (!carried) return;
    std::set<std::uint16_t> ids;
    for (const messages::CarriedObject& object : *carried) ids.insert(object.id);
    if (model_) model_->set_carried(ids);
    if (!loaded_.arm) return;
    std::vector<LinkPart> parts;
    for (const messages::CarriedObject& object : *carried) {
      const auto frame = loaded_.arm->arm().find_frame(object.frame);
      const bool own = config_.arm.empty() || object.arm == config_.arm;
      const auto mesh = std::ranges::find(loaded_.meshes, object.mesh_hash,
                                          &std::pair<std::uint64_t, geometry::TriangleMesh>::first);
      if (!own || !frame || mesh == loaded_.meshes.end()) continue;
      parts.push_back({frame->first, frame->second * object.X_FO, mesh->second});
    }
    loaded_.arm->set_carried(std::move(parts));
  }

  void take_objects() {
    for (const messages::WorkspaceObject& object : adapter_->objects())
      if (model_) model_->place(object.id, place_in_model(object));
  }
  /// Another object that has an id of the cell file's has another mesh.
  std::optional<geometry::Pose> place_in_model(const messages::WorkspaceObject& object) const {
    for (std::size_t i = 0; i < loaded_.cell.objects.size(); ++i)
      if (loaded_.cell.objects[i].id == object.id && loaded_.meshes[i].first == object.mesh_hash)
        return object.X_WO;
    return std::nullopt;
  }

  /// Takes the images that have come. Of each camera the newest counts.
  void hold_arrived() {
    for (auto image = adapter_->next_image(wait_s()); image; image = adapter_->next_image(0.0)) {
      const std::size_t camera = heard_[image->camera];
      held_.hold({camera,
                  {static_cast<int>(image->width), static_cast<int>(image->height), image->fx_px,
                   image->fy_px, image->cx_px, image->cy_px, image->min_depth_m, image->max_depth_m},
                  image->received_ns - core::from_seconds(image->age_s),
                  image->received_ns,
                  std::move(image->depth_mm)});
    }
    for (ArrivedImage& image : local_.arrived()) held_.hold(std::move(image));
  }

  void fuse(const CameraImage& image) {
    const core::Nanoseconds from_ns = core::monotonic_ns();
    if (!camera_.take(image, from_ns)) return;
    if (model_ && model_->take(image.camera, camera_.image(), camera_.arm_depth_m(), from_ns))
      next_report_ns_ = 0;
    if (tally_.fuse_ms.size() < Tally::kMaxValues)
      tally_.fuse_ms.push_back(static_cast<float>(1e3 * core::seconds(core::monotonic_ns() - from_ns)));
  }

  void publish(core::Nanoseconds now_ns, bool state_changed) {
    const bool heartbeat = now_ns - sent_ns_ >= core::from_seconds(config_.heartbeat_s);
    const bool newcomer = adapter_->has_newcomer();
    if (!camera_.has_changes() && !heartbeat && !state_changed && !newcomer) return;
    const bool whole =
        must_be_whole_ || newcomer || now_ns - whole_ns_ >= core::from_seconds(config_.whole_every_s);
    const messages::OccupancyChange change = camera_.change(whole, now_ns);
    must_be_whole_ = !adapter_->publish(change);
    sent_ns_ = now_ns;
    if (whole) whole_ns_ = now_ns;
    ++tally_.samples;
    tally_.whole += whole ? 1 : 0;
    tally_.unsent += must_be_whole_ ? 1 : 0;
    if (whole || change.blocks.empty() || tally_.blocks.size() >= Tally::kMaxValues) return;
    tally_.blocks.push_back(static_cast<std::uint32_t>(change.blocks.size()));
    if (change.image_age_s >= 0.0) tally_.age_ms.push_back(static_cast<float>(1e3 * change.image_age_s));
  }

  void publish_view(core::Nanoseconds now_ns) {
    if (now_ns < next_view_ns_) return;
    next_view_ns_ = now_ns + kViewPeriod_ns;
    adapter_->publish(camera_.space_view(now_ns));
  }

  void report(core::Nanoseconds now_ns) {
    core::Health health = camera_.health(now_ns);
    if (model_) {
      const auto sentences = model_->sentences();
      health.figures.push_back({"wrong_poses", static_cast<double>(sentences.size()), ""});
      complain(health, sentences);
      publish_findings();
    }
    complain(health, local_.troubles());
    if (health.message != said_) {
      const bool degraded = health.state == core::ComponentState::kDegraded;
      spdlog::log(degraded ? spdlog::level::warn : spdlog::level::info, "{}", said_ = health.message);
    }
    adapter_->report(health);
    next_report_ns_ = now_ns + core::from_seconds(1.0 / config_.status_rate_hz);
  }

  static void complain(core::Health& health, const std::vector<std::string>& sentences) {
    if (sentences.empty()) return;
    if (health.state == core::ComponentState::kRunning) health.message.clear();
    for (const std::string& one : sentences) health.message += (health.message.empty() ? "" : "; ") + one;
    health.state = core::ComponentState::kDegraded;
  }

  /// Publishes what has become different. What is no longer known, because the object was moved or the camera
  /// was knocked, holds until it is known again.
  void publish_findings() {
    std::map<std::uint16_t, messages::PoseFinding> known;
    for (const ConfirmedFinding& one : model_->findings()) {
      messages::PoseFinding finding = message_of(one.finding);
      finding.camera = config_.cameras[one.camera].name;
      const auto before = findings_.find(finding.id);
      if (before == findings_.end() || !says_the_same(before->second, finding)) adapter_->publish(finding);
      known.emplace(finding.id, std::move(finding));
    }
    findings_ = std::move(known);
  }

  void leave_report(const std::filesystem::path& folder) const {
    const nlohmann::ordered_json report{{"cell", loaded_.cell.name},
                                        {"images", camera_.fused_images()},
                                        {"samples", tally_.samples},
                                        {"whole_samples", tally_.whole},
                                        {"fuse_ms", runtime::spread_json(tally_.fuse_ms)},
                                        {"image_to_change_ms", runtime::spread_json(tally_.age_ms)},
                                        {"blocks_changed", runtime::spread_json(tally_.blocks)},
                                        {"fusion_bytes", camera_.fusion().bytes()}};
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "workspace_camera.json") << report.dump(2) << '\n';
  }

  const WorkspaceCameraConfig& config_;
  LoadedCell loaded_;
  ArmHistory history_;
  WorkspaceCamera camera_;
  std::vector<std::size_t> heard_;   // cameras of depth_image, by their place in the adapter
  std::optional<ModelWatch> model_;  // none: poses are not checked
  std::optional<DdsAdapter> adapter_;
  LocalCameras local_;  // wakes the adapter: ends before it
  HeldImages held_;
  core::Nanoseconds sent_ns_ = 0, whole_ns_ = 0, next_report_ns_ = 0, next_view_ns_ = 0;
  bool must_be_whole_ = true;
  std::map<std::uint16_t, messages::PoseFinding> findings_;  // that were published, and are known still
  std::string said_;
  Tally tally_;
};

}  // namespace

void check_service(const WorkspaceCameraConfig& config, LoadedCell loaded) {
  const ArmHistory history;
  const LocalCameras cameras(config, loaded, history);
  const WorkspaceCamera camera(config, "check", loaded.cell.name, runtime::grid_of(loaded.cell),
                               loaded.arm.get(), history);
}

void run_service(const WorkspaceCameraConfig& config, const core::NetworkOptions& network, LoadedCell loaded,
                 const std::string& name, const std::filesystem::path& report_dir) {
  Service(config, network, std::move(loaded), name).run(report_dir);
}

}  // namespace phantom::workspace_camera
