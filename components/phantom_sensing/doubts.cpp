// Where what the arm feels contradicts the model.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/messages/living.hpp"
#include "common/percept/near_surface.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {
namespace {

using percept::DoubtEvidence;
using percept::DoubtKind;

constexpr double kDoubtPeriod_s = 0.01;  // between two looks
/// A joint bears a contact that exerts so much of the greatest torque on it.
constexpr double kBearsShare = 1e-3;
/// Places of a link at which a body is looked for, and sensors that are tried for a place on the skin.
constexpr std::size_t kMaxNearPlaces = 8, kMaxTriedSensors = 2048;

}  // namespace

/// Returns by how much the model may be wrong.
double PhantomSensing::tolerance_m(const workspace::Workspace& voxels) const noexcept {
  return settings_.doubt.tolerance_vox * voxels.grid().voxel_size_m.reference_m();
}

/// Returns the first link that a contact can be on, by the torques that it exerts: it is not before the last
/// joint that bears some of it.
std::size_t PhantomSensing::first_touched_link(const FeltForce& force) const noexcept {
  if (!force.torques_known) return model_.first_feeling_link;
  double greatest = 0.0;
  for (std::size_t j = 0; j < model_.arm.joint_count(); ++j)
    greatest = std::max(greatest, std::abs(force.torque_Nm[j]));
  std::size_t link = model_.first_feeling_link;
  for (std::size_t j = 0; j < model_.arm.joint_count(); ++j)
    if (std::abs(force.torque_Nm[j]) > kBearsShare * greatest) link = std::max(link, j + 1);
  return link;
}

/// Returns whether something may be touched that the voxels do not have, or that the skin does not look for:
/// an object that may be touched, something soft, another arm, or what another process senses.
bool PhantomSensing::may_touch_unseen(const StepInputs& inputs, const SensedShares& shares,
                                      const StepOutputs& outputs) const noexcept {
  if (outputs.muted_sensors > 0) return true;
  const auto pressed = [](double stiffness) { return stiffness != 0.0; };
  if (std::ranges::any_of(outputs.reaction.stiffness, pressed)) return true;
  if (std::ranges::any_of(shares,
                          [](const SensedShare* share) { return share != nullptr && share->mu > 0.0F; }))
    return true;
  for (std::size_t k = 0; k < std::min(inputs.others.size(), model_.other_links); ++k)
    for (std::size_t link = 1; link <= model_.arm.joint_count(); ++link)
      if (sensing_->in_fluid(k).worst_of(link).found) return true;
  return false;
}

/// Returns the link whose skin is at a point; none: no link's is within that distance, as far as some of its
/// sensors tell.
std::optional<std::size_t> PhantomSensing::link_at(const Eigen::Vector3d& point_W_m,
                                                   double within_m) const noexcept {
  const robot::SkinLayout& layout = sensing_->layout();
  std::optional<std::size_t> found;
  double least_m2 = within_m * within_m;
  for (std::size_t link = 1; link <= model_.arm.joint_count(); ++link) {
    const Eigen::Vector3d point_L_m = X_WL_[link].inverse() * point_W_m;
    const std::size_t first = layout.first[link], end = layout.first[link + 1];
    const std::size_t stride = 1 + (end - first) / kMaxTriedSensors;
    for (std::size_t i = first; i < end; i += stride) {
      const double distance_m2 = (layout.position(i) - point_L_m).squaredNorm();
      if (distance_m2 > least_m2) continue;
      least_m2 = distance_m2;
      found = link;
    }
  }
  return found;
}

/// Returns whether a body is within the tolerance of a link's skin.
bool PhantomSensing::is_near_body(const StepInputs& inputs, std::size_t link) const noexcept {
  const workspace::Workspace& voxels = *inputs.workspace.voxels;
  const double reach_m = tolerance_m(voxels);
  const robot::SkinLayout& layout = sensing_->layout();
  bool near = false;
  const auto look = [&](const Eigen::Vector3d& position_W_m) {
    near = near || percept::near_surface(voxels, position_W_m, reach_m).found;
  };
  if (const robot::WorstSensor& worst = sensing_->worst_of(link); worst.found) look(worst.position_W_m);
  sensing_->for_each_place(link, kMaxNearPlaces, [&](std::size_t sensor, std::uint8_t) {
    if (!near) look(X_WL_[link] * layout.position(sensor));
  });
  return near;
}

/// Fills what the model has at the evidence's position.
void PhantomSensing::locate(const StepInputs& inputs, DoubtEvidence& evidence) const noexcept {
  const workspace::Workspace& voxels = *inputs.workspace.voxels;
  const workspace::Index3 voxel = voxels.grid().index_of(evidence.position_W_m);
  evidence.residual_m = std::numeric_limits<double>::quiet_NaN();
  evidence.object = voxels.object(voxel);
  if (evidence.object == 0) return;
  const Eigen::Vector3d pgv_m = zone_.gradient(voxels, voxel).pgv_W_m;
  const percept::TimeToContact way = percept::time_to_contact(
      voxels, evidence.position_W_m, pgv_m, Eigen::Vector3d::Zero(), settings_.motion.least_speed_m_s);
  if (way.gap_m < 0.0) return;
  evidence.residual_m = way.gap_m;
  evidence.shift_W_m = -way.gap_m * pgv_m.normalized();
}

