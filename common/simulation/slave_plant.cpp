#include "common/simulation/slave_plant.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace phantom::simulation {
namespace {

core::JointArray inertia_at(const robot::SerialArm& arm, const robot::LinkPoses& X_WL,
                            core::JointArray inertia) noexcept {
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const Eigen::Vector3d axis = arm.axis_W(j, X_WL);
    for (std::size_t link = j + 1; link < arm.links().size(); ++link) {
      const auto& body = arm.links()[link];
      const Eigen::Vector3d lever_m = X_WL[link] * body.centre_of_mass_m - arm.axis_point_W(j, X_WL);
      const bool prismatic = arm.joints()[j].type == robot::JointType::kPrismatic;
      inertia[j] += body.mass_kg * (prismatic ? 1.0 : axis.cross(lever_m).squaredNorm());
    }
  }
  return inertia;
}

}  // namespace

core::JointArray reflected_inertia(const robot::SerialArm& arm, const core::JointArray& q,
                                   const core::JointArray& rotor) noexcept {
  robot::LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  return inertia_at(arm, X_WL, rotor);
}

SlavePlant::SlavePlant(const robot::SerialArm& arm, const SlavePlantParameters& parameters,
                       std::vector<ContactPoint> points, const ContactWorld& world,
                       const core::JointArray& start_q, const Eigen::Vector3d& tip_in_last_link_m)
    : arm_(arm),
      parameters_(parameters),
      points_(std::move(points)),
      world_(world),
      encoders_(arm.joint_count(), parameters.encoder_resolution, parameters.velocity_filter_s),
      tip_m_(tip_in_last_link_m),
      q_(start_q) {
  std::stable_sort(points_.begin(), points_.end(),
                   [](const auto& a, const auto& b) { return a.link < b.link; });
  seen_.resize(points_.size());
  encoders_.sample(q_, 0.0);
  arm_.link_poses(q_, X_WL_);
  take_pose();
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

void SlavePlant::add_contact_torque(core::JointArray& torque_Nm) noexcept {
  report_.contact = false;
  report_.force_N = 0.0;
  report_.object = 0;
  for (std::size_t t = 0; t < touching_count_; ++t) {
    const ContactPoint& point = points_[touching_[t].point];
    const Eigen::Vector3d p_W_m = X_WL_[point.link] * point.position_m;
    const ContactQuery found = world_.query(p_W_m);
    if (found.distance_m >= 0.0) continue;
    const double speed_in_m_s = -found.normal_W.dot(arm_.point_velocity_W(point.link, p_W_m, X_WL_, v_));
    const double force_N = std::max(0.0, -parameters_.contact_stiffness_N_per_m * found.distance_m +
                                             parameters_.contact_damping_Ns_per_m * speed_in_m_s);
    arm_.add_force(point.link, p_W_m, force_N * found.normal_W, X_WL_, torque_Nm);
    if (!report_.contact || force_N > report_.force_N) {
      report_.force_N = force_N;
      report_.object = found.object;
      report_.point_W_m = p_W_m;
    }
    report_.contact = true;
  }
}

void SlavePlant::step(const core::JointArray& drive_Nm, double dt_s) noexcept {
  const std::size_t count = arm_.joint_count();
  // No point of the arm moves farther than this in one step at the speeds of telemanipulation (5 m/s).
  find_touching(5.0 * dt_s);
  const double sub_s = dt_s / parameters_.sub_steps;
  report_.joint_torque_Nm = {};
  for (int k = 0; k < parameters_.sub_steps; ++k) {
    core::JointArray torque_Nm{};
    add_contact_torque(torque_Nm);
    for (std::size_t j = 0; j < count; ++j) {
      report_.joint_torque_Nm[j] += torque_Nm[j] / parameters_.sub_steps;
      torque_Nm[j] += (std::isfinite(drive_Nm[j]) ? drive_Nm[j] : 0.0) - gravity_Nm_[j];
      integrate(parameters_.joints[j], torque_Nm[j], sub_s, q_[j], v_[j]);
    }
    arm_.link_poses(q_, X_WL_);
  }
  take_pose();
  encoders_.sample(q_, dt_s);
}

// Updates what depends on the pose and changes slowly: weight and inertia. A joint keeps its momentum when
// its inertia changes with the pose.
void SlavePlant::take_pose() noexcept {
  if (!parameters_.balanced) gravity_Nm_ = arm_.gravity_torque(X_WL_);
  if (!parameters_.rotor) return;
  const core::JointArray inertia = inertia_at(arm_, X_WL_, *parameters_.rotor);
  for (std::size_t j = 0; j < arm_.joint_count(); ++j) {
    v_[j] *= parameters_.joints[j].inertia / inertia[j];
    parameters_.joints[j].inertia = inertia[j];
  }
}

double SlavePlant::tool_speed_m_s() const noexcept {
  const std::size_t last = arm_.joint_count();
  return arm_.point_velocity_W(last, X_WL_[last] * tip_m_, X_WL_, v_).norm();
}

}  // namespace phantom::simulation
