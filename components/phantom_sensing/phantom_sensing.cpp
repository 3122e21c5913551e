#include "components/phantom_sensing/phantom_sensing.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <thread>

#include "common/percept/closeness.hpp"

namespace phantom::phantom_sensing {
namespace {

std::size_t threads_for(std::size_t sensors) {
  const std::size_t wanted =
      (sensors + PerceptSettings::kSensorsOfThread - 1) / PerceptSettings::kSensorsOfThread;
  return std::clamp<std::size_t>(wanted, 1, std::max(1U, std::thread::hardware_concurrency()));
}

robot::LinkSet links_of_process(const PhantomModel& model) {
  if (model.own_share) return model.shares[*model.own_share].links;
  robot::LinkSet links = robot::all_links();
  for (const SkinShare& share : model.shares) links &= ~share.links;
  return links;
}

/// Adds the coefficients of other links of the arm. Those of joints are sums over the links they move.
void add(const robot::DragCoefficients& links, robot::DragCoefficients& arm) noexcept {
  for (std::size_t j = 0; j < core::kMaxJoints; ++j) {
    arm.plus[j] += links.plus[j];
    arm.minus[j] += links.minus[j];
    arm.sigma[j] += links.sigma[j];
  }
  for (std::size_t i = 0; i < robot::kPackedMatrix; ++i) arm.coupled[i] += links.coupled[i];
}

void add(const robot::JointReaction& links, robot::JointReaction& arm) noexcept {
  for (std::size_t j = 0; j < core::kMaxJoints; ++j) {
    arm.torque[j] += links.torque[j];
    arm.stiffness[j] += links.stiffness[j];
  }
}

}  // namespace

robot::SensingOptions sensing_options(const PhantomModel& model, const PerceptSettings& settings,
                                      std::size_t sensors) {
  return {settings.directional.enabled,
          settings.gradient_reach_vox,
          settings.memory,
          settings.response,
          settings.threads != 0 ? settings.threads : threads_for(sensors),
          model.medium,
          model.other_links};
}

PhantomSensing::PhantomSensing(const PhantomModel& model, const PerceptSettings& settings)
    : model_(model),
      settings_(settings),
      own_sensing_(model.skin, sensing_options(model, settings, model.skin.size())),
      soft_(model.soft_bodies),
      zone_(settings.cluster_reach_vox, settings.cluster_shape),
      monitor_(settings.hit, settings.alert),
      doubts_(settings.doubt.timing),
      interest_(model.interest_points.size()),
      own_links_(links_of_process(model)),
      boxes_(boxes_of_share(model, model.skin)) {
  fast_places_.reserve(kMaxFastPlaces);
  for (const Eigen::Vector3d& way_m : model.skin.closing_m)
    greatest_way_m_ = std::max(greatest_way_m_, way_m.norm());
}

std::vector<LinkBox> boxes_of_share(const PhantomModel& model, const robot::SkinLayout& layout) {
  std::vector<LinkBox> boxes;
  if (!model.own_share || !model.shares[*model.own_share].has_own_workspace()) return boxes;
  for (std::size_t link = 1; link <= core::kMaxJoints; ++link) {
    if (!model.shares[*model.own_share].links[link]) continue;
    if (const auto box_m = layout.box_of(link)) boxes.push_back({link, {box_m->first, box_m->second}});
  }
  return boxes;
}

/// Returns whether a sensor of the own share, or the zone around one, may be outside of the grid, where no
/// fluid is known.
bool PhantomSensing::reaches_out(const SensedWorkspace& workspace) const noexcept {
  const workspace::GridSpec& grid = workspace.voxels->grid();
  const std::vector<LinkBox>& boxes = workspace.boxes != nullptr ? *workspace.boxes : boxes_;
  const int margin_vox = std::max(settings_.gradient_reach_vox, settings_.cluster_reach_vox);
  const Eigen::Vector3d margin_m = margin_vox * grid.voxel_size_m.sides_m();
  const Eigen::AlignedBox3d inside(grid.origin_m + margin_m, grid.origin_m + grid.extent_m() - margin_m);
  return std::any_of(boxes.begin(), boxes.end(), [&](const LinkBox& link) {
    for (int corner = 0; corner < 8; ++corner) {
      const auto which = static_cast<Eigen::AlignedBox3d::CornerType>(corner);
      if (!inside.contains(X_WL_[link.link] * link.box_m.corner(which))) return true;
    }
    return false;
  });
}

/// Velocity of a place on the arm, with what fingers that open or close add.
Eigen::Vector3d PhantomSensing::velocity_W(const StepInputs& inputs, std::size_t link,
                                           const Eigen::Vector3d& closing_m,
                                           const Eigen::Vector3d& position_W_m) const noexcept {
  return model_.arm.point_velocity_W(link, position_W_m, X_WL_, inputs.velocity) +
         inputs.fingers.closing_per_s * (X_WL_[link].rotation * closing_m);
}

/// Fills the fields that follow from the place's μ, position and object, which must be set, but for the time
/// to contact.
void PhantomSensing::perceive_place(const StepInputs& inputs, const Felt& felt,
                                    PlacePercept& place) const noexcept {
  const OtherLink* const other = felt.fluid == 0 ? nullptr : &inputs.others[felt.fluid - 1];
  place.closeness = percept::closeness(
      place.mu, other != nullptr ? other->greatest_neighbour_mu : inputs.workspace.greatest_neighbour_mu);
  place.velocity_W_m_s = velocity_W(inputs, felt.link, felt.closing_m, place.position_W_m);
  place.gradient = zone_.gradient(other != nullptr ? *other->fluid : *inputs.workspace.voxels, felt.voxel,
                                  felt.link, inputs.allowed);
  if (other != nullptr) {
    place.velocity_W_m_s -= other->velocity_W(place.position_W_m);
    place.gradient.pgv_W_m = other->X_WL.rotation * place.gradient.pgv_W_m;
  }
  classify(place);
}

/// Fills the motion class of a place whose gradient and velocity are set.
void PhantomSensing::classify(PlacePercept& place) const noexcept {
  place.motion = percept::classify_motion(place.gradient.pgv_W_m, place.velocity_W_m_s, settings_.motion);
}

/// Returns what the hit rules need of a place.
percept::HitSituation PhantomSensing::situation_of(const PlacePercept& place) const noexcept {
  return {place.mu, place.velocity_W_m_s.norm(),
          percept::approach_cosine(place.gradient.pgv_W_m, place.velocity_W_m_s,
                                   settings_.motion.least_speed_m_s)};
}

/// Fills the percept of the worst sensor of the whole skin, which another process may have sensed in a
/// workspace of its own.
void PhantomSensing::perceive_worst(const StepInputs& inputs, StepOutputs& outputs) const noexcept {
  SensorPercept& percept = outputs.worst;
  const robot::WorstSensor& worst = sensing_->worst();
  if (worst_remote_ != nullptr && (!worst.found || worst_remote_->mu > worst.mu)) {
    static_cast<PlacePercept&>(percept) = worst_remote_->place;
    percept.link = worst_remote_->link;
    percept.sensor = worst_remote_->sensor;
    classify(percept);
  } else if (worst.found) {
    percept.mu = static_cast<double>(worst.mu);
    percept.object = worst.object;
    percept.position_W_m = worst.position_W_m;
    percept.link = worst.link;
    percept.sensor = worst.sensor;
    const auto& closing_m = sensing_->layout().closing_m;
    const Eigen::Vector3d way_m = closing_m.empty() ? Eigen::Vector3d::Zero() : closing_m[worst.sensor];
    perceive_place(inputs, {worst.link, way_m, worst.voxel, worst.fluid}, percept);
    time_contact(inputs, worst.fluid, percept);
  }
}

/// Looks up the fluid of greatest μ at an interest point, whose position must be set.
PhantomSensing::Felt PhantomSensing::feel(const StepInputs& inputs, const InterestPoint& point,
                                          InterestPercept& percept) const noexcept {
  Felt felt{point.link, point.closing_m, {}, 0};
  const auto look_up = [&](const workspace::Workspace& voxels, const Eigen::Vector3d& position_m,
                           std::size_t fluid) {
    const workspace::Index3 voxel = voxels.grid().index_of(position_m);
    const auto mu = static_cast<double>(voxels.mu(voxel));
    if (mu <= percept.mu) return;
    if (inputs.allowed.mutes(point.link, voxels.object(voxel))) {
      percept.muted = true;
      if (percept.mu == 0.0) percept.object = voxels.object(voxel);
      return;
    }
    percept.mu = mu;
    percept.object = voxels.object(voxel);
    felt.voxel = voxel;
    felt.fluid = fluid;
  };
  look_up(*inputs.workspace.voxels, percept.position_W_m, 0);
  for (std::size_t k = 0; k < inputs.others.size(); ++k)
    look_up(*inputs.others[k].fluid, inputs.others[k].X_WL.inverse() * percept.position_W_m, k + 1);
  if (percept.mu > 0.0) percept.muted = false;
  return felt;
}

void PhantomSensing::perceive_interest_points(const StepInputs& inputs, ThreatList& threats) noexcept {
  for (std::size_t i = 0; i < interest_.size(); ++i) {
    const InterestPoint& point = model_.interest_points[i];
    InterestPercept& percept = interest_[i];
    percept = {};
    percept.position_W_m = X_WL_[point.link] * (point.position_m + inputs.fingers.closed * point.closing_m);
    percept.velocity_W_m_s = velocity_W(inputs, point.link, point.closing_m, percept.position_W_m);
    const Felt felt = feel(inputs, point, percept);
    if (!(percept.mu > 0.0)) continue;
    perceive_place(inputs, felt, percept);
    time_contact(inputs, felt.fluid, percept);
    Threat threat;
    static_cast<PlacePercept&>(threat) = percept;
    threat.link = point.link;
    threat.interest_point = static_cast<std::int32_t>(i);
    offer(threat, threats);
  }
}

void PhantomSensing::set_muted(const percept::AllowedContact& contacts, bool muted) noexcept {
  contacts.for_each([&](std::uint16_t object, std::size_t link) {
    const bool whole = link == percept::AllowedContact::kWholeArm;
    for (std::size_t l = whole ? 1 : link; l <= (whole ? model_.arm.joint_count() : link); ++l)
      sensing_->mute(l, object, muted);
  });
}

/// Updates the contacts that the skin must not feel, if they have changed.
void PhantomSensing::mute(const percept::AllowedContact& allowed) noexcept {
  if (allowed == muted_) return;
  set_muted(muted_, false);
  set_muted(allowed, true);
  muted_ = allowed;
}

void PhantomSensing::set_active_skin(robot::SkinSensing* carrying) noexcept {
  robot::SkinSensing* const next = carrying != nullptr ? carrying : &own_sensing_;
  if (next == sensing_) return;
  set_muted(muted_, false);  // it may be worn again
  muted_ = {};
  next->continue_from(*sensing_, model_.skin);
  sensing_ = next;
}

/// Ends all alerts and clears the sensors' memory of μ, because their inputs are no longer known.
void PhantomSensing::forget(StepOutputs& outputs) noexcept {
  monitor_.close(outputs.alerts);
  doubts_.close(outputs.doubts);
  sensing_->forget();
  std::fill(interest_.begin(), interest_.end(), InterestPercept{});
}

/// Adds the coefficients of links that have been sensed here.
void PhantomSensing::add_drag_of(const robot::LinkSet& links, const StepInputs& inputs,
                                 StepOutputs& outputs) noexcept {
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link)
    sums_of_links_[link] = links[link] ? sensing_->sums()[link] : robot::ViscousSums{};
  robot::drag_coefficients(model_.arm, X_WL_, sums_of_links_, settings_.directional, inputs.velocity,
                           drag_of_links_);
  add(drag_of_links_, outputs.drag);
}

