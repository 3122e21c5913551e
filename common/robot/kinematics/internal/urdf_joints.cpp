#include "common/robot/kinematics/internal/urdf_joints.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include "common/core/text.hpp"
#include "common/robot/kinematics/internal/urdf_file.hpp"

namespace phantom::robot::detail {
namespace {

/// Returns the name, the type and the axis of a joint that turns or slides.
Joint moving_part(const urdf::Joint& source) {
  const Eigen::Vector3d axis(source.axis.x, source.axis.y, source.axis.z);
  if (!(axis.stableNorm() > 1e-9) || !axis.allFinite())
    throw UrdfFault{"joint '" + source.name + "': axis must be a finite vector that is not zero"};
  Joint joint;
  joint.name = source.name;
  joint.axis = axis.stableNormalized();
  joint.type = source.type == urdf::Joint::PRISMATIC ? JointType::kPrismatic : JointType::kRevolute;
  return joint;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Returns the least and the greatest position.
std::pair<double, double> range_of(const urdf::Joint& source) {
  if (source.type == urdf::Joint::CONTINUOUS || !source.limits) return {-kInfinity, kInfinity};
  return {source.limits->lower, source.limits->upper};
}

bool turns_or_slides(const urdf::Joint& source) {
  return source.type == urdf::Joint::REVOLUTE || source.type == urdf::Joint::CONTINUOUS ||
         source.type == urdf::Joint::PRISMATIC;
}

/// Sets `value` to what is stated for the joint, if it is.
void state(const std::map<std::string, double>& stated, const std::string& joint, double& value) {
  if (const auto found = stated.find(joint); found != stated.end()) value = found->second;
}

}  // namespace

std::string text_of(double number) { return core::formatted("%g", number); }

std::vector<urdf::JointSharedPtr> chain_to(const urdf::ModelInterface& model, const std::string& tip) {
  urdf::LinkConstSharedPtr link = model.getLink(tip);
  if (!link)
    throw UrdfFault{"tip link '" + tip + "' is not in the file; its links are: " +
                    core::listed(model.links_, [](const auto& named) { return named.first; })};
  std::vector<urdf::JointSharedPtr> chain;
  for (; link->parent_joint; link = link->getParent()) chain.push_back(link->parent_joint);
  std::reverse(chain.begin(), chain.end());
  return chain;
}

Joint joint_of(const urdf::Joint& source, const JointLimits& stated) {
  const std::string place = "joint '" + source.name + "'";
  if (!turns_or_slides(source))
    throw UrdfFault{place + " has an unsupported type; allowed are revolute, continuous, prismatic, fixed"};
  if (source.mimic) {
    throw UrdfFault{place +
                    " mimics another; every moving joint of the chain must move by itself (a finger is " +
                    "off the chain if tip_link is the link that carries it)"};
  }
  const bool whole = stated.max_speed.contains(source.name) && stated.max_effort.contains(source.name);
  if (!source.limits && !whole) {
    throw UrdfFault{
        place + " has no <limit>; lower, upper, velocity and effort are needed (continuous: the last " +
        "two), there or as lower_limits, upper_limits, max_speeds and max_efforts of the arm's file"};
  }
  Joint joint = moving_part(source);
  std::tie(joint.lower, joint.upper) = range_of(source);
  if (source.limits) {
    joint.max_speed = source.limits->velocity;
    joint.max_effort = source.limits->effort;
  }
  state(stated.lower, source.name, joint.lower);
  state(stated.upper, source.name, joint.upper);
  state(stated.max_speed, source.name, joint.max_speed);
  state(stated.max_effort, source.name, joint.max_effort);
  // Written so that a NaN fails as well.
  if (!(joint.lower < joint.upper)) {
    throw UrdfFault{place +
                    ": limit lower must be less than upper; lower_limits and upper_limits of the arm's " +
                    "file may state them"};
  }
  if (!(joint.max_speed > 0.0) || !std::isfinite(joint.max_speed))
    throw UrdfFault{place + ": limit velocity must be above 0; max_speeds of the arm's file may state it"};
  if (!(joint.max_effort > 0.0) || !std::isfinite(joint.max_effort))
    throw UrdfFault{place + ": limit effort must be above 0; max_efforts of the arm's file may state it"};
  return joint;
}

void check_stated_limits(const JointLimits& stated, const std::vector<urdf::JointSharedPtr>& chain) {
  std::string allowed;
  std::set<std::string> names;
  for (const auto& joint : chain) {
    if (!is_moving(*joint)) continue;
    names.insert(joint->name);
    core::add_to_list(allowed, joint->name);
  }
  const std::pair<const char*, const std::map<std::string, double>&> kAll[] = {
      {"lower_limits", stated.lower},
      {"upper_limits", stated.upper},
      {"max_speeds", stated.max_speed},
      {"max_efforts", stated.max_effort}};
  for (const auto& [key, values] : kAll) {
    for (const auto& [name, value] : values) {
      if (!names.contains(name))
        throw UrdfFault{std::string(key) + ": '" + name +
                        "' is no moving joint of the chain; allowed: " + allowed};
    }
  }
}

void note_limits(const urdf::Joint& source, const Joint& joint, std::vector<std::string>& notices) {
  const std::string place = "joint '" + source.name + "': ";
  const auto range = [](double lower, double upper) { return text_of(lower) + " to " + text_of(upper); };
  if (source.safety) {
    const auto& soft = *source.safety;
    const bool stated = soft.soft_lower_limit < soft.soft_upper_limit;
    if (stated && (soft.soft_lower_limit > joint.lower || soft.soft_upper_limit < joint.upper)) {
      notices.push_back(place + "the soft limits of its <safety_controller>, " +
                        range(soft.soft_lower_limit, soft.soft_upper_limit) +
                        ", are not applied; its range is " + range(joint.lower, joint.upper) +
                        " (lower_limits and upper_limits of the arm's file may state them)");
    }
  }
  constexpr double kFourTurns_rad = 8 * std::numbers::pi;
  if (source.type == urdf::Joint::REVOLUTE && std::max(-joint.lower, joint.upper) > kFourTurns_rad) {
    notices.push_back(place + "its range, " + range(joint.lower, joint.upper) +
                      " rad, is more than four turns to a side: a URDF is in radians, not in degrees");
  }
}

HeldJoints::HeldJoints(const urdf::ModelInterface& model, const std::vector<urdf::JointSharedPtr>& chain,
                       const std::map<std::string, double>& stated)
    : model_(model), stated_(stated) {
  for (const auto& joint : chain) {
    if (is_moving(*joint)) in_chain_.insert(joint->name);
  }
  for (const auto& [name, q] : stated) check_stated(name, q);
}

geometry::Pose HeldJoints::motion(const urdf::Joint& joint) {
  if (!is_moving(joint)) return {};
  const double q = position(joint);
  if (!std::isfinite(q)) throw UrdfFault{"joint '" + joint.name + "' is not held at a finite position"};
  const bool placed = turns_or_slides(joint);
  notice_ += (notice_.empty() ? "joints off the chain are held: " : ", ") + joint.name +
             (placed ? " at " + text_of(q) + (joint.type == urdf::Joint::PRISMATIC ? " m" : " rad")
                     : " at its origin");
  if (joint.mimic) {
    constexpr double kRounding = 1e-6;
    const auto [lower, upper] = range_of(joint);
    const bool beyond = q < lower - kRounding || q > upper + kRounding;
    notice_ += " (as " + joint.mimic->joint_name + (beyond ? ", beyond its own limits)" : ")");
  }
  return placed ? moving_part(joint).motion(q) : geometry::Pose();
}

bool HeldJoints::can_be_stated(const urdf::Joint& joint) const {
  return turns_or_slides(joint) && !joint.mimic && !in_chain_.contains(joint.name);
}

void HeldJoints::check_stated(const std::string& name, double q) const {
  const urdf::JointConstSharedPtr joint = model_.getJoint(name);
  if (!joint || !can_be_stated(*joint)) {
    std::string allowed;
    for (const auto& [other, candidate] : model_.joints_)
      if (can_be_stated(*candidate)) core::add_to_list(allowed, other);
    throw UrdfFault{"held_joints: '" + name + "' " +
                    (!joint                     ? "is no joint of the file"
                     : in_chain_.contains(name) ? "is a joint of the chain, which moves"
                     : turns_or_slides(*joint)  ? "mimics " + joint->mimic->joint_name
                                                : "neither turns nor slides") +
                    "; allowed: " + (allowed.empty() ? "none, no joint is held" : allowed)};
  }
  const auto [lower, upper] = range_of(*joint);
  if (!(q >= lower && q <= upper)) {
    throw UrdfFault{"held_joints: " + text_of(q) + " for '" + name +
                    "' is outside of its limits; allowed: " + text_of(lower) + " to " + text_of(upper)};
  }
}

/// Returns where a joint off the chain stands: where its mimics lead to, or where it is stated to be.
double HeldJoints::position(const urdf::Joint& joint) const {
  double factor = 1.0, offset = 0.0;
  const urdf::Joint* at = &joint;
  for (std::size_t followed = 0; turns_or_slides(*at) && at->mimic; ++followed) {
    const std::string place = "joint '" + at->name + "' mimics ";
    const std::string& name = at->mimic->joint_name;
    if (followed > model_.joints_.size()) throw UrdfFault{place + "itself by way of '" + name + "'"};
    const urdf::JointConstSharedPtr leader = model_.getJoint(name);
    if (!leader) throw UrdfFault{place + "'" + name + "', which is not in the file"};
    if (in_chain_.contains(name)) {
      throw UrdfFault{place + "'" + name + "', which moves; a joint off the chain may only mimic another " +
                      "one off the chain, or none"};
    }
    offset += factor * at->mimic->offset;
    factor *= at->mimic->multiplier;
    at = leader.get();
  }
  return factor * own_position(*at) + offset;
}

double HeldJoints::own_position(const urdf::Joint& joint) const {
  if (!turns_or_slides(joint)) return 0.0;
  const auto found = stated_.find(joint.name);
  if (found != stated_.end()) return found->second;
  const auto [lower, upper] = range_of(joint);
  if (!(lower <= upper)) throw UrdfFault{"joint '" + joint.name + "': limit lower must be at most upper"};
  return std::clamp(0.0, lower, upper);
}

}  // namespace phantom::robot::detail
