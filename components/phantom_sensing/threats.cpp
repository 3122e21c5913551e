// Which links threaten to hit which objects: the part of PhantomSensing that judges the hit rules (thesis
// 6.8.1) at each link's own places, so that a link in thick fluid hides no other one.
#include <Eigen/Geometry>
#include <algorithm>
#include <tuple>

#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {
namespace {

/// Greatest number of sensors of one link, beside one for each block of its skin, that are looked at.
constexpr std::size_t kMaxPlaces = 64;
/// By how much a central difference of μ may understate the cosine of PGV and motion: sensors farther below
/// the rule's are not looked at more closely.
constexpr double kCosineSlack = 0.7;
constexpr double kBeyondAnyLimit = 1e9;

/// Velocity of the places of a link, which is linear in them: W axes, by the place in the link's frame.
struct LinkMotion {
  Eigen::Vector3d origin_m_s;
  Eigen::Matrix3d by_place;

  template <class VelocityAt>
  LinkMotion(const geometry::Pose& X_WL, const VelocityAt& velocity_at)
      : origin_m_s(velocity_at(X_WL.translation_m)) {
    for (Eigen::Index k = 0; k < 3; ++k)
      by_place.col(k) = velocity_at(X_WL * Eigen::Vector3d::Unit(k)) - origin_m_s;
  }
  Eigen::Vector3d at(const Eigen::Vector3d& p_L_m) const noexcept { return origin_m_s + by_place * p_L_m; }
};

/// Returns the direction in which μ rises, by central differences; zero where they find none.
Eigen::Vector3d rise_at(const workspace::Workspace& voxels, workspace::Index3 at, int reach) noexcept {
  const auto mu = [&](int x, int y, int z) {
    return static_cast<double>(voxels.mu({at.x + x, at.y + y, at.z + z}));
  };
  const Eigen::Vector3d rise(mu(reach, 0, 0) - mu(-reach, 0, 0), mu(0, reach, 0) - mu(0, -reach, 0),
                             mu(0, 0, reach) - mu(0, 0, -reach));
  return rise.cwiseQuotient(voxels.grid().voxel_size_m.stretch()).stableNormalized();
}

}  // namespace

bool more_urgent(const Threat& a, const Threat& b) noexcept {
  const auto key = [](const Threat& threat) {
    return std::tuple(!threat.raises, !threat.contact.is_nearing(), threat.contact.time_s, -threat.mu,
                      threat.link, threat.object, threat.sensor, threat.interest_point);
  };
  return key(a) < key(b);
}

void ThreatList::offer(const Threat& threat) noexcept {
  const auto same = std::find_if(begin(), end(), [&](const Threat& one) {
    return one.link == threat.link && one.object == threat.object;
  });
  if (same != end()) {
    if (more_urgent(threat, *same)) *same = threat;
    return;
  }
  if (push_back(threat)) return;
  const auto least = std::max_element(begin(), end(), more_urgent);
  if (more_urgent(threat, *least)) *least = threat;
}

void ThreatList::sort() noexcept { std::sort(begin(), end(), more_urgent); }

/// Estimates when a place, whose other fields are set, meets the object whose fluid it is in.
void PhantomSensing::time_contact(const StepInputs& inputs, std::size_t fluid,
                                  PlacePercept& place) const noexcept {
  const double least_m_s = settings_.motion.least_speed_m_s;
  if (fluid == 0) {
    place.contact = percept::time_to_contact(*inputs.workspace.voxels, place.position_W_m,
                                             place.gradient.pgv_W_m, place.velocity_W_m_s, least_m_s);
    return;
  }
  const OtherLink& other = inputs.others[fluid - 1];
  const Eigen::Matrix3d R_BW = other.X_WL.rotation.transpose();
  place.contact =
      percept::time_to_contact(*other.fluid, other.X_WL.inverse() * place.position_W_m,
                               R_BW * place.gradient.pgv_W_m, R_BW * place.velocity_W_m_s, least_m_s);
}

