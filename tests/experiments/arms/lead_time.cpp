// How long before a contact the alert comes (thesis 6.8.1: as long as possible), over random approaches of
// the shipped arm in the shipped hot cell, beside a person's reaction; and whether a walk along a wall is
// left alone.

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "components/phantom_sensing/model.hpp"
#include "tests/experiments/rig.hpp"

namespace phantom::experiments {
namespace in_lead_time {
namespace {

using phantom_sensing::PhantomSensing;
using phantom_sensing::StepInputs;
using phantom_sensing::StepOutputs;

constexpr double kDt_s = 0.004;
constexpr double kMaxApproach_s = 6.0;
/// Reaction of a person to what is expected, and to what is not.
constexpr double kQuickReaction_s = 0.2, kReaction_s = 0.5, kWanted_s = 0.3;

/// The arm's phantom in a cell.
struct Scene {
  Scene(const runtime::CellConfig& cell, const Settings& settings)
      : model(phantom_sensing::load_model(cell, {})),
        voxels(phantom_sensing::build_workspace(cell)),
        neighbour_mu(percept::greatest_neighbour_mu(voxels)),
        mu_contact(static_cast<double>(cell.objects.front().profile.mu_skin_Pa_s_per_m)),
        sabotage(settings.sabotage) {}
  StepInputs inputs(const core::JointArray& q, const core::JointArray& speeds) const {
    StepInputs in;
    in.position = q;
    in.velocity = sabotaged(speeds, sabotage);
    in.dt_s = kDt_s;
    in.state_valid = true;
    in.workspace = {&voxels, neighbour_mu};
    return in;
  }
  bool touches(const StepOutputs& out) const { return out.worst.mu >= mu_contact; }

  phantom_sensing::PhantomModel model;
  workspace::Workspace voxels;
  double neighbour_mu, mu_contact;
  Sabotage sabotage;
};

/// Since when there have been alerts of each threat, one link near one object. An alert that a graver one
/// replaces goes on in that.
class Alerts {
 public:
  void take(const StepOutputs& out, double t_s) {
    std::map<Threat, double> ended_s;
    for (const percept::Alert& alert : out.alerts.cleared) {
      const auto standing = since_s_.extract({alert.at.link, alert.at.object});
      if (!standing.empty()) ended_s[standing.key()] = standing.mapped();
    }
    for (const percept::Alert& alert : out.alerts.raised) {
      const Threat threat{alert.at.link, alert.at.object};
      const auto replaced = ended_s.find(threat);
      since_s_[threat] = replaced == ended_s.end() ? t_s : replaced->second;
      if (replaced == ended_s.end()) ++raised_;
    }
  }
  /// Since when there has been an alert of the object, of whichever link.
  std::optional<double> since_s(std::uint16_t object) const {
    std::optional<double> first_s;
    for (const auto& [threat, since_s] : since_s_)
      if (threat.second == object) first_s = std::min(first_s.value_or(since_s), since_s);
    return first_s;
  }
  std::size_t raised() const { return raised_; }

