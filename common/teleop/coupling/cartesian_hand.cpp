#include "common/teleop/coupling/cartesian_hand.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {
namespace {

// Of a joint's speed, what the hand may use; the rest works off what integration loses.
constexpr double kHandsShare = 0.9;
constexpr double kWorkOff_per_s = 5.0;
constexpr double kMaxLost_m = 0.005, kMaxLost_rad = 0.02;
// A joint's use falls towards a limit over the way that it runs in kZone_s, at most a tenth of its range. The
// last of its use is kept, so that it can leave the limit.
constexpr double kZone_s = 0.1, kZoneShare = 0.1, kMinUse = 0.02;

using JointVector = Eigen::Matrix<double, static_cast<int>(core::kMaxJoints), 1>;

CartesianMapParameters seen_at_tool(const CartesianHandParameters& p) {
  CartesianMapParameters map = p.map;
  map.mass_kg /= p.scale * p.scale;
  map.inertia_kg_m2 /= p.rotation_scale * p.rotation_scale;
  return map;
}

Eigen::Vector3d within(const Eigen::Vector3d& v, double most) noexcept {
  const double size = v.norm();
  return size > most ? Eigen::Vector3d(most / size * v) : v;
}

Spatial turned(const Eigen::Matrix3d& R, double linear, double angular, const Spatial& v) noexcept {
  Spatial result;
  result.head<3>() = linear * (R * v.head<3>());
  result.tail<3>() = angular * (R * v.tail<3>());
  return result;
}

// Whether a hand can move so; false for numbers that are none.
bool is_possible(const HandState& hand) noexcept {
  constexpr double kFastest = 1000.0;  // m/s or rad/s
  return hand.twist.lpNorm<Eigen::Infinity>() <= kFastest && hand.twist.allFinite() &&
         hand.pose.rotation.allFinite() && hand.pose.translation_m.allFinite();
}

}  // namespace

CartesianHand::CartesianHand(const robot::SerialArm& arm, const CartesianHandParameters& parameters,
                             const core::JointArray& start_q)
    : arm_(arm),
      parameters_(parameters),
      q_(start_q),
      clutch_(parameters.clutch_fade_s, parameters.clutch_fade_s) {
  parameters_.map = seen_at_tool(parameters);
  look_at_pose();
  reference_ = X_WT_;
  R_WD_ = device_in_world(nullptr);
}

void CartesianHand::look_at_pose() noexcept {
  robot::LinkPoses X_WL;
  arm_.link_poses(q_, X_WL);
  X_WT_ = robot::tool_pose(arm_, X_WL);
  jacobian_ = robot::tool_jacobian(arm_, X_WL);
  core::JointArray weight{};
  for (std::size_t j = 0; j < arm_.joint_count(); ++j) weight[j] = use(j);
  task_map_ = cartesian_map(parameters_.map, jacobian_, weight);
}

// The view is taken while the clutch is out: one that turns later would turn motion and wrench in the hand.
Eigen::Matrix3d CartesianHand::device_in_world(const Eigen::Matrix3d* R_WV) noexcept {
  if (clutch_.value() == 0.0) R_WV_ = R_WV != nullptr ? *R_WV : arm_.base_pose().rotation;
  switch (parameters_.frame) {
    case HandFrame::kView:
      return R_WV_ * parameters_.R_FD;
    case HandFrame::kTool:
      return X_WT_.rotation * parameters_.R_FD;
    default:
      return arm_.base_pose().rotation * parameters_.R_FD;
  }
}

// Returns how far a joint may still go in the direction of `velocity`.
double CartesianHand::room(std::size_t joint, double velocity) const noexcept {
  const robot::Joint& limits = arm_.joints()[joint];
  return std::max(0.0, velocity > 0.0 ? limits.upper - q_[joint] : q_[joint] - limits.lower);
}

// The square root makes a joint that runs towards its limit under a constant command brake at a constant
// rate.
double CartesianHand::use(std::size_t joint) const noexcept {
  const robot::Joint& limits = arm_.joints()[joint];
  const double zone =
      std::min(kZone_s * parameters_.max_speed[joint], kZoneShare * (limits.upper - limits.lower));
  return std::clamp(std::sqrt(std::min(room(joint, 1.0), room(joint, -1.0)) / zone), kMinUse, 1.0);
}

// Returns the share, 0…1, of the velocities at which no joint is faster than share `of` of its greatest
// speed.
double CartesianHand::share_of_speeds(const core::JointArray& v, double of) const noexcept {
  double share = 1.0;
  for (std::size_t j = 0; j < arm_.joint_count(); ++j) {
    const double allowed = of * parameters_.max_speed[j];
    if (std::abs(v[j]) > allowed) share = std::min(share, allowed / std::abs(v[j]));
  }
  return share;
}

