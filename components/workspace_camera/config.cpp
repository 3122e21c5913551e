#include "components/workspace_camera/config.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "common/messages/living.hpp"
#include "common/runtime/configuration/fields.hpp"

namespace phantom::workspace_camera {
namespace {

using runtime::Fields;

/// Reads a pinhole camera, whose principal point is the middle of its image.
fusion::PinholeCamera read_pinhole(const Fields& fields) {
  fusion::PinholeCamera camera;
  camera.width_px = 320, camera.height_px = 240, camera.min_depth_m = 0.3, camera.max_depth_m = 4.0;
  fields.number("width_px", camera.width_px);
  fields.number("height_px", camera.height_px);
  camera.fx_px = camera.fy_px = fields.value("focal_px", 280.0);
  camera.cx_px = 0.5 * (camera.width_px - 1);
  camera.cy_px = 0.5 * (camera.height_px - 1);
  fields.number("min_depth_m", camera.min_depth_m);
  fields.number("max_depth_m", camera.max_depth_m);
  fields.check(camera.max_depth_m > camera.min_depth_m, "max_depth_m",
               "is not above min_depth_m; allowed: more than that, up to 20 m");
  return camera;
}

void read_files(const Fields& files, const std::filesystem::path& base, FileOptions& options) {
  std::string folder;
  files.text("folder", folder);
  options.folder = base / folder;
  options.camera = read_pinhole(files);
  files.number("rate_hz", options.rate_hz);
  files.number("unit_m", options.unit_m);
  files.flag("repeat", options.repeat);
}

void read_openni(const Fields& openni, const std::filesystem::path& base, OpenNiOptions& options) {
  openni.text("device", options.device);
  if (options.is_recording()) options.device = (base / options.device).string();
  openni.number("width_px", options.width_px);
  openni.number("height_px", options.height_px);
  openni.number("rate_hz", options.rate_hz);
  openni.number("focal_px", options.focal_px);
  openni.check(options.focal_px == 0.0 || options.focal_px >= 10.0, "focal_px",
               "is below 10; allowed: 0, or 10 to 5000 px");
  openni.number("latency_s", options.latency_s);
  openni.number("min_depth_m", options.min_depth_m);
  openni.number("max_depth_m", options.max_depth_m);
  openni.check(options.max_depth_m > options.min_depth_m, "max_depth_m",
               "is not above min_depth_m; allowed: more than that, up to 20 m");
}

void read_simulated(const Fields& sim, SimulatedOptions& options) {
  options.camera = read_pinhole(sim);
  sim.number("rate_hz", options.rate_hz);
  sim.number("latency_s", options.latency_s);
  sim.number("sigma_at_1m_m", options.noise.sigma.at_1m_m);
  sim.number("seed", options.seed);
}

void check_within(const Fields& fields, const char* key, const Eigen::Vector3d& p_m) {
  fields.check(p_m.cwiseAbs().maxCoeff() <= fusion::kMaxCameraDistance_m, key,
               "is too far away; allowed: -1000 to 1000 m along each axis");
}

geometry::Pose read_place(const Fields& fields) {
  if (fields.one_of("pose", "pose") == "pose") {
    const geometry::Pose X = fields.pose("pose");
    check_within(fields, "pose", X.translation_m);
    return X;
  }
  const Eigen::Vector3d eye_m = fields.vector3("looks_from_m");
  check_within(fields, "looks_from_m", eye_m);
  fields.check(fields.has("looks_at_m"), "looks_from_m", "needs looks_at_m, too; allowed: both, or a pose");
  const Eigen::Vector3d way_m = fields.vector3("looks_at_m") - eye_m;
  fields.check(way_m.head<2>().norm() > 1e-3 * way_m.norm(), "looks_at_m",
               "is straight above or below looks_from_m, or there; allowed: another direction, or a pose");
  return looking_at(eye_m, eye_m + way_m);
}

CameraConfig read_camera(const Fields& fields, const std::filesystem::path& base) {
  CameraConfig camera;
  camera.place = fields.place();
  fields.text("name", camera.name);
  fields.choice("driver", camera.driver,
                {{"topic", CameraDriver::kTopic},
                 {"sim", CameraDriver::kSimulated},
                 {"files", CameraDriver::kFiles},
                 {"openni", CameraDriver::kOpenNi}});
  camera.X_FC = read_place(fields);
  fields.text("link", camera.link);
  read_simulated(fields.section("sim"), camera.simulated);
  read_files(fields.section("files"), base, camera.files);
  read_openni(fields.section("openni"), base, camera.openni);
  return camera;
}

/// What a dead camera has seen becomes unknown: where its matter is to end, that is free unless said
/// otherwise.
fusion::UnknownPolicy read_policy(const Fields& fields, const char* key, OnLoss on_loss) {
  using enum fusion::UnknownPolicy;
  fusion::UnknownPolicy policy = kIgnore;
  fields.choice(key, policy, {{"ignore", kIgnore}, {"free", kFree}, {"occupied", kOccupied}});
  return policy == kIgnore && on_loss == OnLoss::kEnd ? kFree : policy;
}

Thing read_thing(const Fields& fields) {
  Thing thing;
  fields.text("name", thing.name);
  fields.choice(
      "shape", thing.shape,
      {{"box", Thing::Shape::kBox}, {"ball", Thing::Shape::kBall}, {"cylinder", Thing::Shape::kCylinder}});
  fields.vector3("size_m", thing.size_m);
  fields.check(thing.size_m.minCoeff() >= 0.001 && thing.size_m.maxCoeff() <= 10.0, "size_m",
               "is out of range; allowed: 0.001 to 10 m each");
  fields.vector3("from_m", thing.from_m);
  thing.to_m = thing.from_m;
  fields.vector3("to_m", thing.to_m);
  fields.number("trip_s", thing.trip_s);
  fields.number("appears_s", thing.appears_s);
  fields.number("stays_s", thing.stays_s);
  fields.number("every_s", thing.every_s);
  fields.check(thing.every_s == 0.0 || (thing.stays_s > 0.0 && thing.stays_s < thing.every_s), "every_s",
               "is not longer than it stays; allowed: 0, or more than stays_s, which is then above 0");
  fields.flag("steel", thing.steel);
  return thing;
}

}  // namespace

bool Thing::is_there(double time_s) const noexcept {
  double since_s = time_s - appears_s;
  if (since_s < 0.0) return false;
  if (every_s > 0.0) since_s = std::fmod(since_s, every_s);
  return stays_s == 0.0 || since_s < stays_s;
}

Eigen::Vector3d Thing::middle_m(double time_s) const noexcept {
  if (trip_s <= 0.0) return from_m;
  const double share = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (time_s - appears_s) / trip_s);
  return from_m + share * (to_m - from_m);
}