 private:
  using Threat = std::pair<std::uint32_t, std::uint16_t>;
  std::map<Threat, double> since_s_;
  std::size_t raised_ = 0;
};

struct Approach {
  double speed_m_s = 0.0;  // of the place that touches, when it does
  double lead_s = 0.0;     // from the alert to the contact; 0: there was none
};

/// Moves the joints at constant speeds from free space until the arm touches; none if it does not.
std::optional<Approach> approach(const Scene& scene, core::JointArray q, const core::JointArray& speeds) {
  PhantomSensing sensing(scene.model, {});
  StepOutputs out;
  Alerts alerts;
  for (double t_s = 0.0; t_s < kMaxApproach_s; t_s += kDt_s) {
    sensing.step(scene.inputs(q, speeds), out);
    if (t_s == 0.0 && out.worst.mu > 0.0) return std::nullopt;  // it begins in fluid
    alerts.take(out, t_s);
    if (scene.touches(out)) {
      robot::LinkPoses X_WL;
      scene.model.arm.link_poses(q, X_WL);
      const double speed_m_s =
          scene.model.arm.point_velocity_W(out.worst.link, out.worst.position_W_m, X_WL, speeds).norm();
      return Approach{speed_m_s, t_s - alerts.since_s(out.worst.object).value_or(t_s)};
    }
    for (std::size_t j = 0; j < scene.model.arm.joint_count(); ++j) {
      const robot::Joint& joint = scene.model.arm.joints()[j];
      q[j] += speeds[j] * kDt_s;
      if (q[j] < joint.lower || q[j] > joint.upper) return std::nullopt;
    }
  }
  return std::nullopt;
}

/// Random approaches whose contact comes at 0.05 to 0.5 m/s.
std::vector<Approach> approaches(const Scene& scene, std::size_t count) {
  constexpr double kSlowest_m_s = 0.05, kFastest_m_s = 0.5;
  std::mt19937 random(681);
  std::uniform_real_distribution<double> share(0.05, 0.4), along(0.0, 1.0);
  std::normal_distribution<double> direction;
  std::vector<Approach> found;
  while (found.size() < count) {
    core::JointArray q{}, speeds{};
    const double speed = share(random);
    double norm = 0.0;
    for (std::size_t j = 0; j < scene.model.arm.joint_count(); ++j) {
      const robot::Joint& joint = scene.model.arm.joints()[j];
      q[j] = joint.lower + (joint.upper - joint.lower) * along(random);
      speeds[j] = direction(random);
      norm += speeds[j] * speeds[j];
    }
    for (std::size_t j = 0; j < scene.model.arm.joint_count(); ++j)
      speeds[j] *= speed * scene.model.arm.joints()[j].max_speed / std::sqrt(norm);
    const auto one = approach(scene, q, speeds);
    if (one && one->speed_m_s >= kSlowest_m_s && one->speed_m_s <= kFastest_m_s) found.push_back(*one);
  }
  return found;
}

/// The cell with one wall beside the arm at its home, `gap_m` from its farthest sensor along +y.
runtime::CellConfig beside_a_wall(runtime::CellConfig cell, const phantom_sensing::PhantomModel& model,
                                  const core::JointArray& home, double gap_m) {
  robot::LinkPoses X_WL;
  model.arm.link_poses(home, X_WL);
  double farthest_m = -1e9;
  for (std::size_t i = 0; i < model.skin.size(); ++i)
    farthest_m = std::max(farthest_m, (X_WL[model.skin.link_of(i)] * model.skin.position(i)).y());
  runtime::ObjectConfig wall = cell.objects.front();
  wall.mesh.clear();
  wall.polyhedron_O = geometry::make_box({2.2, 0.02, 1.6});
  wall.X_WO = {Eigen::Matrix3d::Identity(), {0.0, farthest_m + gap_m + 0.01, 0.8}};
  cell.objects = {wall};
  return cell;
}

/// Walks the gantry to and fro along the wall, with the tremor of a hand across it. Returns the alerts of a
/// minute.
std::size_t alerts_along(const Scene& scene, const core::JointArray& home, double speed_m_s) {
  constexpr double kHalf_m = 0.35, kTremor_m = 0.0003, kTremor_Hz = 8.0, kMinute_s = 60.0;
  constexpr std::size_t kYaw = 1;
  PhantomSensing sensing(scene.model, {});
  StepOutputs out;
  Alerts alerts;
  core::JointArray q = home, speeds{};
  const double period_s = 4.0 * kHalf_m / speed_m_s, w = 2.0 * std::numbers::pi * kTremor_Hz;
  for (double t_s = 0.0; t_s < kMinute_s; t_s += kDt_s) {
    const double phase = std::fmod(t_s, period_s) / period_s;
    speeds[0] = phase < 0.25 || phase >= 0.75 ? speed_m_s : -speed_m_s;
    q[0] = kHalf_m * (phase < 0.25 ? 4.0 * phase : phase < 0.75 ? 2.0 - 4.0 * phase : 4.0 * phase - 4.0);
    q[kYaw] = home[kYaw] + kTremor_m * std::sin(w * t_s);  // a metre from the axis: as many metres as radians
    speeds[kYaw] = kTremor_m * w * std::cos(w * t_s);
    sensing.step(scene.inputs(q, speeds), out);
    alerts.take(out, t_s);
  }
  return alerts.raised();
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void run(Report& report, const Settings& settings) {
  const auto cell = runtime::load_cell(settings.source_dir / "deploy/cells/hot_cell/cell.yaml");
  const Scene scene(cell, settings);
  double layers_m = 0.0;
  const workspace::LayerProfile& profile = cell.objects.front().profile;
  for (const auto thickness : profile.thickness_vox) layers_m += thickness * cell.voxel_size_m.reference_m();

  Table& table =
      report.table("approaches", {"speed at contact [m/s]", "lead time [s]", "time in layers [s]"});
  std::vector<double> slow_s;
  std::vector<bool> in_time;
  for (const Approach& one : approaches(scene, settings.fast ? 60 : 300)) {
    const double layers_s = layers_m / one.speed_m_s;
    table.row({one.speed_m_s, one.lead_s, layers_s});
    if (layers_s >= kReaction_s + 0.1) slow_s.push_back(one.lead_s);
    if (layers_s >= kWanted_s + 0.1) in_time.push_back(one.lead_s >= kWanted_s);
  }
  Table& bound = report.table("bound", {"speed at contact [m/s]", "layers [s]"});
  for (double v_m_s = 0.05; v_m_s <= 0.5; v_m_s += 0.01) bound.row({v_m_s, layers_m / v_m_s});
  report
      .plot("lead",
            "Time from the alert of an object to the contact with it, random straight approaches of the "
            "shipped arm in the shipped hot cell")
      .panel("", "speed of the place at the contact [m/s]", "lead time [s]")
      .series(table, "speed at contact [m/s]", "lead time [s]", "approaches", Style::kPoints)
      .series(bound, "speed at contact [m/s]", "layers [s]", "straight through all layers", Style::kDashed)
      .horizontal_band(kQuickReaction_s, kReaction_s, "a person's reaction")
      .range_y(0.0, 2.5);
  const auto announced = static_cast<double>(std::count(in_time.begin(), in_time.end(), true));
  report.check("median lead time where layers and speed leave 0.6 s", quantile(slow_s, 0.5), kReaction_s,
               30.0, "s");
  report.check("share of contacts announced 0.3 s before, where layers and speed leave 0.4 s",
               announced / static_cast<double>(in_time.size()), 0.95, 1.0, "");

  core::JointArray home{};
  std::copy(cell.arms.front().home.begin(), cell.arms.front().home.end(), home.begin());
  std::size_t alerts = 0;
  for (const double gap_m : {0.05, 0.09}) {
    const Scene walled(beside_a_wall(cell, scene.model, home, gap_m), settings);
    for (const double speed_m_s : {0.05, 0.15})
      alerts = std::max(alerts, alerts_along(walled, home, speed_m_s));
  }
  report.check("alerts in a minute's walk along a wall, 50 and 90 mm from it, at 0.05 and 0.15 m/s",
               static_cast<double>(alerts), 0.0, 1.0, "");
  report.prints_no_more(
      "Section 6.8.1 (page 216) asks for the longest possible time before a hit and prints no time. The reaction of 0.2 to "
      "0.5 s is that of a person who waits for a signal, to one who does not.");
}

}  // namespace
}  // namespace in_lead_time

Experiment lead_time() {
  return {
      "lead-time",
      "Lead time: from the alert to the contact",
      "section 6.8.1",
      "The rules leave the operator as much time before a hit as possible, and a motion along a wall does "
      "not alert.",
      {Sabotage::kIgnoredSpeed},
      in_lead_time::run};
}

}  // namespace phantom::experiments
