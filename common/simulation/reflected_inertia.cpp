#include "common/simulation/reflected_inertia.hpp"

#include <Eigen/Geometry>

namespace phantom::simulation {

core::JointArray reflected_inertia(const robot::SerialArm& arm, const core::JointArray& q,
                                   const core::JointArray& rotor) noexcept {
  robot::LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  core::JointArray inertia = rotor;
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

}  // namespace phantom::simulation