bool WorkspaceCameraConfig::has(CameraDriver driver) const {
  return std::ranges::find(cameras, driver, &CameraConfig::driver) != cameras.end();
}

geometry::Pose looking_at(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m) {
  geometry::Pose X{{}, eye_m};
  const Eigen::Vector3d z = (target_m - eye_m).normalized(),
                        x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  X.rotation << x, z.cross(x), z;
  return X;
}

WorkspaceCameraConfig load_config(const std::filesystem::path& path) {
  const Fields file(path, {kParameters});
  WorkspaceCameraConfig config;
  file.text("arm", config.arm);
  file.number("status_rate_hz", config.status_rate_hz);
  file.number("heartbeat_s", config.heartbeat_s);
  file.number("whole_every_s", config.whole_every_s);
  file.number("late_s", config.late_s);
  file.number("dead_s", config.dead_s);
  file.check(config.dead_s > config.late_s, "dead_s", "is not above late_s; allowed: more than that");
  file.choice("on_loss", config.on_loss, {{"keep", OnLoss::kKeep}, {"end", OnLoss::kEnd}});
  file.number("arm_margin_m", config.fusion.masks.arm_margin_m);
  const Fields fusion = file.section("fusion");
  fusion.number("max_blocks", config.fusion.max_blocks);
  fusion.number("sigma_at_1m_m", config.fusion.sigma.at_1m_m);
  fusion.number("min_component_vox", config.fusion.min_component_vox);
  config.fusion.unknown = read_policy(fusion, "unknown", config.on_loss);
  for (const Fields& fields : file.sections("unknown_regions")) {
    UnknownRegionConfig& region = config.unknown_regions.emplace_back();
    region.min_m = fields.vector3("min_m");
    region.max_m = fields.vector3("max_m");
    fields.check((region.max_m - region.min_m).minCoeff() > 0.0, "max_m",
                 "is not above min_m; allowed: more than that along each axis");
    region.policy = read_policy(fields, "policy", config.on_loss);
  }
  file.check(config.unknown_regions.size() <= fusion::kMaxUnknownRegions, "unknown_regions",
             "has too many; allowed: 0 to 1000");
  const Fields poses = file.section("pose_check");
  poses.number("every_s", config.pose_check.every_s);
  poses.number("tolerance_m", config.pose_check.tolerance_m);
  poses.number("reach_m", config.pose_check.reach_m);
  config.pose_check.sigma = config.fusion.sigma;
  std::set<std::string> names;
  for (const Fields& fields : file.sections("cameras")) {
    config.cameras.push_back(read_camera(fields, path.parent_path()));
    fields.check(names.insert(config.cameras.back().name).second, "name",
                 "is another camera's, too; allowed: each once");
  }
  file.check(!config.cameras.empty() && config.cameras.size() <= messages::kMaxDepthCameras, "cameras",
             "has none, or too many; allowed: 1 to 16");
  constexpr std::size_t kMaxThings = 64;
  for (const Fields& fields : file.sections("things")) config.things.push_back(read_thing(fields));
  file.check(config.things.size() <= kMaxThings, "things", "has too many; allowed: 0 to 64");
  for (const Fields& fields : file.sections("displaced")) {
    Displacement& one = config.displaced.emplace_back();
    fields.text("object", one.object);
    fields.vector3("by_m", one.by_m);
    fields.number("from_s", one.from_s);
    one.place = fields.place();
  }
  file.finish();
  return config;
}

}  // namespace phantom::workspace_camera
