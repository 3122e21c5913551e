#include "common/robot/arm_dynamics.hpp"

#include <Eigen/Geometry>

namespace phantom::robot {
namespace {

/// A spatial vector in W about W's origin: velocity (angular, linear of the point at the origin), or momentum
/// (angular about the origin, linear).
struct Spatial {
  Eigen::Vector3d angular = Eigen::Vector3d::Zero(), linear = Eigen::Vector3d::Zero();
};

Spatial axis_of(const SerialArm& arm, std::size_t joint, const LinkPoses& X_WL) noexcept {
  const Eigen::Vector3d axis = arm.axis_W(joint, X_WL);
  if (arm.joints()[joint].type == JointType::kPrismatic) return {Eigen::Vector3d::Zero(), axis};
  return {axis, arm.axis_point_W(joint, X_WL).cross(axis)};
}

Spatial momentum_of_link(const Link& link, const geometry::Pose& X_WL, const Spatial& velocity) noexcept {
  const Eigen::Vector3d centre_m = X_WL * link.centre_of_mass_m;
  const Eigen::Vector3d linear = link.mass_kg * (velocity.linear + velocity.angular.cross(centre_m));
  const Eigen::Vector3d spin =
      X_WL.rotation * (link.inertia_kg_m2 * (X_WL.rotation.transpose() * velocity.angular));
  return {spin + centre_m.cross(linear), linear};
}

}  // namespace

ArmMomentum momentum_of(const SerialArm& arm, const core::JointArray& rotor, const LinkPoses& X_WL,
                        const core::JointArray& v) noexcept {
  const std::size_t count = arm.joint_count();
  std::array<Spatial, core::kMaxJoints> axis, velocity;
  Spatial moving;
  for (std::size_t j = 0; j < count; ++j) {
    axis[j] = axis_of(arm, j, X_WL);
    moving.angular += v[j] * axis[j].angular;
    moving.linear += v[j] * axis[j].linear;
    velocity[j] = moving;
  }
  ArmMomentum result;
  Spatial carried;  // momentum of all links from the tip to this joint
  for (std::size_t j = count; j-- > 0;) {
    const Spatial own = momentum_of_link(arm.links()[j + 1], X_WL[j + 1], velocity[j]);
    carried.angular += own.angular;
    carried.linear += own.linear;
    const Spatial &s = axis[j], &V = velocity[j];
    result.momentum[j] = s.angular.dot(carried.angular) + s.linear.dot(carried.linear) + rotor[j] * v[j];
    const Eigen::Vector3d turned = V.angular.cross(s.angular);
    const Eigen::Vector3d shifted = V.angular.cross(s.linear) + V.linear.cross(s.angular);
    result.drift[j] = carried.angular.dot(turned) + carried.linear.dot(shifted);
  }
  return result;
}

}  // namespace phantom::robot
