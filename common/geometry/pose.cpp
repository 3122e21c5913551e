#include "common/geometry/pose.hpp"

#include <Eigen/Geometry>

namespace phantom::geometry {

Eigen::Matrix3d rotation_about(const Eigen::Vector3d& axis, double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
}

Eigen::Matrix3d rotation_from_rpy(double roll_rad, double pitch_rad, double yaw_rad) {
  return rotation_about(Eigen::Vector3d::UnitZ(), yaw_rad) *
         rotation_about(Eigen::Vector3d::UnitY(), pitch_rad) *
         rotation_about(Eigen::Vector3d::UnitX(), roll_rad);
}

Eigen::Vector4d quaternion_xyzw(const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q(rotation);
  return (q.w() < 0 ? -1.0 : 1.0) * q.normalized().coeffs();
}

Eigen::Matrix3d rotation_from_quaternion(const Eigen::Vector4d& xyzw) {
  return Eigen::Quaterniond(xyzw).normalized().toRotationMatrix();
}

}  // namespace phantom::geometry