/// Adds what soft bodies do to links that have been sensed here.
void PhantomSensing::add_reaction_of(const robot::LinkSet& links, const StepInputs& inputs,
                                     StepOutputs& outputs) noexcept {
  outputs.reaction.position = inputs.position;
  if (model_.soft_bodies.empty()) return;
  soft_.sense(*sensing_, X_WL_, *inputs.workspace.voxels, links);
  robot::joint_reaction(model_.arm, X_WL_, soft_.links(), inputs.position, reaction_of_links_);
  add(reaction_of_links_, outputs.reaction);
}

/// Adds a share that was sensed elsewhere. Returns false if its worst sensor does not meet that μ here, or
/// the arm carries something else in the workspace of its own.
bool PhantomSensing::take_share(const StepInputs& inputs, std::size_t which, const SensedShare& share,
                                StepOutputs& outputs) noexcept {
  if (model_.shares[which].has_own_workspace()) {
    if (inputs.workspace.carried_key != share.carried_key) return false;
    if (share.mu > (worst_remote_ != nullptr ? worst_remote_->mu : 0.0F)) worst_remote_ = &share;
  } else if (share.mu > 0.0F &&
             !sensing_->consider(X_WL_, *inputs.workspace.voxels, share.sensor, share.mu)) {
    return false;
  }
  add(share.drag, outputs.drag);
  add(share.reaction, outputs.reaction);
  sensed_elsewhere_[which] = &share;
  muted_elsewhere_ += share.muted_sensors;
  return true;
}