void CartesianHand::sense(const HandState& hand, const Eigen::Matrix3d* R_WV) noexcept {
  hand_ = hand;
  if (!hand_.valid || !is_possible(hand_)) hand_ = {.pose = last_pose_};
  R_WD_ = device_in_world(R_WV);
  task_twist_ = turned(R_WD_, parameters_.scale, parameters_.rotation_scale, hand_.twist);
  if (!parameters_.map.orientation) task_twist_.tail<3>().setZero();
  const JointVector wanted = clutch_.value() * (task_map_.joints_per_twist * task_twist_);
  std::copy_n(wanted.data(), v_.size(), v_.begin());
  speed_share_ = share_of_speeds(v_, kHandsShare);
  const double share = clutch_.value() * speed_share_;
  map_.leftCols<3>() = share * parameters_.scale * (task_map_.joints_per_twist.leftCols<3>() * R_WD_);
  map_.rightCols<3>() =
      share * parameters_.rotation_scale * (task_map_.joints_per_twist.rightCols<3>() * R_WD_);
  for (std::size_t j = 0; j < arm_.joint_count(); ++j) {
    v_[j] *= speed_share_;
    const double allowed = room(j, v_[j]) * kHandsShare / period_s_;
    if (std::abs(v_[j]) > allowed) {  // its use is small there, so the tool is hardly turned aside
      map_.row(static_cast<Eigen::Index>(j)) *= allowed / std::abs(v_[j]);
      v_[j] = std::copysign(allowed, v_[j]);
    }
    v_[j] += meeting_[j];
  }
}

Spatial CartesianHand::wrench(const core::JointArray& torque_Nm) const noexcept {
  return map_.transpose() * Eigen::Map<const JointVector>(torque_Nm.data());
}

// Moves where the tool should be: by the hand's own displacement, less what the joints do not follow of its
// twist.
void CartesianHand::move_reference(double dt_s) noexcept {
  Spatial displacement = Spatial::Zero();
  if (had_pose_ && hand_.valid) {
    displacement.head<3>() = hand_.pose.translation_m - last_pose_.translation_m;
    displacement.tail<3>() = geometry::rotation_vector(hand_.pose.rotation * last_pose_.rotation.transpose());
  }
  if (hand_.valid) last_pose_ = hand_.pose;
  had_pose_ = hand_.valid;
  if (clutch_.value() == 0.0) {
    reference_ = X_WT_;
    return;
  }
  const Spatial followed =
      jacobian_ * (map_ * hand_.twist);  // what of the hand's twist the joints do in this tick
  const Spatial moved = turned(R_WD_, parameters_.scale, parameters_.rotation_scale, displacement) -
                        dt_s * (task_twist_ - followed);
  reference_.translation_m += moved.head<3>();
  reference_.rotation = geometry::rotation_from_vector(moved.tail<3>()) * reference_.rotation;
}

// Velocities that bring the tool back to its reference, and the reference within reach of the tool.
core::JointArray CartesianHand::correction() const noexcept {
  Spatial lost;
  lost.head<3>() = reference_.translation_m - X_WT_.translation_m;
  lost.tail<3>() = geometry::rotation_vector(reference_.rotation * X_WT_.rotation.transpose());
  if (!parameters_.map.orientation) lost.tail<3>().setZero();
  const JointVector wanted = clutch_.value() * kWorkOff_per_s * (task_map_.joints_per_twist * lost);
  core::JointArray v{};
  std::copy_n(wanted.data(), v.size(), v.begin());
  const double share = share_of_speeds(v, 1.0 - kHandsShare);
  for (double& one : v) one *= share;
  return v;
}

void CartesianHand::move_joints(const core::JointArray& correction, double dt_s) noexcept {
  for (std::size_t j = 0; j < arm_.joint_count(); ++j) {
    const robot::Joint& limits = arm_.joints()[j];
    q_[j] = std::clamp(q_[j] + dt_s * (v_[j] + correction[j]), std::min(limits.lower, q_[j]),
                       std::max(limits.upper, q_[j]));
  }
  look_at_pose();
}

void CartesianHand::advance(bool lead, double dt_s) noexcept {
  meeting_ = {};
  period_s_ = dt_s;
  const core::JointArray work_off = clutch_.value() > 0.0 ? correction() : core::JointArray{};
  move_reference(dt_s);
  move_joints(work_off, dt_s);
  const Eigen::Vector3d lost_m = reference_.translation_m - X_WT_.translation_m;
  reference_.translation_m = X_WT_.translation_m + within(lost_m, kMaxLost_m);
  const Eigen::Vector3d lost_rad =
      geometry::rotation_vector(reference_.rotation * X_WT_.rotation.transpose());
  reference_.rotation =
      parameters_.map.orientation
          ? Eigen::Matrix3d(geometry::rotation_from_vector(within(lost_rad, kMaxLost_rad)) * X_WT_.rotation)
          : X_WT_.rotation;
  clutch_.step(lead && hand_.valid && hand_.clutch, dt_s);
}

void CartesianHand::meet(const core::JointArray& target, double dt_s) noexcept {
  if (clutch_.value() > 0.0) return advance(false, dt_s);
  for (std::size_t j = 0; j < arm_.joint_count(); ++j) {
    const double most = parameters_.max_speed[j];
    meeting_[j] = std::isfinite(target[j]) ? std::clamp((target[j] - q_[j]) / dt_s, -most, most) : 0.0;
  }
  v_ = meeting_;
  had_pose_ = false;
  move_joints({}, dt_s);
  reference_ = X_WT_;
}

}  // namespace phantom::teleop
