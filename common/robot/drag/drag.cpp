#include "common/robot/drag/drag.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/robot/kinematics/jacobian.hpp"

namespace phantom::robot {
namespace {

/// Returns h(x) of DirectionalLaw: the share of the drag that remains at σ = x.
double share(const DirectionalLaw& law, double x) noexcept {
  const double away = std::clamp(-x / law.full_at, 0.0, 1.0);
  return 1.0 - (1.0 - law.leaving_share) * away * away * (3.0 - 2.0 * away);
}

// As a twist: motion per unit of one joint's velocity, about an origin; a point at d from it moves with
// velocity linear + angular×d. As a wrench: force over moment about the origin.
Spatial spatial(const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) noexcept {
  Spatial both;
  both << linear, angular;
  return both;
}

/// Returns a joint's twist about its frame's origin.
Spatial unit_twist(const SerialArm& arm, std::size_t joint, const LinkPoses& X_WL) noexcept {
  const Eigen::Vector3d axis = arm.axis_W(joint, X_WL), zero = Eigen::Vector3d::Zero();
  return arm.joints()[joint].type == JointType::kPrismatic ? spatial(axis, zero) : spatial(zero, axis);
}

/// Returns the drag of a body with given sums that moves with a twist, without the negative sign.
Spatial drag_wrench(const ViscousSums& body, const Spatial& twist) noexcept {
  const Eigen::Vector3d linear = twist.head<3>(), angular = twist.tail<3>();
  // Σ wμ d×(ω×d) = (tr(S)·1 − S)ω
  const Eigen::Vector3d spin = body.mu_dd.trace() * angular - body.mu_dd * angular;
  return spatial(body.mu * linear + angular.cross(body.mu_d), body.mu_d.cross(linear) + spin);
}

/// E and s of DirectionalLaw for one link.
struct LinkMotion {
  double drag_power, rise;

  double sigma(double gradient_square) const noexcept {
    const double bound_square = gradient_square * drag_power;
    return bound_square > 0.0 ? std::clamp(rise / std::sqrt(bound_square), -1.0, 1.0) : 0.0;
  }
};

/// Adds the drag that link k loses, for each joint and direction, to `lost_plus` and `lost_minus`. Returns
/// the link's σ.
double add_lost_drag(std::size_t k, const SerialArm& arm, const LinkPoses& X_WL, const ViscousSums& body,
                     const DirectionalLaw& law, const core::JointArray& v, core::JointArray& lost_plus,
                     core::JointArray& lost_minus) noexcept {
  // Motion of this link about its origin, per unit of each joint's velocity.
  std::array<Spatial, core::kMaxJoints> by_joint;
  Spatial whole = Spatial::Zero();
  for (std::size_t j = 0; j < k; ++j) {
    Spatial& twist = by_joint[j] = unit_twist(arm, j, X_WL);
    const Eigen::Vector3d angular = twist.tail<3>();
    twist.head<3>() += angular.cross(X_WL[k].translation_m - X_WL[j + 1].translation_m);
    whole += v[j] * twist;
  }
  const Spatial slope = spatial(body.gradient, body.gradient_moment), wrench = drag_wrench(body, whole);
  const LinkMotion motion{whole.dot(wrench), whole.dot(slope)};
  for (std::size_t j = 0; j < k; ++j) {
    const double own = by_joint[j].dot(drag_wrench(body, by_joint[j])), with = by_joint[j].dot(wrench),
                 rise = by_joint[j].dot(slope), speed = std::hypot(v[j], law.still);
    const auto lost_at = [&](double v_j) {  // joint j at velocity v_j, the other joints as they are
      const double step = v_j - v[j];
      const LinkMotion other{std::max(0.0, motion.drag_power + step * (2.0 * with + step * own)),
                             motion.rise + step * rise};
      return (1.0 - share(law, other.sigma(body.gradient_square))) * std::max(0.0, own);
    };
    lost_plus[j] += lost_at(speed);
    lost_minus[j] += lost_at(-speed);
  }
  return motion.sigma(body.gradient_square);
}

/// Returns the part of v − c in which the drag does no positive work: between 0 and 2v.
double relative(double v, double c) noexcept {
  if (std::abs(c) <= std::abs(v)) return v - c;
  return v * c > 0.0 ? 0.0 : 2.0 * v;
}

void apply(const DirectionalLaw& law, const SerialArm& arm, const LinkPoses& X_WL, const LinkSums& sums,
           const core::JointArray& v, DragCoefficients& result) noexcept {
  core::JointArray lost_plus{}, lost_minus{};
  for (std::size_t k = 1; k <= arm.joint_count(); ++k) {
    if (sums[k].gradient_square > 0.0)
      result.sigma[k - 1] = add_lost_drag(k, arm, X_WL, sums[k], law, v, lost_plus, lost_minus);
  }
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const double own = result.plus[j], least = law.leaving_share * own;  // a floor against rounding
    result.plus[j] = std::max(least, own - lost_plus[j]);
    result.minus[j] = std::max(least, own - lost_minus[j]);
  }
}

}  // namespace

void ViscousSums::shift_by(const Eigen::Vector3d& offset_m) noexcept {
  const Eigen::Matrix3d cross = mu_d * offset_m.transpose();
  mu_dd += cross + cross.transpose() + mu * offset_m * offset_m.transpose();
  mu_d += mu * offset_m;
  gradient_moment += offset_m.cross(gradient);
}

