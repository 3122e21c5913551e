#include "common/geometry/pose.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace phantom::geometry {

bool same_pose(const Pose& a, const Pose& b) {
  constexpr double kSame = 1e-9;
  return (a.translation_m - b.translation_m).norm() < kSame && (a.rotation - b.rotation).norm() < kSame;
}

Eigen::Matrix3d rotation_about(const Eigen::Vector3d& axis, double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
}

Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& v) {
  const double angle = v.norm();
  return angle > 0.0 ? rotation_about(v / angle, angle) : Eigen::Matrix3d::Identity();
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  // The direction perpendicular to `a` in the plane of both. It is made orthogonal twice, to stay exact where
  // they are nearly opposite.
  Eigen::Vector3d across = b - a.dot(b) * a;
  across -= a.dot(across) * a;
  const double sine = across.norm();
  const Eigen::Vector3d u = sine > 0 ? Eigen::Vector3d(across / sine) : a.unitOrthogonal();
  return rotation_about(a.cross(u).normalized(), std::atan2(b.dot(u), b.dot(a)));
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
