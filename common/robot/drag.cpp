#include "common/robot/drag.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace phantom::robot {
namespace {

/// Returns h(x) of DirectionalLaw: the share of the drag that remains at σ = x.
double share(const DirectionalLaw& law, double x) noexcept {
  const double away = std::clamp(-x / law.full_at, 0.0, 1.0);
  return 1.0 - (1.0 - law.leaving_share) * away * away * (3.0 - 2.0 * away);
}

/// Motion of a link per unit of one joint's velocity, about that joint's frame origin. A point at d moves
/// with velocity linear + angular×d.
struct Twist {
  Eigen::Vector3d linear, angular;
};

Twist unit_twist(const SerialArm& arm, std::size_t joint, const LinkPoses& X_WL) noexcept {
  const Eigen::Vector3d axis = arm.axis_W(joint, X_WL);
  if (arm.joints()[joint].type == JointType::kPrismatic) return {axis, Eigen::Vector3d::Zero()};
  return {Eigen::Vector3d::Zero(), axis};
}

/// Drag of a body with given sums that moves with a twist, as force and moment about the origin, without the
/// negative sign.
struct Wrench {
  Eigen::Vector3d force, moment;
};

Wrench drag_wrench(const ViscousSums& body, const Twist& twist) noexcept {
  // Σ wμ d×(ω×d) = (tr(S)·1 − S)ω
  const Eigen::Vector3d spin = body.mu_dd.trace() * twist.angular - body.mu_dd * twist.angular;
  return {body.mu * twist.linear + twist.angular.cross(body.mu_d), body.mu_d.cross(twist.linear) + spin};
}

double power(const Twist& twist, const Wrench& wrench) noexcept {
  return twist.linear.dot(wrench.force) + twist.angular.dot(wrench.moment);
}

Twist operator*(double factor, const Twist& twist) noexcept {
  return {factor * twist.linear, factor * twist.angular};
}

void add(Twist& sum, const Twist& twist) noexcept {
  sum.linear += twist.linear;
  sum.angular += twist.angular;
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
double let_go(std::size_t k, const SerialArm& arm, const LinkPoses& X_WL, const ViscousSums& body,
              const DirectionalLaw& law, const core::JointArray& v, core::JointArray& lost_plus,
              core::JointArray& lost_minus) noexcept {
  // Motion of this link about its origin, per unit of each joint's velocity.
  std::array<Twist, core::kMaxJoints> by_joint;
  Twist whole{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (std::size_t j = 0; j < k; ++j) {
    Twist& twist = by_joint[j] = unit_twist(arm, j, X_WL);
    twist.linear += twist.angular.cross(X_WL[k].translation_m - X_WL[j + 1].translation_m);
    add(whole, v[j] * twist);
  }
  const auto rise_of = [&body](const Twist& t) {
    return t.linear.dot(body.gradient) + t.angular.dot(body.gradient_moment);
  };
  const Wrench wrench = drag_wrench(body, whole);
  const LinkMotion motion{power(whole, wrench), rise_of(whole)};
  for (std::size_t j = 0; j < k; ++j) {
    const double own = power(by_joint[j], drag_wrench(body, by_joint[j])), with = power(by_joint[j], wrench),
                 rise = rise_of(by_joint[j]), speed = std::hypot(v[j], law.still);
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

void apply(const DirectionalLaw& law, const SerialArm& arm, const LinkPoses& X_WL, const LinkSums& sums,
           const core::JointArray& v, DragCoefficients& result) noexcept {
  core::JointArray lost_plus{}, lost_minus{};
  for (std::size_t k = 1; k <= arm.joint_count(); ++k) {
    if (sums[k].gradient_square > 0.0)
      result.sigma[k - 1] = let_go(k, arm, X_WL, sums[k], law, v, lost_plus, lost_minus);
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

void drag_coefficients(const SerialArm& arm, const LinkPoses& X_WL, const LinkSums& sums,
                       const DirectionalLaw& law, const core::JointArray& v,
                       DragCoefficients& result) noexcept {
  result = {};
  ViscousSums outboard;  // sums of everything that the current joint moves, about that joint's frame origin
  for (std::size_t j = arm.joint_count(); j-- > 0;) {
    const Eigen::Vector3d& origin = X_WL[j + 1].translation_m;
    if (j + 1 < arm.joint_count()) outboard.shift_by(X_WL[j + 2].translation_m - origin);
    outboard.add(sums[j + 1]);

    const Twist twist = unit_twist(arm, j, X_WL);
    Wrench wrench = drag_wrench(outboard, twist);
    // Rounding must not make a vanishing coefficient negative.
    const double own = std::max(0.0, power(twist, wrench));
    result.coupled[j * (j + 1) / 2 + j] = own;
    const Wrench at_own_origin = wrench;
    for (std::size_t i = j; i-- > 0;) {
      wrench = at_own_origin;
      wrench.moment += (origin - X_WL[i + 1].translation_m).cross(wrench.force);
      result.coupled[j * (j + 1) / 2 + i] = power(unit_twist(arm, i, X_WL), wrench);
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
    for (std::size_t i = 0; i < joint_count; ++i)
      torque[i] = 0.0 - coefficient(i) * v[i];  // subtracting from 0 avoids negative zeros
    return torque;
  }
  core::JointArray scale{};
  for (std::size_t i = 0; i < joint_count; ++i) {
    scale[i] = drag.matrix(i, i) > 0.0 ? std::sqrt(coefficient(i) / drag.matrix(i, i)) : 1.0;
  }
  for (std::size_t i = 0; i < joint_count; ++i) {
    for (std::size_t j = 0; j < joint_count; ++j) torque[i] -= scale[i] * drag.matrix(i, j) * scale[j] * v[j];
  }
  return torque;
}

}  // namespace phantom::robot
