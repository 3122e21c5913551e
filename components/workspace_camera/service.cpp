#include "components/workspace_camera/service.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/dds/admission/refusal_log.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/process/process.hpp"
#include "common/runtime/process/spread_json.hpp"
#include "components/workspace_camera/dds_adapter.hpp"
#include "components/workspace_camera/model_watch.hpp"
#include "components/workspace_camera/simulated_camera.hpp"
#include "components/workspace_camera/workspace_camera.hpp"

namespace phantom::workspace_camera {
namespace {

constexpr double kMaxWait_s = 0.05;    // bounds the delay of a requested stop
constexpr double kHeldWait_s = 0.002;  // while an image waits for the arm's states
constexpr core::Nanoseconds kMaxHold_ns = 60 * core::kNsPerMillisecond;
constexpr core::Nanoseconds kViewPeriod_ns = 500 * core::kNsPerMillisecond;

std::unique_ptr<ArmView> load_arm_view(const runtime::CellConfig& cell, const std::string& name) {
  if (cell.arms.empty() && name.empty()) return nullptr;
  const runtime::ArmConfig& config = cell.arm(name);
  robot::SerialArm arm = runtime::load_arm(config);
  robot::SkinOptions options;
  options.voxel_size_m = cell.voxel_size_m;
  auto skin = robot::lay_out_skin(arm, runtime::load_skin(config, arm), options);
  if (!skin) throw core::ConfigError("arm '" + config.name + "': " + skin.status().message());
  const double pitch_m = options.pitch_vox * cell.voxel_size_m.reference_m();
  return std::make_unique<ArmView>(std::move(arm), runtime::load_closed_arm(config), std::move(skin).value(),
                                   pitch_m);
}

/// Returns a room around the workspace and the cameras: a camera measures nothing where it sees nothing, and
/// only what lies before something measured is seen to be free.
geometry::TriangleMesh room_around(const runtime::CellConfig& cell, const WorkspaceCameraConfig& config) {
  constexpr double kToFloor_m = 0.03, kToWall_m = 0.3;  // outside of the workspace: of no voxel
  Eigen::Vector3d low = cell.min_m, high = cell.max_m;
  for (const CameraConfig& camera : config.cameras) {
    low = low.cwiseMin(camera.X_FC.translation_m);
    high = high.cwiseMax(camera.X_FC.translation_m);
  }
  low -= Eigen::Vector3d(kToWall_m, kToWall_m, kToFloor_m);
  high += Eigen::Vector3d::Constant(kToWall_m);
  return geometry::make_box(high - low).transformed({Eigen::Matrix3d::Identity(), 0.5 * (low + high)});
}

/// Takes the displaced objects out of the real cell.
std::vector<DisplacedMesh> take_displaced(runtime::CellConfig& cell, const WorkspaceCameraConfig& config) {
  std::vector<DisplacedMesh> displaced;
  for (const Displacement& one : config.displaced) {
    const auto object = std::ranges::find(cell.objects, one.object, &runtime::ObjectConfig::name);
    if (object == cell.objects.end())
      throw core::ConfigError("displaced: the cell has no object '" + one.object +
                              "', or it is named twice; allowed: an object of the cell file, each once");
    runtime::CellConfig alone = cell;
    alone.objects = {*object};
    for (geometry::PlacedMesh& body : runtime::load_real_bodies(alone))
      displaced.push_back({std::move(body.mesh_W), one.by_m, one.from_s});
    cell.objects.erase(object);
  }
  return displaced;
}

std::unique_ptr<const fusion::CameraScene> load_scene(const runtime::CellConfig& cell,
                                                      const WorkspaceCameraConfig& config) {
  std::vector<fusion::CameraScene::Object> objects{{room_around(cell, config), false}};
  for (const geometry::PlacedMesh& body : runtime::load_real_bodies(cell))
    objects.push_back({body.mesh_W, false});
  return std::make_unique<const fusion::CameraScene>(objects);
}

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

/// A simulated camera, and when its next image is due.
struct Simulated {
  std::size_t camera = 0;
  SimulatedCamera simulator;
  core::Nanoseconds period_ns, latency_ns, next_ns;
};

/// A camera whose clouds are files, and when the next is due.
struct Played {
  std::size_t camera = 0;
  std::unique_ptr<FileCamera> player;
  core::Nanoseconds period_ns, next_ns;
};

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
        start_ns_(core::monotonic_ns()) {
    std::vector<std::string> heard;
    for (std::size_t i = 0; i < config.cameras.size(); ++i) {
      const CameraConfig& camera = config.cameras[i];
      if (camera.driver == CameraDriver::kTopic) {
        heard.push_back(camera.name);
        heard_.push_back(i);
        continue;
      }
      if (camera.driver == CameraDriver::kFiles) {
        played_.push_back({i, std::make_unique<FileCamera>(camera.files),
                           core::from_seconds(1.0 / camera.files.rate_hz), start_ns_});
        spdlog::info("camera {}: plays {} clouds of {}", camera.name, played_.back().player->files(),
                     camera.files.folder.string());
        continue;
      }
      const SimulatedOptions& options = camera.simulated;
      simulated_.push_back(
          {i, SimulatedCamera(options, camera.X_FC, *loaded_.simulated, config.things, loaded_.displaced),
           core::from_seconds(1.0 / options.rate_hz), core::from_seconds(options.latency_s), start_ns_});
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
                 simulated_.size(), loaded_.cell.name);
    while (!runtime::stop_requested()) {
      take_carried();
      take_objects();
      for (Simulated& one : simulated_) simulate(one);
      for (Played& one : played_) play(one);
      if (auto image = adapter_->next_image(wait_s())) held_ = *std::move(image);
      take_held();
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
    for (const Simulated& one : simulated_) due_ns = std::min(due_ns, one.next_ns);
    for (const Played& one : played_)
      if (!one.player->at_end()) due_ns = std::min(due_ns, one.next_ns);
    return std::clamp(core::seconds(due_ns - core::monotonic_ns()), 0.0, held_ ? kHeldWait_s : kMaxWait_s);
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

  /// Makes the image that is due: what was there when it was exposed.
  void simulate(Simulated& one) {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    if (now_ns < one.next_ns) return;
    // A late image is left out, not made later: the newest counts.
    one.next_ns += std::max<core::Nanoseconds>(1, (now_ns - one.next_ns) / one.period_ns + 1) * one.period_ns;
    // Of no time after the arm's newest state: it would stand elsewhere in the image than it then did.
    const core::Nanoseconds known_ns = loaded_.arm ? history_.newest_ns() : now_ns;
    const core::Nanoseconds exposed_ns = std::min(now_ns - one.latency_ns, known_ns);
    const auto pose = loaded_.arm ? history_.at(exposed_ns) : std::nullopt;
    const auto pixels = one.simulator.image(core::seconds(exposed_ns - start_ns_), loaded_.arm.get(),
                                            pose ? &*pose : nullptr);
    fuse({one.camera, one.simulator.camera(), exposed_ns, pixels});
  }

  /// Takes the cloud that is due as if it were measured now.
  void play(Played& one) {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    if (now_ns < one.next_ns || one.player->at_end()) return;
    const auto image = one.player->next();
    if (image && !*image) {  // it is still being read
      one.next_ns = now_ns + core::from_seconds(kHeldWait_s);
      return;
    }
    one.next_ns = std::max(one.next_ns + one.period_ns, now_ns);
    if (!image) return file_refusals_.refused(image.status().message());
    const core::Nanoseconds known_ns = loaded_.arm ? history_.newest_ns() : now_ns;
    fuse({one.camera, one.player->camera(), std::min(now_ns, known_ns), **image});
    if (one.player->at_end())
      spdlog::info("camera {}: all its clouds were played", config_.cameras[one.camera].name);
  }

  /// Takes the image that has come once the arm's states of its time have, too, or it has waited for long.
  void take_held() {
    if (!held_) return;
    const core::Nanoseconds exposed_ns = held_->received_ns - core::from_seconds(held_->age_s);
    const bool known = !loaded_.arm || history_.newest_ns() >= exposed_ns;
    if (!known && core::monotonic_ns() - held_->received_ns < kMaxHold_ns) return;
    const fusion::PinholeCamera pinhole{static_cast<int>(held_->width),
                                        static_cast<int>(held_->height),
                                        held_->fx_px,
                                        held_->fy_px,
                                        held_->cx_px,
                                        held_->cy_px,
                                        held_->min_depth_m,
                                        held_->max_depth_m};
    fuse({heard_[held_->camera], pinhole, exposed_ns, held_->depth_mm});
    held_.reset();
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
      report_poses(health);
      publish_findings();
    }
    if (health.message != said_) {
      const bool degraded = health.state == core::ComponentState::kDegraded;
      spdlog::log(degraded ? spdlog::level::warn : spdlog::level::info, "{}", said_ = health.message);
    }
    adapter_->report(health);
    next_report_ns_ = now_ns + core::from_seconds(1.0 / config_.status_rate_hz);
  }

  void report_poses(core::Health& health) const {
    const auto sentences = model_->sentences();
    health.figures.push_back({"wrong_poses", static_cast<double>(sentences.size()), ""});
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
  const core::Nanoseconds start_ns_;
  std::vector<Simulated> simulated_;
  std::vector<Played> played_;
  dds::RefusalLog file_refusals_{"files of clouds"};
  std::vector<std::size_t> heard_;   // cameras of depth_image, by their place in the adapter
  std::optional<ModelWatch> model_;  // none: poses are not checked
  std::optional<DdsAdapter> adapter_;
  std::optional<DdsAdapter::Image> held_;  // waits for the arm's states of its time
  core::Nanoseconds sent_ns_ = 0, whole_ns_ = 0, next_report_ns_ = 0, next_view_ns_ = 0;
  bool must_be_whole_ = true;
  std::map<std::uint16_t, messages::PoseFinding> findings_;  // that were published, and are known still
  std::string said_;
  Tally tally_;
};

}  // namespace

LoadedCell load_cell(const WorkspaceCameraConfig& config, const std::filesystem::path& cell_file) {
  LoadedCell loaded;
  loaded.cell = runtime::load_checked_cell(cell_file, runtime::CellArms::kOptional);
  loaded.arm = load_arm_view(loaded.cell, config.arm);
  if (config.has(CameraDriver::kSimulated)) {
    runtime::CellConfig real = loaded.cell;
    loaded.displaced = take_displaced(real, config);
    loaded.simulated = load_scene(real, config);
  }
  for (runtime::CellBody& body : runtime::load_bodies(loaded.cell)) {
    const std::uint64_t hash = body.mesh_O.content_hash();
    loaded.meshes.emplace_back(hash, std::move(body.mesh_O));
  }
  for (const CameraConfig& camera : config.cameras) {
    if (camera.driver == CameraDriver::kSimulated && !camera.link.empty())
      throw core::ConfigError("camera '" + camera.name +
                              "': a simulated camera on a link; allowed: driver: sim with link: \"\"");
  }
  return loaded;
}

void check_service(const WorkspaceCameraConfig& config, LoadedCell loaded) {
  for (const CameraConfig& camera : config.cameras)
    if (camera.driver == CameraDriver::kFiles) const FileCamera player(camera.files);
  const ArmHistory history;
  const WorkspaceCamera camera(config, "check", loaded.cell.name, runtime::grid_of(loaded.cell),
                               loaded.arm.get(), history);
}

void run_service(const WorkspaceCameraConfig& config, const core::NetworkOptions& network, LoadedCell loaded,
                 const std::string& name, const std::filesystem::path& report_dir) {
  Service(config, network, std::move(loaded), name).run(report_dir);
}

}  // namespace phantom::workspace_camera
