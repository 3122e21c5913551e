#pragma once

#include <Eigen/Core>

namespace phantom::geometry {

/// Rigid transform X_AB: p_A = rotation · p_B + translation_m. Variables name the frames: `X_WS`, `X_W_link`.
struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point_m) const {
    return rotation * point_m + translation_m;
  }
  Pose operator*(const Pose& other) const { return {rotation * other.rotation, *this * other.translation_m}; }
  Pose inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation_m)}; }
};

/// Returns whether two poses are the same but for rounding: to 1 nm and 1 nrad. Real-time safe: yes.
bool same_pose(const Pose& a, const Pose& b);

/// Returns the rotation about the fixed axes x (roll), then y (pitch), then z (yaw), as in URDF: R =
/// Rz(yaw)·Ry(pitch)·Rx(roll).
Eigen::Matrix3d rotation_from_rpy(double roll_rad, double pitch_rad, double yaw_rad);

/// Returns the rotation by `angle_rad` about the unit vector `axis` (Rodrigues). Real-time safe: yes.
Eigen::Matrix3d rotation_about(const Eigen::Vector3d& axis, double angle_rad);

/// Returns the rotation by |v| about v, and v of a rotation (its axis times its angle, 0…π). Real-time safe:
/// yes.
Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& v);
Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation);

/// Returns the smallest rotation that turns the direction of `from` into that of `to`. Opposite directions
/// give half a turn about some axis perpendicular to them. Neither vector may be zero. Real-time safe: yes.
Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Returns the unit quaternion (x, y, z, w) of a rotation matrix, w ≥ 0. Real-time safe: yes.
Eigen::Vector4d quaternion_xyzw(const Eigen::Matrix3d& rotation);

/// Returns the rotation matrix of a quaternion (x, y, z, w), which is normalised first. Real-time safe: yes.
Eigen::Matrix3d rotation_from_quaternion(const Eigen::Vector4d& xyzw);

}  // namespace phantom::geometry