void PhantomSensing::begin(const StepInputs& inputs, StepOutputs& outputs) noexcept {
  outputs = {};
  outputs.drag_mode = settings_.mode;
  outputs.interest = interest_;
  muted_elsewhere_ = 0;
  worst_remote_ = nullptr;
  sensed_elsewhere_ = {};
  set_active_skin(inputs.workspace.carrying);
  const bool known = inputs.workspace.voxels != nullptr;
  if (known) outputs.workspace_version = inputs.workspace.voxels->version;
  outputs.carried_key = inputs.workspace.carried_key;
  if (!known || !inputs.state_valid) return forget(outputs);
  model_.arm.link_poses(inputs.position, X_WL_);
  outputs.outside = reaches_out(inputs.workspace);
  if (outputs.outside) return forget(outputs);
  mute(inputs.allowed);
  sensing_->close_gripper(inputs.fingers.closed);
  const std::size_t others = std::min(inputs.others.size(), model_.other_links);
  for (std::size_t k = 0; k < others; ++k) fluids_[k] = {inputs.others[k].fluid, inputs.others[k].X_WL};
  sensing_->sense(X_WL_, model_.arm.joint_count(), *inputs.workspace.voxels, own_links_,
                  std::span(fluids_).first(others));
  add_drag_of(own_links_, inputs, outputs);
  for (std::size_t k = 0; k < others; ++k) {
    const OtherLink& other = inputs.others[k];
    flows_[k] = {&sensing_->sums_in(k), other.X_WL.translation_m, other.linear_W_m_s, other.angular_W_rad_s};
  }
  robot::relieve_by_flow(model_.arm, X_WL_, std::span(flows_).first(others), settings_.directional.still,
                         inputs.velocity, outputs.drag);
  add_reaction_of(own_links_, inputs, outputs);
  outputs.valid = true;
  const std::size_t last = model_.arm.links().size() - 1;
  outputs.tip_W_m = X_WL_[last] * model_.arm.link_axis_m(last).second;
}

