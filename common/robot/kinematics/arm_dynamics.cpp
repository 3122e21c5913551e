#include "common/robot/kinematics/arm_dynamics.hpp"

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

Spatial momentum_of_body(double mass_kg, const Eigen::Vector3d& centre_L_m,
                         const Eigen::Matrix3d& inertia_kg_m2, const geometry::Pose& X_WL,
                         const Spatial& velocity) noexcept {
  const Eigen::Vector3d centre_m = X_WL * centre_L_m;
  const Eigen::Vector3d linear = mass_kg * (velocity.linear + velocity.angular.cross(centre_m));
  const Eigen::Vector3d spin =
      X_WL.rotation * (inertia_kg_m2 * (X_WL.rotation.transpose() * velocity.angular));
  return {spin + centre_m.cross(linear), linear};
}

}  // namespace

ArmMomentum momentum_of(const SerialArm& arm, const core::JointArray& rotor, const LinkPoses& X_WL,
                        const core::JointArray& v, const Payload& payload) noexcept {
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
    const auto add = [&](double mass_kg, const Eigen::Vector3d& centre_m,
                         const Eigen::Matrix3d& inertia_kg_m2) {
      const Spatial own = momentum_of_body(mass_kg, centre_m, inertia_kg_m2, X_WL[j + 1], velocity[j]);
      carried.angular += own.angular;
      carried.linear += own.linear;
    };
    const Link& link = arm.links()[j + 1];
    add(link.mass_kg, link.centre_of_mass_m, link.inertia_kg_m2);
    const LoadBody& load = payload.on_link[j + 1];
    if (load.mass_kg > 0.0) add(load.mass_kg, load.centre(), load.inertia());
    const Spatial &s = axis[j], &V = velocity[j];
    result.momentum[j] = s.angular.dot(carried.angular) + s.linear.dot(carried.linear) + rotor[j] * v[j];
    const Eigen::Vector3d turned = V.angular.cross(s.angular);
    const Eigen::Vector3d shifted = V.angular.cross(s.linear) + V.linear.cross(s.angular);
    result.drift[j] = carried.angular.dot(turned) + carried.linear.dot(shifted);
  }
  return result;
}

void add_body(Payload& payload, std::size_t link, double mass_kg, const Eigen::Vector3d& centre_m,
              const Eigen::Matrix3d& inertia_kg_m2) {
  LoadBody& load = payload.on_link.at(link);
  Link whole;
  whole.mass_kg = load.mass_kg;
  whole.centre_of_mass_m = load.centre();
  whole.inertia_kg_m2 = load.inertia();
  whole.add_body(mass_kg, centre_m, inertia_kg_m2);
  load.mass_kg = whole.mass_kg;
  Eigen::Vector3d::Map(load.centre_m.data()) = whole.centre_of_mass_m;
  Eigen::Matrix3d::Map(load.inertia_kg_m2.data()) = whole.inertia_kg_m2;
}

void add_displaced(Payload& payload, std::size_t link, double volume_m3, const Eigen::Vector3d& centre_m) {
  if (!(volume_m3 > 0.0)) return;
  LoadBody& load = payload.on_link.at(link);
  auto at = Eigen::Vector3d::Map(load.displaced_at_m.data());
  at = (load.displaced_m3 * at + volume_m3 * centre_m).eval() / (load.displaced_m3 + volume_m3);
  load.displaced_m3 += volume_m3;
}

void add_weight(const SerialArm& arm, const Payload& payload, const LinkPoses& X_WL,
                core::JointArray& tau) noexcept {
  for (std::size_t link = 1; link <= arm.joint_count(); ++link) {
    const LoadBody& load = payload.on_link[link];
    if (load.mass_kg > 0.0)
      arm.add_force(link, X_WL[link] * load.centre(), {0.0, 0.0, load.mass_kg * kGravity_m_s2}, X_WL, tau);
  }
}

}  // namespace phantom::robot