std::optional<DoubtEvidence> PhantomSensing::force_in_free_space(const StepInputs& inputs) const noexcept {
  const workspace::Workspace& voxels = *inputs.workspace.voxels;
  const FeltForce& force = inputs.force;
  const double reach_m = tolerance_m(voxels);
  DoubtEvidence evidence{.kind = DoubtKind::kForceInFreeSpace};
  evidence.force_N = force.force_N;
  const std::size_t first = first_touched_link(force);
  if (force.located) {
    if (percept::near_surface(voxels, force.point_W_m, reach_m).found) return std::nullopt;
    if (const auto link = link_at(force.point_W_m, reach_m)) {
      evidence.link = static_cast<std::uint32_t>(*link);
      evidence.position_W_m = force.point_W_m;
      evidence.located = true;
      locate(inputs, evidence);
      return evidence;
    }
  }
  // A point off the skin is one on the force's line of action: the contact is somewhere on these links.
  float greatest_mu = 0.0F;
  evidence.link = static_cast<std::uint32_t>(std::min(first, model_.arm.joint_count()));
  evidence.position_W_m = X_WL_[evidence.link].translation_m;
  for (std::size_t link = first; link <= model_.arm.joint_count(); ++link) {
    if (is_near_body(inputs, link)) return std::nullopt;
    const robot::WorstSensor& worst = sensing_->worst_of(link);
    if (!worst.found || worst.mu <= greatest_mu) continue;
    greatest_mu = worst.mu;
    evidence.link = static_cast<std::uint32_t>(link);
    evidence.position_W_m = worst.position_W_m;
  }
  if (force.located) evidence.position_W_m = force.point_W_m;
  locate(inputs, evidence);
  return evidence;
}

std::optional<DoubtEvidence> PhantomSensing::no_force_inside(const StepInputs& inputs) const noexcept {
  const workspace::Workspace& voxels = *inputs.workspace.voxels;
  const double side_m = voxels.grid().voxel_size_m.reference_m();
  std::optional<DoubtEvidence> deepest;
  for (std::size_t link = model_.first_feeling_link; link <= model_.arm.joint_count(); ++link) {
    const robot::WorstSensor& worst = sensing_->worst_of(link);
    if (!worst.found || worst.order < workspace::kOrderBoundary || messages::is_live(worst.object)) continue;
    const double speed_m_s =
        model_.arm.point_velocity_W(link, worst.position_W_m, X_WL_, inputs.velocity).norm();
    if (speed_m_s > settings_.doubt.rest_speed_m_s) continue;
    const double reach_m = percept::kMaxNearVoxels * side_m;
    const percept::NearVoxel out = percept::near_free(voxels, worst.position_W_m, reach_m);
    const double depth_m = out.found ? out.distance_m : reach_m;
    if (depth_m < tolerance_m(voxels) || (deepest && -deepest->residual_m >= depth_m)) continue;
    deepest = DoubtEvidence{.kind = DoubtKind::kNoForceInside,
                            .link = static_cast<std::uint32_t>(link),
                            .position_W_m = worst.position_W_m,
                            .located = true,
                            .force_N = 0.0,
                            .object = worst.object,
                            .residual_m = -depth_m,
                            .shift_W_m = -out.way_m};
  }
  return deepest;
}

/// Compares what the arm feels with the model, every kDoubtPeriod_s, and says whether the object that leads
/// the percept is displaced. The process of a share does not: it knows some links only.
void PhantomSensing::doubt(const StepInputs& inputs, const SensedShares& shares,
                           StepOutputs& outputs) noexcept {
  since_doubt_s_ += inputs.dt_s;
  if (since_doubt_s_ >= kDoubtPeriod_s && !model_.own_share) {
    const double passed_s = std::exchange(since_doubt_s_, 0.0);
    core::BoundedList<DoubtEvidence, percept::kDoubtKinds> evidence;
    std::optional<DoubtEvidence> found;
    if (inputs.force.known && !inputs.force.contact) found = no_force_inside(inputs);
    if (inputs.force.contact && !may_touch_unseen(inputs, shares, outputs))
      found = force_in_free_space(inputs);
    if (found) {
      found->workspace_version = outputs.workspace_version;
      evidence.push_back(*found);
    }
    if (inputs.force.known || inputs.force.contact) {
      doubts_.step({evidence.begin(), evidence.size()}, passed_s, outputs.doubts);
    } else {
      doubts_.close(outputs.doubts);
    }
  }
  outputs.model_in_doubt =
      !model_.own_share && (doubts_.holds() || inputs.displaced.contains(outputs.percept.object));
}

}  // namespace phantom::phantom_sensing