std::size_t PhantomSensing::end(const StepInputs& inputs, const SensedShares& shares,
                                StepOutputs& outputs) noexcept {
  if (!outputs.valid) return 0;
  std::size_t sensed_here = 0;
  for (std::size_t i = 0; i < model_.shares.size() && !model_.own_share; ++i) {
    if (shares[i] != nullptr && take_share(inputs, i, *shares[i], outputs)) continue;
    const robot::LinkSet& links = model_.shares[i].links;
    sensing_->sense_also(X_WL_, model_.arm.joint_count(), *inputs.workspace.voxels, links);
    add_drag_of(links, inputs, outputs);
    add_reaction_of(links, inputs, outputs);
    ++sensed_here;
  }
  if (!model_.own_share)  // the medium is felt by all links at once
    robot::add_medium_drag(model_.arm, X_WL_, sensing_->medium(), settings_.mode, outputs.drag);
  outputs.active_sensors = sensing_->active();
  outputs.muted_sensors = sensing_->muted() + muted_elsewhere_;
  perceive_worst(inputs, outputs);
  perceive_interest_points(inputs, outputs.threats);
  find_threats(inputs, outputs);
  outputs.threats.sort();
  lead(outputs);
  alert(inputs.dt_s, outputs);
  doubt(inputs, shares, outputs);
  outputs.percept.drag_torque =
      robot::drag_torque(outputs.drag, settings_.mode, inputs.velocity, model_.arm.joint_count());
  return sensed_here;
}

}  // namespace phantom::phantom_sensing
