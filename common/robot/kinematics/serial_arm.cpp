#include "common/robot/kinematics/serial_arm.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace phantom::robot {
namespace {

/// Inertia about a point of a mass at `lever_m` from it (Steiner).
Eigen::Matrix3d inertia_of_point(double mass_kg, const Eigen::Vector3d& lever_m) {
  return mass_kg * (lever_m.squaredNorm() * Eigen::Matrix3d::Identity() - lever_m * lever_m.transpose());
}

}  // namespace

geometry::Pose Joint::motion(double q) const noexcept {
  if (type == JointType::kPrismatic) return {Eigen::Matrix3d::Identity(), q * axis};
  return {geometry::rotation_about(axis, q), Eigen::Vector3d::Zero()};
}

bool is_inertia(const Eigen::Matrix3d& inertia_kg_m2) {
  if (!inertia_kg_m2.allFinite() || inertia_kg_m2 != inertia_kg_m2.transpose()) return false;
  const Eigen::Vector3d principal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia_kg_m2, Eigen::EigenvaluesOnly).eigenvalues();
  return principal.minCoeff() >= -1e-9 * principal.maxCoeff();
}

void Link::add_body(double body_kg, const Eigen::Vector3d& centre_m, const Eigen::Matrix3d& body_kg_m2) {
  const double total_kg = mass_kg + body_kg;
  if (!(total_kg > 0.0)) return;
  const Eigen::Vector3d before_m = centre_of_mass_m;
  centre_of_mass_m = (mass_kg * before_m + body_kg * centre_m) / total_kg;
  inertia_kg_m2 += body_kg_m2 + inertia_of_point(mass_kg, before_m - centre_of_mass_m) +
                   inertia_of_point(body_kg, centre_m - centre_of_mass_m);
  mass_kg = total_kg;
}

std::optional<std::pair<std::size_t, geometry::Pose>> SerialArm::find_frame(const std::string& name) const {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    for (const auto& [frame, X_link_frame] : links_[i].frames) {
      if (frame == name) return std::pair{i, X_link_frame};
    }
  }
  return std::nullopt;
}

std::pair<Eigen::Vector3d, Eigen::Vector3d> SerialArm::link_axis_m(std::size_t link) const {
  return {Eigen::Vector3d::Zero(),
          link < joints_.size() ? joints_[link].X_parent_joint.translation_m : tip_m_};
}

void SerialArm::link_poses(const core::JointArray& q, LinkPoses& X_WL) const noexcept {
  X_WL[0] = X_WB_;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    X_WL[i + 1] = X_WL[i] * joints_[i].X_parent_joint * joints_[i].motion(q[i]);
  }
}

// A joint's motion does not change the direction of its axis nor, for a revolute joint, the origin of its
// frame. So the frame of the moved link serves as the joint's frame.
Eigen::Vector3d SerialArm::axis_W(std::size_t joint, const LinkPoses& X_WL) const noexcept {
  return X_WL[joint + 1].rotation * joints_[joint].axis;
}

Eigen::Vector3d SerialArm::axis_point_W(std::size_t joint, const LinkPoses& X_WL) const noexcept {
  return X_WL[joint + 1].translation_m;
}

Eigen::Vector3d SerialArm::point_velocity_W(std::size_t link, const Eigen::Vector3d& p_W_m,
                                            const LinkPoses& X_WL, const core::JointArray& v) const noexcept {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  for (std::size_t j = 0; j < link; ++j) {
    const Eigen::Vector3d axis = axis_W(j, X_WL);
    velocity +=
        v[j] * (joints_[j].type == JointType::kPrismatic ? axis : axis.cross(p_W_m - axis_point_W(j, X_WL)));
  }
  return velocity;
}

void SerialArm::add_force(std::size_t link, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& f_W_N,
                          const LinkPoses& X_WL, core::JointArray& tau) const noexcept {
  for (std::size_t j = 0; j < link; ++j) {
    const Eigen::Vector3d axis = axis_W(j, X_WL);
    tau[j] += joints_[j].type == JointType::kPrismatic
                  ? axis.dot(f_W_N)
                  : axis.dot((p_W_m - axis_point_W(j, X_WL)).cross(f_W_N));
  }
}

void SerialArm::add_torque(std::size_t link, const Eigen::Vector3d& torque_W_Nm, const LinkPoses& X_WL,
                           core::JointArray& tau) const noexcept {
  for (std::size_t j = 0; j < link; ++j) {
    if (joints_[j].type != JointType::kPrismatic) tau[j] += axis_W(j, X_WL).dot(torque_W_Nm);
  }
}

core::JointArray SerialArm::gravity_torque(const LinkPoses& X_WL) const noexcept {
  core::JointArray tau{};
  for (std::size_t i = 1; i < links_.size(); ++i) {
    if (links_[i].mass_kg <= 0.0) continue;
    add_force(i, X_WL[i] * links_[i].centre_of_mass_m, {0.0, 0.0, links_[i].mass_kg * kGravity_m_s2}, X_WL,
              tau);
  }
  return tau;
}

}  // namespace phantom::robot
