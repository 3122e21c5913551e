// Which links threaten to hit which objects: the part of PhantomSensing that judges the hit rules (thesis
// 6.8.1) at each link's own places, so that a link in thick fluid hides no other one.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {
namespace {

/// Greatest number of sensors of one link, beside one for each block of its skin, that are looked at first.
constexpr std::size_t kMaxPlaces = 12;
/// Greatest number of gradients that are computed in a step for sensors that search() did not choose. Those
/// that the steps before computed are known, so that a few steps look at all of them.
constexpr std::size_t kMaxGradients = 1024;
/// By how much a central difference of μ may understate the cosine of PGV and motion: sensors farther below
/// the rule's are not looked at more closely.
constexpr double kCosineSlack = 0.7;
constexpr double kBeyondAnyLimit = 1e9;

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

/// A link in one fluid: what the search for its threats there needs to know.
struct PhantomSensing::LinkInFluid {
  LinkInFluid(const PhantomSensing& of, const StepInputs& inputs, std::size_t link_in, std::size_t fluid_in)
      : link(link_in),
        fluid(fluid_in),
        other(fluid == 0 ? nullptr : &inputs.others[fluid - 1]),
        voxels(other != nullptr ? *other->fluid : *inputs.workspace.voxels),
        skin(other != nullptr ? of.sensing_->in_fluid(fluid - 1) : *of.sensing_),
        layout(of.sensing_->layout()),
        settings(of.settings_),
        velocity(of.model_.arm, link, of.X_WL_, inputs.velocity),
        R_WL(of.X_WL_[link].rotation),
        closing_per_s(layout.closing_m.empty() ? 0.0 : inputs.fingers.closing_per_s),
        greatest_closing_m_s(std::abs(closing_per_s) * of.greatest_way_m_),
        least_share(std::min(1.0, settings.alert.clear_speed_share) * (1.0 - 1e-9)) {
    if (other != nullptr)
      velocity.relate_to(other->linear_W_m_s, other->angular_W_rad_s, other->X_WL.translation_m,
                         of.X_WL_[link]);
  }

  Eigen::Vector3d velocity_of(std::size_t sensor) const noexcept {
    const Eigen::Vector3d v_m_s = velocity.at(layout.position(sensor));
    if (closing_per_s == 0.0) return v_m_s;
    return v_m_s + closing_per_s * (R_WL * layout.closing_m[sensor]);
  }
  double share_of_limit(double speed_m_s, double mu) const noexcept {
    const double limit_m_s = settings.hit.limit.at(mu);
    return limit_m_s > 0.0 ? speed_m_s / limit_m_s : speed_m_s > 0.0 ? kBeyondAnyLimit : 0.0;
  }
  /// How fast a place nears what it is in the fluid of, by central differences; 0 where they find no
  /// direction.
  double closing_m_s(const workspace::Index3& voxel, const Eigen::Vector3d& v_m_s) const noexcept {
    return v_m_s.dot(in_W(rise_at(voxels, voxel, settings.cluster_reach_vox)));
  }
  /// Turns a direction of the fluid's axes into W's.
  Eigen::Vector3d in_W(const Eigen::Vector3d& direction) const noexcept {
    return other != nullptr ? Eigen::Vector3d(other->X_WL.rotation * direction) : direction;
  }
  bool may_near(double closing_m_s, double speed_m_s) const noexcept {
    return closing_m_s == 0.0 || closing_m_s > (settings.hit.cosine - kCosineSlack) * speed_m_s;
  }

