#include "components/phantom_sensing/config.hpp"

#include <algorithm>
#include <cctype>
#include <set>

#include "common/core/host/host_memory.hpp"
#include "common/core/units.hpp"
#include "common/runtime/configuration/fields.hpp"

namespace phantom::phantom_sensing {
namespace {

using runtime::Fields;

/// Rounds μ to single precision as the workspace does, so that a threshold compares equal to the same decimal
/// there.
double as_in_workspace(double mu) { return static_cast<double>(static_cast<float>(mu)); }

void read_memory(const Fields& fields, robot::MemoryWeights& weights) {
  fields.numbers("memory_weights", weights);
  if (weights.empty()) return;
  fields.check(weights.size() <= robot::ViscosityFilter::kMaxDepth && weights.front() > 0.0, "memory_weights",
               "has " + std::to_string(weights.size()) + " weights, the first " +
                   std::to_string(weights.front()) + "; allowed: up to " +
                   std::to_string(robot::ViscosityFilter::kMaxDepth) + ", the first above 0; or none, []");
}

void read_response(const Fields& section, robot::ResponseCurve& response) {
  if (!section.has("mu_Pa_s_per_m") && !section.has("felt_Pa_s_per_m")) return;
  std::vector<double> mu, felt;
  section.numbers("mu_Pa_s_per_m", mu);
  section.numbers("felt_Pa_s_per_m", felt);
  section.check(mu.size() == felt.size() && !mu.empty(), "felt_Pa_s_per_m",
                "has " + std::to_string(felt.size()) + " values for " + std::to_string(mu.size()) +
                    " of mu_Pa_s_per_m; allowed: as many, 1 or more");
  std::vector<std::pair<double, double>> points;
  for (std::size_t i = 0; i < mu.size(); ++i) {
    section.check(i == 0 || mu[i] > mu[i - 1], "mu_Pa_s_per_m",
                  "does not rise at value " + std::to_string(i + 1) + "; allowed: rising values");
    points.emplace_back(mu[i], felt[i]);
  }
  response = robot::ResponseCurve(std::move(points));
}

void read_motion(const Fields& section, percept::MotionThresholds& motion) {
  section.number("dangerous_below_deg", motion.dangerous_below_rad, core::kRadPerDegree);
  section.number("safe_above_deg", motion.safe_above_rad, core::kRadPerDegree);
  section.number("least_speed_m_s", motion.least_speed_m_s);
  section.check(motion.safe_above_rad >= motion.dangerous_below_rad, "safe_above_deg",
                "is below dangerous_below_deg; allowed: that or more, up to 180 degrees");
}

void read_speed_limit(const Fields& section, percept::SpeedLimit& limit) {
  section.choice("speed_limit", limit.shape,
                 {{"linear", percept::LimitShape::kLinear}, {"table", percept::LimitShape::kTable}});
  if (!section.has("speed_limit_mu_Pa_s_per_m") && !section.has("speed_limit_m_s")) return;
  std::vector<double> mu, speed;
  section.numbers("speed_limit_mu_Pa_s_per_m", mu);
  section.numbers("speed_limit_m_s", speed);
  constexpr std::size_t kMax = percept::SpeedLimit::kMaxPoints;
  section.check(mu.size() == speed.size() && !mu.empty() && mu.size() <= kMax, "speed_limit_m_s",
                "has " + std::to_string(speed.size()) + " values for " + std::to_string(mu.size()) +
                    " of speed_limit_mu_Pa_s_per_m; allowed: as many, 1 to " + std::to_string(kMax));
  limit = {.points = mu.size(), .shape = limit.shape};
  std::copy(mu.begin(), mu.end(), limit.mu.begin());
  std::copy(speed.begin(), speed.end(), limit.speed_m_s.begin());
  if (const auto status = limit.check(); !status) section.check(false, "speed_limit_m_s", status.message());
}

void read_hit(const Fields& section, PerceptSettings& percept) {
  percept::HitThresholds& hit = percept.hit;
  section.number("mu_unsafe_Pa_s_per_m", hit.mu_unsafe);
  section.number("mu_moderate_Pa_s_per_m", hit.mu_moderate);
  section.number("cosine", hit.cosine);
  read_speed_limit(section, hit.limit);
  percept::AlertTiming& alert = percept.alert;
  section.number("clear_after_s", alert.clear_after_s);
  section.number("least_interval_s", alert.least_interval_s);
  section.number("clear_speed_share", alert.clear_speed_share);
  hit.mu_unsafe = as_in_workspace(hit.mu_unsafe);
  hit.mu_moderate = as_in_workspace(hit.mu_moderate);
  section.check(hit.mu_moderate < hit.mu_unsafe, "mu_moderate_Pa_s_per_m",
                "is not below mu_unsafe_Pa_s_per_m; allowed: above 0 and below that");
}

void read_doubt(const Fields& section, Config& config) {
  DoubtSettings& doubt = config.percept.doubt;
  section.number("tolerance_vox", doubt.tolerance_vox);
  section.number("rest_speed_m_s", doubt.rest_speed_m_s);
  section.number("after_s", doubt.timing.after_s);
  section.number("rest_s", doubt.timing.rest_s);
  section.number("clear_after_s", doubt.timing.clear_after_s);
  section.text("first_link", config.first_feeling_link);
}

void read_skin(const Fields& fields, robot::SkinOptions& options) {
  using enum robot::Normalisation;
  fields.choice("normalisation", options.normalisation,
                {{"area", kArea}, {"count", kCount}, {"active", kActive}, {"none", kNone}});
  const auto skin = fields.section("skin");
  skin.number("pitch_vox", options.pitch_vox);
  skin.number("max_sensors", options.max_sensors);
}

/// Reads the workspace of its own in which a share is sensed, if it has one.
void read_own_workspace(const Fields& fields, const Config& config, ShareConfig& share) {
  share.cell = fields.path("cell");
  fields.text("partition", share.partition);
  runtime::check_partition(fields, share.partition);
  fields.check(share.cell.empty() == share.partition.empty(), "partition",
               "and cell say where a share's own workspace comes from; allowed: both, or none");
  fields.check(share.cell.empty() || config.skin.normalisation != robot::Normalisation::kNone, "cell",
               "does not go with normalisation: none, by which drag depends on the number of sensors; "
               "allowed: area, count, active");
}

void read_sharing(const Fields& file, Config& config) {
  if (!file.has("sharing")) return;
  const Fields sharing = file.section("sharing");
  sharing.number("wait_s", config.share_wait_s);
  std::set<std::string> names, links;
  for (const Fields& fields : sharing.sections("shares")) {
    ShareConfig share;
    fields.text("name", share.name);
    const bool plain = !share.name.empty() && std::all_of(share.name.begin(), share.name.end(), [](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
    });
    fields.check(plain && names.insert(share.name).second, "name",
                 "is '" + share.name + "'; allowed: a name of its own, of A-Z a-z 0-9 _ -");
    fields.texts("links", share.links);
    fields.check(!share.links.empty(), "links", "is empty; allowed: at least one moving link of the arm");
    for (const std::string& link : share.links)
      fields.check(links.insert(link).second, "links",
                   "has '" + link + "', which a share has already; allowed: each link once");
    read_own_workspace(fields, config, share);
    config.shares.push_back(std::move(share));
  }
  sharing.check(
      !config.shares.empty() && config.shares.size() <= kMaxShares, "shares",
      "has " + std::to_string(config.shares.size()) + " shares; allowed: 1 to " + std::to_string(kMaxShares));
  file.check(config.percept.memory.empty(), "memory_weights",
             "does not go with sharing: what a sensor remembers is in the process that senses it; allowed: "
             "[], or no sharing");
}

void read_other_arms(const Fields& file, Config& config) {
  config.other_arms = runtime::read_other_arms(file);
  file.check(config.other_arms.empty() || config.shares.empty(), "other_arms",
             "does not go with sharing; allowed: one of them");
  file.check(
      config.other_arms.empty() || config.percept.memory.empty(), "memory_weights",
      "does not go with other_arms: what moves past a sensor is no path of the sensor; allowed: [], or "
      "no other_arms");
}

}  // namespace

Config load_config(const std::filesystem::path& path) {
  const runtime::Fields file(path, {kParameters});
  Config config;
  config.file = path;
  PerceptSettings& percept = config.percept;
  file.text("arm", config.arm);
  file.choice("mode", percept.mode,
              {{"separable", robot::DragMode::kSeparable}, {"coupled", robot::DragMode::kCoupled}});
  const Fields directed = file.section("directional");
  auto& directional = percept.directional;
  directed.flag("enabled", directional.enabled);
  directed.number("leaving_share", directional.leaving_share);
  directed.number("full_at", directional.full_at);
  directed.number("still", directional.still);
  directed.number("gradient_reach_vox", percept.gradient_reach_vox);
  read_skin(file, config.skin);
  file.number("threads", percept.threads);
  file.number("fifo_priority", config.servo_priority);
  read_memory(file, percept.memory);
  read_response(file.section("response"), percept.response);
  const Fields workspace = file.section("workspace");
  workspace.number("behind_after_s", config.workspace_behind_after_s);
  workspace.number("stale_after_s", config.workspace_stale_after_s);
  workspace.number("max_mib", config.workspace_max_bytes, double{1 << 20});
  if (config.workspace_max_bytes == 0) config.workspace_max_bytes = core::memory_of_the_machine() / 8;
  workspace.check(config.workspace_stale_after_s >= config.workspace_behind_after_s, "stale_after_s",
                  "is below behind_after_s; allowed: that or more, up to 3600 s");
  file.number("staleness_s", config.staleness_s);
  file.number("max_view_age_s", config.max_view_age_s);
  file.number("percept_rate_hz", config.percept_rate_hz);
  const auto cluster = file.section("cluster");
  cluster.number("reach_vox", percept.cluster_reach_vox);
  cluster.choice("shape", percept.cluster_shape,
                 {{"sphere", percept::ZoneShape::kSphere}, {"cube", percept::ZoneShape::kCube}});
  read_motion(file.section("motion"), percept.motion);
  read_hit(file.section("hit"), percept);
  read_doubt(file.section("doubt"), config);
  read_sharing(file, config);
  read_other_arms(file, config);
  file.finish();
  return config;
}

}  // namespace phantom::phantom_sensing