/// Keeps a threat if a rule holds there, at least at the share of the speed limit that keeps an alert up.
/// Returns whether it holds at the full limit.
bool PhantomSensing::offer(const Threat& threat, ThreatList& threats) const noexcept {
  const percept::HitSituation situation = situation_of(threat);
  Threat judged = threat;
  judged.rule = percept::assess_hit(situation, settings_.hit);
  judged.raises = judged.rule != percept::HitRule::kNone;
  if (!judged.raises)
    judged.rule = percept::assess_hit(situation, settings_.hit, settings_.alert.clear_speed_share);
  if (judged.rule != percept::HitRule::kNone) threats.offer(judged);
  return judged.raises;
}

/// Collects the sensors of a link at which a rule may hold: those that are very close, and those that are
/// faster than the least that counts.
void PhantomSensing::search(const StepInputs& inputs, std::size_t link, std::size_t fluid,
                            Prospects& found) const noexcept {
  const OtherLink* const other = fluid == 0 ? nullptr : &inputs.others[fluid - 1];
  const workspace::Workspace& voxels = other != nullptr ? *other->fluid : *inputs.workspace.voxels;
  const robot::SkinSensing& skin = other != nullptr ? sensing_->in_fluid(fluid - 1) : *sensing_;
  const robot::SkinLayout& layout = sensing_->layout();
  const LinkMotion motion(X_WL_[link], [&](const Eigen::Vector3d& p_W_m) -> Eigen::Vector3d {
    const Eigen::Vector3d v_m_s = model_.arm.point_velocity_W(link, p_W_m, X_WL_, inputs.velocity);
    return other != nullptr ? Eigen::Vector3d(v_m_s - other->velocity_W(p_W_m)) : v_m_s;
  });
  const bool has_fingers = !layout.closing_m.empty() && inputs.fingers.closing_per_s != 0.0;
  const auto velocity_of = [&](std::size_t sensor) -> Eigen::Vector3d {
    const Eigen::Vector3d v_m_s = motion.at(layout.position(sensor));
    if (!has_fingers) return v_m_s;
    return v_m_s + inputs.fingers.closing_per_s * (X_WL_[link].rotation * layout.closing_m[sensor]);
  };
  const double least_share = std::min(1.0, settings_.alert.clear_speed_share) * (1.0 - 1e-9);
  const auto share_of_limit = [&](double speed_m_s, double mu) {
    const double limit_m_s = settings_.hit.limit.at(mu);
    return limit_m_s > 0.0 ? speed_m_s / limit_m_s : speed_m_s > 0.0 ? kBeyondAnyLimit : 0.0;
  };
  if (const robot::WorstSensor& worst = skin.worst_of(link); worst.found) {
    const auto mu = static_cast<double>(worst.mu);
    const double share = share_of_limit(velocity_of(worst.sensor).norm(), mu);
    if (mu >= settings_.hit.mu_unsafe || share > least_share)
      found.offer_worst(worst.object, {worst.sensor, fluid, worst.voxel, mu, share, 0.0});
  }
  skin.for_each_place(link, kMaxPlaces, [&](std::size_t sensor, std::uint8_t code) {
    const auto mu = static_cast<double>(voxels.palette()[code]);
    const Eigen::Vector3d v_m_s = velocity_of(sensor);
    const double speed_m_s = v_m_s.norm(), share = share_of_limit(speed_m_s, mu);
    const bool moves = share > least_share, moderate = mu >= settings_.hit.mu_moderate;
    if (!moves && mu < settings_.hit.mu_unsafe) return;
    const auto voxel = skin.place_of(link, sensor, code, voxels);
    if (!voxel) return;
    double closing_m_s = 0.0;
    if (moves) {
      const Eigen::Vector3d up = rise_at(voxels, *voxel, settings_.cluster_reach_vox);
      closing_m_s = v_m_s.dot(other != nullptr ? Eigen::Vector3d(other->X_WL.rotation * up) : up);
      const bool may_near = up.isZero() || closing_m_s > (settings_.hit.cosine - kCosineSlack) * speed_m_s;
      if (!moderate && !may_near) return;
    }
    found.offer(voxels.object(*voxel), {sensor, fluid, *voxel, mu, share, closing_m_s}, moderate);
  });
}

