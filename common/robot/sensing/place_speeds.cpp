#include "common/robot/sensing/place_speeds.hpp"

#include <Eigen/Geometry>

#include "common/robot/kinematics/joint_values.hpp"

namespace phantom::robot {

PlaceVelocity::PlaceVelocity(const SerialArm& arm, std::size_t link, const LinkPoses& X_WL,
                             const core::JointArray& v) noexcept
    : origin_W_m_s(arm.point_velocity_W(link, X_WL[link].translation_m, X_WL, v)),
      angular_W_rad_s(Eigen::Vector3d::Zero()) {
  for (std::size_t j = 0; j < link; ++j)
    if (!is_prismatic(arm.joints()[j])) angular_W_rad_s += v[j] * arm.axis_W(j, X_WL);
  turn(X_WL[link].rotation);
}

void PlaceVelocity::relate_to(const Eigen::Vector3d& linear_W_m_s,
                              const Eigen::Vector3d& body_angular_W_rad_s, const Eigen::Vector3d& p_W_m,
                              const geometry::Pose& X_WL) noexcept {
  origin_W_m_s -= linear_W_m_s + body_angular_W_rad_s.cross(X_WL.translation_m - p_W_m);
  angular_W_rad_s -= body_angular_W_rad_s;
  turn(X_WL.rotation);
}

void PlaceVelocity::turn(const Eigen::Matrix3d& R_WL) noexcept {
  for (Eigen::Index k = 0; k < 3; ++k) by_place_W_per_s.col(k) = angular_W_rad_s.cross(R_WL.col(k));
  turning_rad_s = angular_W_rad_s.norm();
}

}  // namespace phantom::robot
