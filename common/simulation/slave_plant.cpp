#include "common/simulation/slave_plant.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/robot/kinematics/arm_dynamics.hpp"

namespace phantom::simulation {
namespace {

// What the fingers have let go for a moment, as it slips, still counts as held.
constexpr double kHeldAfter_s = 0.05;
constexpr double kHolding_N = 0.2;  // of either finger
const JointYield kNothingYields{};

robot::Payload on_last_link(const robot::SerialArm& arm, const robot::LoadBody& body) {
  robot::Payload payload;
  payload.on_link[arm.joint_count()] = body;
  return payload;
}

}  // namespace

SlavePlant::SlavePlant(const robot::SerialArm& arm, const SlavePlantParameters& parameters,
                       std::vector<ContactPoint> points, const ContactWorld& world,
                       const core::JointArray& start_q, const Eigen::Vector3d& tip_in_last_link_m,
                       const Handling& handling, std::unique_ptr<Yielding> yielding,
                       const robot::Buoyancy* buoyancy)
    : arm_(arm),
      parameters_(parameters),
      points_(std::move(points)),
      world_(world),
      encoders_(arm.joint_count(), parameters.encoder_resolution, parameters.velocity_filter_s),
      tip_m_(tip_in_last_link_m),
      q_(start_q),
      loose_(handling.loose, world, points_.size()),
      pad_friction_(handling.pad_friction),
      held_s_(handling.loose.size(), 0.0),
      pressed_N_(handling.loose.size()),
      load_(on_last_link(arm, parameters.payload)),
      dynamics_(arm, parameters.joints, parameters.rotor, start_q, load_, loose_.bodies(),
                0.001 / parameters.sub_steps),
      yielding_(std::move(yielding)),
      buoyancy_(buoyancy) {
  if (handling.gripper) {
    gripper_.emplace(*handling.gripper, handling.gripper->widest_m);
    demand_m_ = handling.gripper->widest_m;
  }
  std::stable_sort(points_.begin(), points_.end(),
                   [](const auto& a, const auto& b) { return a.link < b.link; });
  seen_.resize(points_.size());
  arm_points_.resize(points_.size());
  for (const ContactPoint& point : points_) {
    if (point.closing_m.isZero() || !closing_m_.isZero()) continue;
    closing_m_ = point.closing_m;
    hand_ = point.link;
  }
  encoders_.sample(q_, 0.0);
  arm_.link_poses(q_, X_WL_);
  take_weight();
  find_touching(0.0);
}

Eigen::Vector3d SlavePlant::place_W_m(const ContactPoint& point) const noexcept {
  return X_WL_[point.link] * (point.position_m + closed_share_ * point.closing_m);
}

double SlavePlant::look_up(std::size_t point, const Eigen::Vector3d& p_W_m) noexcept {
  seen_[point] = {p_W_m, world_.distance_m(p_W_m)};
  return seen_[point].distance_m;
}

void SlavePlant::keep_if_touching(std::size_t point, double distance_m, double reach_m) noexcept {
  if (distance_m > reach_m) return;
  if (touching_count_ == kMaxTouching && distance_m >= touching_[kMaxTouching - 1].distance_m) return;
  std::size_t place = std::min(touching_count_, kMaxTouching - 1);
  for (; place > 0 && touching_[place - 1].distance_m > distance_m; --place)
    touching_[place] = touching_[place - 1];
  touching_[place] = {point, distance_m};
  touching_count_ = std::min(touching_count_ + 1, kMaxTouching);
}

// Finds the least distance and the points that touch or may touch within this step. A point is skipped if the
// distance moved since its last look-up rules out both, so few look-ups remain.
void SlavePlant::find_touching(double reach_m) noexcept {
  constexpr double kSteepest = 1.05;  // the slope of a sampled field slightly exceeds 1 in places
  touching_count_ = 0;
  double least_m = 1e9;
  if (!points_.empty()) {
    const ContactPoint& nearest = points_[nearest_];
    least_m = look_up(nearest_, place_W_m(nearest));
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Eigen::Vector3d p_W_m = place_W_m(points_[i]);
    arm_points_[i] = {p_W_m, points_[i].link};
    const LastSeen& seen = seen_[i];
    const double spare_m = seen.distance_m - std::max(least_m * (1.0 - kClearanceTolerance), reach_m);
    const double way_m = spare_m / kSteepest;
    if (spare_m > 0.0 && (p_W_m - seen.p_W_m).squaredNorm() < way_m * way_m) continue;
    const double distance_m = look_up(i, p_W_m);
    if (distance_m < least_m) {
      least_m = distance_m;
      nearest_ = i;
    }
    const bool may_be_soft = distance_m <= reach_m && yielding_ && yielding_->has_soft_bodies();
    keep_if_touching(i, may_be_soft ? world_.query_rigid(p_W_m).distance_m : distance_m, reach_m);
  }
  report_.clearance_m = least_m < world_.range_m() ? std::max(0.0, least_m) : -1.0;
}

void SlavePlant::add_contact(const Contact& contact, const Meeting& meeting) noexcept {
  if (contact_count_ == contacts_.size()) return;
  met_[contact_count_] = meeting;
  Contact& made = contacts_[contact_count_++];
  made = contact;
  made.stiffness_N_per_m = parameters_.contact_stiffness_N_per_m;
  made.damping_Ns_per_m = parameters_.contact_damping_Ns_per_m;
  made.friction = parameters_.contact_friction;
  if (meeting.arm_point < 0) return;
  const ContactPoint& point = points_[static_cast<std::size_t>(meeting.arm_point)];
  if (!gripper_ || point.closing_m.isZero()) return;
  if (meeting.loose_b >= 0) made.friction = pad_friction_;
  made.surface_W_m_s = X_WL_[point.link].rotation * point.closing_m *
                       (-gripper_->velocity_m_s() / gripper_->parameters().widest_m);
}

void SlavePlant::find_contacts() noexcept {
  contact_count_ = 0;
  for (std::size_t t = 0; t < touching_count_; ++t) {
    const std::size_t index = touching_[t].point;
    const Eigen::Vector3d p_W_m = place_W_m(points_[index]);
    const ContactQuery found = world_.query_rigid(p_W_m);
    if (found.distance_m >= 0.0 || found.normal_W.isZero()) continue;
    add_contact({.a = points_[index].link,
                 .b = 0,
                 .point_W_m = p_W_m,
                 .normal_W = found.normal_W,
                 .depth_m = -found.distance_m},
                {.arm_point = static_cast<std::int32_t>(index), .object = found.object});
  }
  find_loose_contacts();
}

void SlavePlant::find_loose_contacts() noexcept {
  using Pair = LooseObjects::Pair;
  for (std::size_t i = 0; i < loose_.size(); ++i) loose_.move(i, pose_of_loose(i));
  const auto body = [this](std::int32_t loose) {
    return dynamics_.first_loose() + static_cast<std::size_t>(loose);
  };
  for (const Pair& pair : loose_.pairs()) {
    const bool of_arm = pair.owner == Pair::kArm;
    LooseObjects::Touch touch;
    if (!loose_.touches(pair, of_arm ? place_W_m(points_[pair.point]) : Eigen::Vector3d::Zero(), touch))
      continue;
    add_contact({.a = of_arm ? points_[pair.point].link : body(pair.owner),
                 .b = pair.surface == Pair::kFixed ? 0 : body(pair.surface),
                 .point_W_m = touch.point_W_m,
                 .normal_W = touch.normal_W,
                 .depth_m = touch.depth_m},
                {.arm_point = of_arm ? static_cast<std::int32_t>(pair.point) : -1,
                 .loose_a = of_arm ? -1 : pair.owner,
                 .loose_b = pair.surface,
                 .object = touch.object});
  }
}

// The fingers move by the forces of the sub-step, which act on the width by the principle of virtual work.
void SlavePlant::move_fingers(double sub_step_s) noexcept {
  if (!gripper_) return;
  const double widest_m = gripper_->parameters().widest_m;
  double contact_N = 0.0;
  for (auto& pressed : pressed_N_) pressed = {};
  for (std::size_t i = 0; i < contact_count_; ++i) {
    if (met_[i].arm_point < 0) continue;
    const ContactPoint& point = points_[static_cast<std::size_t>(met_[i].arm_point)];
    const double closes_m = point.closing_m.norm();
    if (closes_m == 0.0) continue;
    const double opens_Nm = -contacts_[i].force_W_N.dot(X_WL_[point.link].rotation * point.closing_m);
    contact_N += opens_Nm / widest_m;
    if (met_[i].loose_b < 0) continue;
    const std::size_t side = point.closing_m.dot(closing_m_) > 0.0 ? 0 : 1;
    pressed_N_[static_cast<std::size_t>(met_[i].loose_b)][side] += opens_Nm / closes_m;
  }
  for (std::size_t i = 0; i < held_s_.size(); ++i) {
    const bool pressed = pressed_N_[i][0] > kHolding_N && pressed_N_[i][1] > kHolding_N;
    held_s_[i] = pressed ? kHeldAfter_s : std::max(0.0, held_s_[i] - sub_step_s);
  }
  gripper_->step(demand_m_, greatest_force_N_, sub_step_s, contact_N);
  closed_share_ = 1.0 - gripper_->width_m() / widest_m;
}

// Returns whether the contact is one of the arm, or of what it holds, with something else: its force's sign
// on the arm, and what the other is.
bool SlavePlant::as_on_arm(const Meeting& meeting, double& sign, std::uint16_t& object) const noexcept {
  const auto held = [this](std::int32_t loose) {
    return loose >= 0 && holds(static_cast<std::size_t>(loose));
  };
  const bool a_on_arm = meeting.arm_point >= 0 || held(meeting.loose_a);
  if (a_on_arm == held(meeting.loose_b)) return false;
  sign = a_on_arm ? 1.0 : -1.0;
  object = a_on_arm ? meeting.object : loose_.id(static_cast<std::size_t>(meeting.loose_a));
  return true;
}

// Of the contacts whose forces have acted in the sub-step from the pose at which they were found.
void SlavePlant::report_contacts() noexcept {
  report_.contact = false;
  report_.force_N = 0.0;
  report_.object = 0;
  core::JointArray torque_Nm{};
  for (std::size_t i = 0; i < contact_count_; ++i) {
    const Contact& contact = contacts_[i];
    double sign = 1.0;
    std::uint16_t object = 0;
    if (!as_on_arm(met_[i], sign, object)) continue;
    const std::size_t link = met_[i].arm_point >= 0 ? contact.a : hand_;
    arm_.add_force(link, contact.point_W_m, sign * contact.force_W_N, X_WL_, torque_Nm);
    const double force_N = contact.force_W_N.norm();
    if (report_.contact && force_N <= report_.force_N) continue;
    report_.contact = true;
    report_.force_N = force_N;
    report_.object = object;
    report_.point_W_m = contact.point_W_m;
  }
  if (report_.contact) report_.clearance_m = 0.0;
  for (std::size_t j = 0; j < arm_.joint_count(); ++j)
    report_.joint_torque_Nm[j] += torque_Nm[j] / parameters_.sub_steps;
}

// At the motion that the sub-step has ended with.
void SlavePlant::report_yielding() noexcept {
  if (!yielding_) return;
  const core::JointArray torque_Nm = yielding_->joints().torque(q_, v_);
  for (std::size_t j = 0; j < arm_.joint_count(); ++j)
    report_.joint_torque_Nm[j] += torque_Nm[j] / parameters_.sub_steps;
  const SoftTouch& touch = yielding_->touch();
  if (touch.force_N <= report_.force_N) return;
  report_.contact = true;
  report_.force_N = touch.force_N;
  report_.object = touch.object;
  report_.point_W_m = touch.point_W_m;
  report_.clearance_m = 0.0;
}

void SlavePlant::carry(const robot::Payload& payload) noexcept {
  load_ = payload;
  const robot::LoadBody& own = parameters_.payload;
  if (own.mass_kg > 0.0) robot::add_body(load_, arm_.joint_count(), own.mass_kg, own.centre(), own.inertia());
  dynamics_.carry(arm_, load_);
}

void SlavePlant::step(const core::JointArray& drive_Nm, double dt_s) noexcept {
  const std::size_t count = arm_.joint_count();
  // No point of the arm moves farther than this in one step at the speeds of telemanipulation (5 m/s).
  const double reach_m = 5.0 * dt_s;
  find_touching(reach_m);
  for (std::size_t i = 0; i < loose_.size(); ++i) loose_.take_speed(i, dynamics_.speed(i), dt_s);
  // Loose objects are met at 2 m/s: a faster one a step later, when it is as deep.
  loose_.choose(arm_points_, 2.0 * dt_s);
  for (std::size_t i = 0; i < loose_.size(); ++i) dynamics_.rest(i, loose_.rests(i));
  report_.joint_torque_Nm = {};
  core::JointArray torque_Nm{};
  for (std::size_t j = 0; j < count; ++j)
    torque_Nm[j] = (std::isfinite(drive_Nm[j]) ? drive_Nm[j] : 0.0) - gravity_Nm_[j];
  core::JointArray load_Nm{};
  robot::add_weight(arm_, load_, X_WL_, load_Nm);
  if (buoyancy_ != nullptr) buoyancy_->add_lift(arm_, load_, X_WL_, load_Nm);
  for (std::size_t j = 0; j < count; ++j) torque_Nm[j] -= load_Nm[j];
  if (yielding_) yielding_->sense(arm_, X_WL_, q_, v_, closed_share_);
  dynamics_.set_sub_step(dt_s / parameters_.sub_steps);
  for (int k = 0; k < parameters_.sub_steps; ++k) {
    find_contacts();
    dynamics_.advance(torque_Nm, {contacts_.data(), contact_count_},
                      yielding_ ? yielding_->joints() : kNothingYields);
    move_fingers(dt_s / parameters_.sub_steps);
    report_contacts();
    for (std::size_t j = 0; j < count; ++j) q_[j] = dynamics_.q(j), v_[j] = dynamics_.v(j);
    report_yielding();
    arm_.link_poses(q_, X_WL_);
  }
  take_weight();
  encoders_.sample(q_, dt_s);
}

void SlavePlant::take_weight() noexcept {
  gravity_Nm_ = parameters_.balanced ? core::JointArray{} : arm_.gravity_torque(X_WL_);
  if (buoyancy_ != nullptr) buoyancy_->add_lift(arm_, X_WL_, gravity_Nm_);
}

double SlavePlant::tool_speed_m_s() const noexcept {
  const std::size_t last = arm_.joint_count();
  return arm_.point_velocity_W(last, X_WL_[last] * tip_m_, X_WL_, v_).norm();
}

}  // namespace phantom::simulation
