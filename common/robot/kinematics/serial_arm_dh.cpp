// Builds a serial chain from a DH table.
#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {
namespace {

using core::Status;
using geometry::Pose;

Pose turn(const Eigen::Vector3d& axis, double angle_rad) {
  return {geometry::rotation_about(axis, angle_rad), Eigen::Vector3d::Zero()};
}

Pose shift(double x_m, double z_m) { return {Eigen::Matrix3d::Identity(), {x_m, 0.0, z_m}}; }

/// A row's fixed transforms before and after the joint's own motion, which is about or along z.
struct Parts {
  Pose before, after;
};

/// Rz and Tz commute, so either may come first. In a classic table, the frame of a revolute joint keeps the
/// origin of the previous row, where the link's axis starts.
Parts parts_of(const DhRow& row, DhConvention convention) {
  const Pose spin = turn(Eigen::Vector3d::UnitZ(), row.theta_rad), lift = shift(0.0, row.d_m);
  const Pose across = turn(Eigen::Vector3d::UnitX(), row.alpha_rad) * shift(row.a_m, 0.0);
  if (convention == DhConvention::kModified) return {across * spin * lift, {}};
  if (row.type == JointType::kPrismatic) return {spin * lift, across};
  return {spin, lift * across};
}

/// Returns what is wrong with a row, or an empty string. Every comparison is written so that a NaN fails.
std::string fault_of(const DhRow& row) {
  const auto number = [](double value) { return std::to_string(value); };
  if (row.link.empty() || row.link == "base")
    return "link: '" + row.link + "'; allowed: a name other than 'base'";
  if (!std::isfinite(row.theta_rad) || !std::isfinite(row.d_m) || !std::isfinite(row.a_m) ||
      !std::isfinite(row.alpha_rad)) {
    return "theta, d, a and alpha must be finite numbers";
  }
  if (!(row.lower < row.upper))
    return "limit lower " + number(row.lower) + " must be less than upper " + number(row.upper);
  if (!(row.max_speed > 0.0) || !std::isfinite(row.max_speed))
    return "max_speed: " + number(row.max_speed) + "; allowed: above 0";
  if (!(row.max_effort > 0.0) || !std::isfinite(row.max_effort))
    return "max_effort: " + number(row.max_effort) + "; allowed: above 0";
  if (!(row.mass_kg >= 0.0) || !std::isfinite(row.mass_kg) || !row.centre_of_mass_m.allFinite())
    return "mass must be 0 or above and its centre finite";
  if (!is_inertia(row.inertia_kg_m2)) return "inertia must be finite, with no principal moment below 0";
  return {};
}

Joint joint_of(const DhRow& row, std::size_t number) {
  Joint joint;
  joint.name = row.joint.empty() ? "joint_" + std::to_string(number) : row.joint;
  joint.type = row.type;
  joint.lower = row.lower;
  joint.upper = row.upper;
  joint.max_speed = row.max_speed;
  joint.max_effort = row.max_effort;
  return joint;
}

}  // namespace

core::Expected<SerialArm> SerialArm::from_dh(const std::vector<DhRow>& rows, DhConvention convention,
                                             const Pose& X_WB) {
  if (rows.empty() || rows.size() > core::kMaxJoints) {
    return Status::invalid_argument("DH table: has " + std::to_string(rows.size()) + " rows; allowed: 1 to " +
                                    std::to_string(core::kMaxJoints));
  }
  SerialArm arm;
  arm.X_WB_ = X_WB;
  Link base;
  base.name = "base";
  base.frames.emplace_back("base", Pose{});
  arm.links_.push_back(base);
  Pose X_link_row;  // pose of the latest row's frame in the moving link that holds it
  std::set<std::string> links, joints;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const DhRow& row = rows[i];
    const std::string place = "DH table: row " + std::to_string(i + 1) + ": ";
    if (const std::string fault = fault_of(row); !fault.empty())
      return Status::invalid_argument(place + fault);
    Joint joint = joint_of(row, i + 1);
    if (!links.insert(row.link).second)
      return Status::invalid_argument(place + "link '" + row.link + "' stands twice");
    if (!joints.insert(joint.name).second)
      return Status::invalid_argument(place + "joint '" + joint.name + "' stands twice");
    const Parts parts = parts_of(row, convention);
    joint.X_parent_joint = X_link_row * parts.before;
    X_link_row = parts.after;
    arm.joints_.push_back(joint);
    Link link;
    link.name = row.link;
    link.frames.emplace_back(row.link, X_link_row);
    const Eigen::Matrix3d& R = X_link_row.rotation;
    link.add_body(row.mass_kg, X_link_row * row.centre_of_mass_m, R * row.inertia_kg_m2 * R.transpose());
    arm.links_.push_back(std::move(link));
  }
  arm.tip_m_ = X_link_row.translation_m;
  return arm;
}

}  // namespace phantom::robot