  const std::size_t link, fluid;
  const OtherLink* const other;
  const workspace::Workspace& voxels;
  robot::SkinSensing& skin;
  const robot::SkinLayout& layout;
  const PerceptSettings& settings;
  robot::PlaceVelocity velocity;
  const Eigen::Matrix3d R_WL;
  const double closing_per_s;         // of the fingers, in shares of their way
  const double greatest_closing_m_s;  // the most that this adds to a sensor's speed
  const double least_share;
};

/// Collects sensors of a link at which a rule may hold: those that are very close, and those that are faster
/// than the least that counts.
void PhantomSensing::search(const LinkInFluid& in, Prospects& found) const noexcept {
  if (const robot::WorstSensor& worst = in.skin.worst_of(in.link); worst.found) {
    const auto mu = static_cast<double>(worst.mu);
    const double share = in.share_of_limit(in.velocity_of(worst.sensor).norm(), mu);
    if (mu >= settings_.hit.mu_unsafe || share > in.least_share)
      found.offer_worst(worst.object, {worst.sensor, in.fluid, worst.voxel, mu, share, 0.0});
  }
  in.skin.for_each_place(in.link, kMaxPlaces, [&](std::size_t sensor, std::uint8_t code) {
    const auto mu = static_cast<double>(in.voxels.palette()[code]);
    const Eigen::Vector3d v_m_s = in.velocity_of(sensor);
    const double speed_m_s = v_m_s.norm(), share = in.share_of_limit(speed_m_s, mu);
    const bool moves = share > in.least_share, moderate = mu >= settings_.hit.mu_moderate;
    if (!moves && mu < settings_.hit.mu_unsafe) return;
    const auto voxel = in.skin.place_of(in.link, sensor, code, in.voxels);
    if (!voxel) return;
    const std::uint16_t object = in.voxels.object(*voxel);
    Prospect prospect{sensor, in.fluid, *voxel, mu, share, speed_m_s};  // it nears no faster than it moves
    if (!found.may_matter(object, prospect, moderate)) return;
    prospect.closing_m_s = moves ? in.closing_m_s(*voxel, v_m_s) : 0.0;
    if (moves && !moderate && !in.may_near(prospect.closing_m_s, speed_m_s)) return;
    found.offer(object, prospect, moderate);
  });
}

/// Assesses one prospect by the rules. Returns whether it raises an alert.
bool PhantomSensing::assess(const StepInputs& inputs, std::size_t link, std::uint16_t object,
                            const Prospect& prospect, ThreatList& threats) const noexcept {
  const double least_share = std::min(1.0, settings_.alert.clear_speed_share) * (1.0 - 1e-9);
  if (prospect.mu < settings_.hit.mu_unsafe && prospect.speed_share <= least_share) return false;
  const robot::SkinLayout& layout = sensing_->layout();
  Threat threat;
  threat.link = link;
  threat.sensor = prospect.sensor;
  threat.mu = prospect.mu;
  threat.object = object;
  threat.position_W_m = X_WL_[link] * layout.position(prospect.sensor);
  const Eigen::Vector3d way_m =
      layout.closing_m.empty() ? Eigen::Vector3d::Zero() : layout.closing_m[prospect.sensor];
  perceive_place(inputs, {link, way_m, prospect.voxel, prospect.fluid}, threat);
  if (percept::assess_hit(situation_of(threat), settings_.hit,
                          std::min(1.0, settings_.alert.clear_speed_share)) == percept::HitRule::kNone)
    return false;
  time_contact(inputs, prospect.fluid, threat);
  return offer(threat, threats);
}

/// Assesses a link's prospects by the rules, for each object the thickest, the fastest, and those that near,
/// until one raises an alert.
void PhantomSensing::assess(const StepInputs& inputs, std::size_t link, const Prospects& found,
                            ThreatList& threats) const noexcept {
  for (const Prospects::OfObject& of : found) {
    const auto raises = [&](const Prospect& prospect) {
      return assess(inputs, link, of.object, prospect, threats);
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

/// For an object, the sensors that move most directly at it of those at which the rule holds: at the speed
/// limit, and at the share of it that keeps an alert up.
struct MostDirect {
  std::uint16_t object = 0;
  std::optional<FastPlace> raising, holding;
};

bool is_more_direct(const FastPlace& a, const FastPlace& b) noexcept {
  return std::tuple(b.cosine, a.sensor) < std::tuple(a.cosine, b.sensor);
}

/// Judges the sensors in thin fluid that are too fast, and assesses the one of each object that seems to move
/// most directly at it. Those whose gradient is not known count in the order of how direct they seem, as long
/// as `gradients` lasts.
void PhantomSensing::assess_fast_places(const StepInputs& inputs, const LinkInFluid& in,
                                        std::size_t& gradients, ThreatList& threats) noexcept {
  const bool keeps = in.other == nullptr && !inputs.allowed.concerns(in.link);
  if (keeps) gradients_.follow(in.voxels);
  core::BoundedList<MostDirect, Prospects::kMaxObjects> found;
  const auto is_surpassed = [&](const FastPlace& place) {
    const auto known = std::ranges::find(found, place.object, &MostDirect::object);
    return known != found.end() && known->raising && is_more_direct(*known->raising, place);
  };
  const auto judge = [&](const FastPlace& place, const Eigen::Vector3d& pgv_m) {
    const Eigen::Vector3d v_m_s = in.velocity_of(place.sensor);
    const auto cosine = percept::approach_cosine(in.in_W(pgv_m), v_m_s, settings_.motion.least_speed_m_s);
    const percept::HitSituation situation{static_cast<double>(place.mu), v_m_s.norm(), cosine};
    if (percept::assess_hit(situation, settings_.hit, in.least_share) == percept::HitRule::kNone) return;
    auto of = std::ranges::find(found, place.object, &MostDirect::object);
    if (of == found.end()) {
      if (!found.push_back({place.object, {}, {}})) return;
      of = &found.back();
    }
    const bool raises = percept::assess_hit(situation, settings_.hit) != percept::HitRule::kNone;
    std::optional<FastPlace>& best = raises ? of->raising : of->holding;
    if (!best || is_more_direct(place, *best)) best = place;
  };
  const auto end = fast_places_.end();
  const auto unknown = std::partition(fast_places_.begin(), end, [&](const FastPlace& place) {
    return keeps && gradients_.find(place.voxel) != nullptr;
  });
  for (auto place = fast_places_.begin(); place != unknown; ++place)
    judge(*place, *gradients_.find(place->voxel));
  const auto left = std::partition(unknown, end, is_surpassed);
  const auto looked_at = left + static_cast<std::ptrdiff_t>(std::min<std::size_t>(gradients, end - left));
  if (looked_at != end) std::nth_element(left, looked_at, end, is_more_direct);
  std::sort(left, looked_at, is_more_direct);
  for (auto place = left; place != looked_at; ++place) {
    if (is_surpassed(*place)) continue;
    --gradients;
    const Eigen::Vector3d pgv_m = zone_.gradient(in.voxels, place->voxel, in.link, inputs.allowed).pgv_W_m;
    if (keeps) gradients_.put(place->voxel, pgv_m);
    judge(*place, pgv_m);
  }
  for (const MostDirect& of : found) {
    const FastPlace& place = of.raising ? *of.raising : *of.holding;
    assess(inputs, in.link, of.object,
           {place.sensor, in.fluid, place.voxel, static_cast<double>(place.mu),
            static_cast<double>(place.share)},
           threats);
  }
}

/// Looks at every sensor of a link that may be too fast or very close near an object for which no alert is
/// raised yet, so that none is missed for the sake of those that search() has chosen. `gradients`: how many
/// it may still compute in this step.
void PhantomSensing::complete(const StepInputs& inputs, const LinkInFluid& in, std::size_t& gradients,
                              ThreatList& threats) noexcept {
  if (!in.skin.worst_of(in.link).found) return;
  const auto threat_of = [&](std::uint16_t object) {
    return std::find_if(threats.begin(), threats.end(), [&](const Threat& threat) {
      return threat.link == in.link && threat.object == object;
    });
  };
  const auto is_raised = [&](std::uint16_t object) {
    const auto threat = threat_of(object);
    return threat != threats.end() && threat->raises;
  };
  // A slower sensor keeps an alert up, but raises none.
  const double least_share =
      monitor_.has_alert(static_cast<std::uint32_t>(in.link)) ? in.least_share : 1.0 - 1e-9;
  const robot::CodeSpeedLimits limits(in.voxels.palette(), [&](double mu) {
    return mu >= settings_.hit.mu_unsafe ? -1.0 : least_share * settings_.hit.limit.at(mu);
  });
  fast_places_.clear();
  in.skin.for_each_exceeding(
      in.link, in.velocity, in.greatest_closing_m_s, limits, in.voxels, kMaxFastPlaces, is_raised,
      [&](std::size_t sensor, std::uint8_t code) {
        const auto voxel = in.skin.place_of(in.link, sensor, code, in.voxels);
        if (!voxel) return;
        const std::uint16_t object = in.voxels.object(*voxel);
        const auto known = threat_of(object);
        if (known != threats.end() && known->raises) return;
        const auto mu = static_cast<double>(in.voxels.palette()[code]);
        const Eigen::Vector3d v_m_s = in.velocity_of(sensor);
        const double speed_m_s = v_m_s.norm(), share = in.share_of_limit(speed_m_s, mu);
        const bool unsafe = mu >= settings_.hit.mu_unsafe;
        if (!unsafe && share <= (known != threats.end() ? 1.0 : least_share)) return;
        if (unsafe || mu >= settings_.hit.mu_moderate) {
          assess(inputs, in.link, object, {sensor, in.fluid, *voxel, mu, share}, threats);
        } else if (fast_places_.size() < fast_places_.capacity()) {
          fast_places_.push_back({static_cast<std::uint32_t>(sensor), object, *voxel, static_cast<float>(mu),
                                  static_cast<float>(in.closing_m_s(*voxel, v_m_s) / speed_m_s),
                                  static_cast<float>(share)});
        }
      });
  assess_fast_places(inputs, in, gradients, threats);
}

/// Finds the threats of the links that are sensed here, and takes those of the others.
void PhantomSensing::find_threats(const StepInputs& inputs, StepOutputs& outputs) noexcept {
  std::size_t gradients = kMaxGradients;
  for (std::size_t link = 1; link <= model_.arm.joint_count(); ++link) {
    const std::size_t fluids = 1 + std::min(inputs.others.size(), model_.other_links);
    const LinkInFluid in_workspace(*this, inputs, link, 0);
    prospects_.clear();
    search(in_workspace, prospects_);
    for (std::size_t fluid = 1; fluid < fluids; ++fluid)
      search(LinkInFluid(*this, inputs, link, fluid), prospects_);
    assess(inputs, link, prospects_, outputs.threats);
    complete(inputs, in_workspace, gradients, outputs.threats);
    for (std::size_t fluid = 1; fluid < fluids; ++fluid)
      complete(inputs, LinkInFluid(*this, inputs, link, fluid), gradients, outputs.threats);
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