/// Assesses a link's prospects by the rules, for each object the thickest, the fastest, and those that near,
/// until one raises an alert.
void PhantomSensing::assess(const StepInputs& inputs, std::size_t link, const Prospects& found,
                            ThreatList& threats) const noexcept {
  const robot::SkinLayout& layout = sensing_->layout();
  for (const Prospects::OfObject& of : found) {
    const auto raises = [&](const Prospect& prospect) {
      Threat threat;
      threat.link = link;
      threat.sensor = prospect.sensor;
      threat.mu = prospect.mu;
      threat.object = of.object;
      threat.position_W_m = X_WL_[link] * layout.position(prospect.sensor);
      const Eigen::Vector3d way_m =
          layout.closing_m.empty() ? Eigen::Vector3d::Zero() : layout.closing_m[prospect.sensor];
      perceive_place(inputs, {link, way_m, prospect.voxel, prospect.fluid}, threat);
      time_contact(inputs, prospect.fluid, threat);
      return offer(threat, threats);
    };
    bool raised = raises(of.thickest);
    if (!raised && of.fastest.sensor != of.thickest.sensor) raised = raises(of.fastest);
    // What nears fastest may be more urgent than what raises an alert already; the next ones only if none
    // does.
    for (const Prospect& prospect : of.nearing) {
      if (prospect.sensor != of.thickest.sensor) raised = raises(prospect) || raised;
      if (raised) break;
    }
  }
}

/// Finds the threats of the links that are sensed here, and takes those of the others.
void PhantomSensing::find_threats(const StepInputs& inputs, StepOutputs& outputs) noexcept {
  for (std::size_t link = 1; link <= model_.arm.joint_count(); ++link) {
    prospects_.clear();
    for (std::size_t fluid = 0; fluid <= std::min(inputs.others.size(), model_.other_links); ++fluid)
      search(inputs, link, fluid, prospects_);
    assess(inputs, link, prospects_, outputs.threats);
  }
  for (const SensedShare* share : sensed_elsewhere_) {
    if (share == nullptr) continue;
    for (const Threat& threat : share->threats) offer(threat, outputs.threats);
  }
}

/// Lets the most urgent threat lead the percept, or the worst sensor where none threatens. Needs no memory,
/// so the same state gives the same percept.
void PhantomSensing::lead(StepOutputs& outputs) const noexcept {
  SensorPercept& leading = outputs.percept;
  leading = outputs.worst;
  const bool threatens = !outputs.threats.empty() && outputs.threats.front().raises;
  if (threatens && !model_.own_share) leading = outputs.threats.front();
}

/// Raises and clears alerts, and says which rule holds where the percept is and at the interest points.
void PhantomSensing::alert(double dt_s, StepOutputs& outputs) noexcept {
  core::BoundedList<percept::HitCandidate, percept::ThreatMonitor::kMax> candidates;
  for (const Threat& threat : outputs.threats) {
    percept::HitCandidate candidate;
    candidate.situation = situation_of(threat);
    candidate.link = static_cast<std::uint32_t>(threat.link);
    candidate.sensor = static_cast<std::uint32_t>(threat.sensor);
    candidate.object = threat.object;
    candidate.interest_point = threat.interest_point;
    candidate.position_W_m = threat.position_W_m;
    candidate.pgv_W_m = threat.gradient.pgv_W_m;
    candidate.contact = threat.contact;
    candidates.push_back(candidate);
  }
  monitor_.step({candidates.begin(), candidates.size()}, dt_s, outputs.alerts);
  const auto rule_at = [this](const PlacePercept& place, std::size_t link) {
    const bool up = monitor_.alert_of(static_cast<std::uint32_t>(link), place.object) != 0;
    return percept::assess_hit(situation_of(place), settings_.hit,
                               up ? settings_.alert.clear_speed_share : 1.0);
  };
  outputs.percept.rule = rule_at(outputs.percept, outputs.percept.link);
  for (std::size_t i = 0; i < interest_.size(); ++i)
    interest_[i].rule = rule_at(interest_[i], model_.interest_points[i].link);
}

}  // namespace phantom::phantom_sensing