void ViscousSums::add(const ViscousSums& other) noexcept {
  mu += other.mu;
  mu_d += other.mu_d;
  mu_dd += other.mu_dd;
  gradient += other.gradient;
  gradient_moment += other.gradient_moment;
  gradient_square += other.gradient_square;
}

void ViscousSums::scale(double factor) noexcept {
  mu *= factor;
  mu_d *= factor;
  mu_dd *= factor;
  gradient *= factor;
  gradient_moment *= factor;
  gradient_square *= factor;
}

ViscousSums ViscousSums::turned(const Eigen::Matrix3d& rotation) const noexcept {
  return {mu,
          rotation * mu_d,
          rotation * mu_dd * rotation.transpose(),
          rotation * gradient,
          rotation * gradient_moment,
          gradient_square};
}

void relieve_by_flow(const SerialArm& arm, const LinkPoses& X_WL, std::span<const MovingSums> fluids,
                     double still, const core::JointArray& v, DragCoefficients& result) noexcept {
  Spatial outboard = Spatial::Zero();  // what the flow does to all that a joint moves, about its origin
  for (std::size_t j = arm.joint_count(); j-- > 0;) {
    const Eigen::Vector3d& origin = X_WL[j + 1].translation_m;
    if (j + 1 < arm.joint_count()) {
      const Eigen::Vector3d force = outboard.head<3>();
      outboard.tail<3>() += (X_WL[j + 2].translation_m - origin).cross(force);
    }
    for (const MovingSums& fluid : fluids) {
      const ViscousSums& body = (*fluid.sums)[j + 1];
      if (!(body.mu > 0.0)) continue;
      outboard +=
          drag_wrench(body, spatial(fluid.linear_m_s + fluid.angular_rad_s.cross(origin - fluid.origin_m),
                                    fluid.angular_rad_s));
    }
    const double flow = unit_twist(arm, j, X_WL).dot(outboard),
                 own = result.coupled[j * (j + 1) / 2 + j] * std::max(std::abs(v[j]), still);
    if (!(own > 0.0) || flow == 0.0) continue;
    result.plus[j] *= std::clamp(1.0 - flow / own, 0.0, 1.0);
    result.minus[j] *= std::clamp(1.0 + flow / own, 0.0, 1.0);
  }
}

void drag_coefficients(const SerialArm& arm, const LinkPoses& X_WL, const LinkSums& sums,
                       const DirectionalLaw& law, const core::JointArray& v,
                       DragCoefficients& result) noexcept {
  result = {};
  ViscousSums outboard;  // sums of everything that the current joint moves, about that joint's frame origin
  for (std::size_t j = arm.joint_count(); j-- > 0;) {
    const Eigen::Vector3d& origin = X_WL[j + 1].translation_m;
    if (j + 1 < arm.joint_count()) outboard.shift_by(X_WL[j + 2].translation_m - origin);
    outboard.add(sums[j + 1]);

    const Spatial twist = unit_twist(arm, j, X_WL), wrench = drag_wrench(outboard, twist);
    // Rounding must not make a vanishing coefficient negative.
    const double own = std::max(0.0, twist.dot(wrench));
    result.coupled[j * (j + 1) / 2 + j] = own;
    const Eigen::Vector3d force = wrench.head<3>(), moment = wrench.tail<3>();
    for (std::size_t i = j; i-- > 0;) {
      const Spatial there = spatial(force, moment + (origin - X_WL[i + 1].translation_m).cross(force));
      result.coupled[j * (j + 1) / 2 + i] = unit_twist(arm, i, X_WL).dot(there);
    }

    result.plus[j] = result.minus[j] = own;
  }
  if (law.enabled) apply(law, arm, X_WL, sums, v, result);
}

core::JointArray drag_torque(const DragCoefficients& drag, DragMode mode, const core::JointArray& v,
                             std::size_t joint_count) noexcept {
  core::JointArray torque{};
  const auto coefficient = [&](std::size_t i) { return v[i] >= 0.0 ? drag.plus[i] : drag.minus[i]; };
  if (mode == DragMode::kSeparable) {
    for (std::size_t i = 0; i < joint_count; ++i)  // subtracting from 0 avoids negative zeros
      torque[i] = 0.0 - coefficient(i) * relative(v[i], drag.drift[i]);
    return torque;
  }
  core::JointArray scale{};
  for (std::size_t i = 0; i < joint_count; ++i) {
    scale[i] = drag.matrix(i, i) > 0.0 ? std::sqrt(coefficient(i) / drag.matrix(i, i)) : 1.0;
  }
  core::JointArray current{};  // S·D·S·c
  double own_square = 0.0, current_square = 0.0;
  for (std::size_t i = 0; i < joint_count; ++i) {
    for (std::size_t j = 0; j < joint_count; ++j) {
      torque[i] -= scale[i] * drag.matrix(i, j) * scale[j] * v[j];
      current[i] += scale[i] * drag.matrix(i, j) * scale[j] * drag.drift[j];
    }
    own_square -= torque[i] * v[i];
    current_square += current[i] * drag.drift[i];
  }
  if (!(current_square > 0.0 && own_square > 0.0)) return torque;
  // Slightly less than the least that would cancel, so that rounding leaves no push.
  const double met = std::min(1.0, (1.0 - 1e-9) * std::sqrt(own_square / current_square));
  for (std::size_t i = 0; i < joint_count; ++i) torque[i] += met * current[i];
  return torque;
}

}  // namespace phantom::robot
