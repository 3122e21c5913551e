#include "components/phantom_sensing/config.hpp"

#include <algorithm>

#include "common/core/units.hpp"
#include "common/runtime/config_reader.hpp"

namespace phantom::phantom_sensing {
namespace {

using runtime::ConfigReader;

/// μ is held in single precision in the workspace; thresholds must compare equal to the same decimal there.
double as_in_workspace(double mu) { return static_cast<double>(static_cast<float>(mu)); }

robot::Normalisation read_normalisation(const ConfigReader& file) {
  const std::string name = file.choice("normalisation", "area", {"area", "count", "active", "none"});
  if (name == "count") return robot::Normalisation::kCount;
  if (name == "active") return robot::Normalisation::kActive;
  return name == "none" ? robot::Normalisation::kNone : robot::Normalisation::kArea;
}

void read_directional(const ConfigReader& section, PerceptSettings& percept) {
  percept.directional.enabled = section.flag("enabled", percept.directional.enabled);
  percept.directional.leaving_share =
      section.number("leaving_share", percept.directional.leaving_share, {0, 1, ""});
  percept.directional.full_at = section.number("full_at", percept.directional.full_at, {0.01, 1, ""});
  percept.directional.still = section.number("still", percept.directional.still, {1e-6, 1, "rad/s or m/s"});
  percept.gradient_reach_vox =
      section.integer("gradient_reach_vox", percept.gradient_reach_vox, {1, 32, "voxels"});
}

void read_workspace(const ConfigReader& section, Config& config) {
  double& behind_s = config.workspace_behind_after_s;
  double& stale_s = config.workspace_stale_after_s;
  behind_s = section.number("behind_after_s", behind_s, {0.01, 3600, "s"});
  stale_s = section.number("stale_after_s", stale_s, {0.01, 3600, "s"});
  if (stale_s < behind_s)
    throw section.error("stale_after_s", "is below behind_after_s; allowed: that or more, up to 3600 s");
}

robot::MemoryWeights read_memory(const ConfigReader& file) {
  if (!file.has("memory_weights")) return {};
  const auto weights = file.numbers("memory_weights", {0, 1000, ""});
  if (weights.empty()) return weights;
  if (weights.size() > robot::MuMemory::kMostDepth || !(weights.front() > 0.0)) {
    throw file.error("memory_weights", "has " + std::to_string(weights.size()) + " weights, the first " +
                                           std::to_string(weights.front()) + "; allowed: up to " +
                                           std::to_string(robot::MuMemory::kMostDepth) +
                                           ", the first above 0; or none, []");
  }
  return weights;
}

robot::ResponseCurve read_response(const ConfigReader& section) {
  if (!section.has("mu_Pa_s_per_m") && !section.has("felt_Pa_s_per_m")) return {};
  const auto mu = section.numbers("mu_Pa_s_per_m", {0, 1e6, "Pa·s/m"});
  const auto felt = section.numbers("felt_Pa_s_per_m", {0, 1e6, "Pa·s/m"});
  if (mu.size() != felt.size() || mu.empty()) {
    throw section.error("felt_Pa_s_per_m", "has " + std::to_string(felt.size()) + " values for " +
                                               std::to_string(mu.size()) +
                                               " of mu_Pa_s_per_m; allowed: as many, 1 or more");
  }
  std::vector<std::pair<double, double>> points;
  for (std::size_t i = 0; i < mu.size(); ++i) {
    if (i > 0 && !(mu[i] > mu[i - 1]))
      throw section.error("mu_Pa_s_per_m",
                          "does not rise at value " + std::to_string(i + 1) + "; allowed: rising values");
    points.emplace_back(mu[i], felt[i]);
  }
  return robot::ResponseCurve(std::move(points));
}

void read_motion(const ConfigReader& section, percept::MotionThresholds& motion) {
  motion.dangerous_below_rad =
      core::kRadPerDegree * section.number("dangerous_below_deg", 60.0, {0, 180, "degrees"});
  motion.safe_above_rad = core::kRadPerDegree * section.number("safe_above_deg", 120.0, {0, 180, "degrees"});
  motion.least_speed_m_s = section.number("least_speed_m_s", motion.least_speed_m_s, {0, 10, "m/s"});
  if (motion.safe_above_rad < motion.dangerous_below_rad) {
    throw section.error("safe_above_deg",
                        "is below dangerous_below_deg; allowed: that or more, up to 180 degrees");
  }
}

void read_speed_limit(const ConfigReader& section, percept::SpeedLimit& limit) {
  const percept::LimitShape shape = section.choice("speed_limit", "linear", {"linear", "table"}) == "table"
                                        ? percept::LimitShape::kTable
                                        : percept::LimitShape::kLinear;
  limit.shape = shape;
  if (!section.has("speed_limit_mu_Pa_s_per_m") && !section.has("speed_limit_m_s")) return;
  const auto mu = section.numbers("speed_limit_mu_Pa_s_per_m", {0, 1e6, "Pa·s/m"});
  const auto speed = section.numbers("speed_limit_m_s", {0, 100, "m/s"});
  if (mu.size() != speed.size() || mu.empty() || mu.size() > percept::SpeedLimit::kMaxPoints) {
    throw section.error("speed_limit_m_s", "has " + std::to_string(speed.size()) + " values for " +
                                               std::to_string(mu.size()) +
                                               " of speed_limit_mu_Pa_s_per_m; allowed: as many, 1 to " +
                                               std::to_string(percept::SpeedLimit::kMaxPoints));
  }
  limit = {};
  limit.shape = shape;
  limit.points = mu.size();
  std::copy(mu.begin(), mu.end(), limit.mu.begin());
  std::copy(speed.begin(), speed.end(), limit.speed_m_s.begin());
  if (const auto status = limit.check(); !status) throw section.error("speed_limit_m_s", status.message());
}

void read_hit(const ConfigReader& section, PerceptSettings& percept) {
  percept::HitThresholds& hit = percept.hit;
  hit.mu_unsafe =
      as_in_workspace(section.number("mu_unsafe_Pa_s_per_m", hit.mu_unsafe, {1e-6, 1e6, "Pa·s/m"}));
  hit.mu_moderate =
      as_in_workspace(section.number("mu_moderate_Pa_s_per_m", hit.mu_moderate, {1e-6, 1e6, "Pa·s/m"}));
  hit.cosine = section.number("cosine", hit.cosine, {-1, 1, ""});
  read_speed_limit(section, hit.limit);
  percept::AlertTiming& alert = percept.alert;
  alert.clear_after_s = section.number("clear_after_s", alert.clear_after_s, {0, 60, "s"});
  alert.least_interval_s = section.number("least_interval_s", alert.least_interval_s, {0, 60, "s"});
  alert.clear_speed_share = section.number("clear_speed_share", alert.clear_speed_share, {0, 1, ""});
  if (!(hit.mu_moderate < hit.mu_unsafe)) {
    throw section.error("mu_moderate_Pa_s_per_m",
                        "is not below mu_unsafe_Pa_s_per_m; allowed: above 0 and below that");
  }
}

}  // namespace

Config load_config(const std::filesystem::path& path) {
  const ConfigReader file = ConfigReader::from_file(path);
  Config config;
  config.file = path;
  PerceptSettings& percept = config.percept;
  config.arm = file.text("arm", "");
  percept.mode = file.choice("mode", "separable", {"separable", "coupled"}) == "coupled"
                     ? robot::DragMode::kCoupled
                     : robot::DragMode::kSeparable;
  read_directional(file.optional_section("directional"), percept);
  config.skin.normalisation = read_normalisation(file);
  const ConfigReader skin = file.optional_section("skin");
  config.skin.pitch_vox = skin.number("pitch_vox", config.skin.pitch_vox, {0.05, 10, "voxels"});
  config.skin.max_sensors =
      static_cast<std::size_t>(skin.integer("max_sensors", 100'000, {1, 2'000'000, "sensors"}));
  percept.threads = static_cast<std::size_t>(file.integer("threads", 0, {0, 64, "threads"}));
  config.servo_priority = file.integer("fifo_priority", config.servo_priority, {0, 99, ""});
  config.percept_rate_hz = file.number("percept_rate_hz", config.percept_rate_hz, {1, 1000, "Hz"});
  config.staleness_s = file.number("staleness_s", config.staleness_s, {0.002, 10, "s"});
  read_workspace(file.optional_section("workspace"), config);
  percept.memory = read_memory(file);
  percept.response = read_response(file.optional_section("response"));
  const ConfigReader cluster = file.optional_section("cluster");
  percept.cluster_reach_vox = cluster.integer("reach_vox", percept.cluster_reach_vox, {1, 15, "voxels"});
  percept.cluster_shape = cluster.choice("shape", "sphere", {"sphere", "cube"}) == "cube"
                              ? percept::ZoneShape::kCube
                              : percept::ZoneShape::kSphere;
  read_motion(file.optional_section("motion"), percept.motion);
  read_hit(file.optional_section("hit"), percept);
  file.finish();
  return config;
}

}  // namespace phantom::phantom_sensing
