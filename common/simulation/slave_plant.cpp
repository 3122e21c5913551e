#include "common/simulation/slave_plant.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace phantom::simulation {

SlavePlant::SlavePlant(const robot::SerialArm& arm, const SlavePlantParameters& parameters,
                       std::vector<ContactPoint> points, const ContactWorld& world,
                       const core::JointArray& start_q, const Eigen::Vector3d& tip_in_last_link_m)
    : arm_(arm),
      parameters_(parameters),
      points_(std::move(points)),
      world_(world),
      encoders_(arm.joint_count(), parameters.encoder_resolution, parameters.velocity_filter_s),
      tip_m_(tip_in_last_link_m),
      q_(start_q),
      dynamics_(arm, parameters.joints, parameters.rotor, start_q, parameters.payload, {},
                0.001 / parameters.sub_steps) {
  std::stable_sort(points_.begin(), points_.end(),
                   [](const auto& a, const auto& b) { return a.link < b.link; });
  seen_.resize(points_.size());
  encoders_.sample(q_, 0.0);
  arm_.link_poses(q_, X_WL_);
  take_weight();
  find_touching(0.0);
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
    least_m = look_up(nearest_, X_WL_[nearest.link] * nearest.position_m);
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Eigen::Vector3d p_W_m = X_WL_[points_[i].link] * points_[i].position_m;
    const LastSeen& seen = seen_[i];
    const double spare_m = seen.distance_m - std::max(least_m * (1.0 - kClearanceTolerance), reach_m);
    const double way_m = spare_m / kSteepest;
    if (spare_m > 0.0 && (p_W_m - seen.p_W_m).squaredNorm() < way_m * way_m) continue;
    const double distance_m = look_up(i, p_W_m);
    if (distance_m < least_m) {
      least_m = distance_m;
      nearest_ = i;
    }
    keep_if_touching(i, distance_m, reach_m);
  }
  report_.clearance_m = least_m < world_.range_m() ? std::max(0.0, least_m) : -1.0;
}

void SlavePlant::find_contacts() noexcept {
  contact_count_ = 0;
  for (std::size_t t = 0; t < touching_count_; ++t) {
    const ContactPoint& point = points_[touching_[t].point];
    const Eigen::Vector3d p_W_m = X_WL_[point.link] * point.position_m;
    const ContactQuery found = world_.query(p_W_m);
    if (found.distance_m >= 0.0 || found.normal_W.isZero()) continue;
    objects_[contact_count_] = found.object;
    contacts_[contact_count_++] = {.a = point.link,
                                   .b = 0,
                                   .point_W_m = p_W_m,
                                   .normal_W = found.normal_W,
                                   .depth_m = -found.distance_m,
                                   .stiffness_N_per_m = parameters_.contact_stiffness_N_per_m,
                                   .damping_Ns_per_m = parameters_.contact_damping_Ns_per_m,
                                   .friction = parameters_.contact_friction};
  }
}

// Of the contacts whose forces have acted in the sub-step from the pose at which they were found.
void SlavePlant::report_contacts() noexcept {
  report_.contact = contact_count_ > 0;
  report_.force_N = 0.0;
  report_.object = 0;
  core::JointArray torque_Nm{};
  for (std::size_t i = 0; i < contact_count_; ++i) {
    const Contact& contact = contacts_[i];
    arm_.add_force(contact.a, contact.point_W_m, contact.force_W_N, X_WL_, torque_Nm);
    const double force_N = contact.force_W_N.norm();
    if (i > 0 && force_N <= report_.force_N) continue;
    report_.force_N = force_N;
    report_.object = objects_[i];
    report_.point_W_m = contact.point_W_m;
  }
  for (std::size_t j = 0; j < arm_.joint_count(); ++j)
    report_.joint_torque_Nm[j] += torque_Nm[j] / parameters_.sub_steps;
}

void SlavePlant::step(const core::JointArray& drive_Nm, double dt_s) noexcept {
  const std::size_t count = arm_.joint_count();
  // No point of the arm moves farther than this in one step at the speeds of telemanipulation (5 m/s).
  find_touching(5.0 * dt_s);
  report_.joint_torque_Nm = {};
  core::JointArray torque_Nm{};
  for (std::size_t j = 0; j < count; ++j)
    torque_Nm[j] = (std::isfinite(drive_Nm[j]) ? drive_Nm[j] : 0.0) - gravity_Nm_[j];
  const std::size_t last = count;
  arm_.add_force(last, X_WL_[last] * parameters_.payload.centre(),
                 {0.0, 0.0, -parameters_.payload.mass_kg * robot::kGravity_m_s2}, X_WL_, torque_Nm);
  dynamics_.set_sub_step(dt_s / parameters_.sub_steps);
  for (int k = 0; k < parameters_.sub_steps; ++k) {
    find_contacts();
    dynamics_.advance(torque_Nm, {contacts_.data(), contact_count_});
    report_contacts();
    for (std::size_t j = 0; j < count; ++j) q_[j] = dynamics_.q(j), v_[j] = dynamics_.v(j);
    arm_.link_poses(q_, X_WL_);
  }
  take_weight();
  encoders_.sample(q_, dt_s);
}

void SlavePlant::take_weight() noexcept {
  if (!parameters_.balanced) gravity_Nm_ = arm_.gravity_torque(X_WL_);
}

double SlavePlant::tool_speed_m_s() const noexcept {
  const std::size_t last = arm_.joint_count();
  return arm_.point_velocity_W(last, X_WL_[last] * tip_m_, X_WL_, v_).norm();
}

}  // namespace phantom::simulation
