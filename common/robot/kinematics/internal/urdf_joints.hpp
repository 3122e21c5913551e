#pragma once

#include <urdf_model/model.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"

// Joints of URDF files, for serial_arm_urdf.cpp alone. All throw a UrdfFault that names the joint and what is
// allowed.

namespace phantom::robot::detail {

/// Returns a number as messages have it.
std::string text_of(double number);

inline bool is_moving(const urdf::Joint& joint) { return joint.type != urdf::Joint::FIXED; }

/// Returns the chain of URDF joints from the root link to `tip`.
std::vector<urdf::JointSharedPtr> chain_to(const urdf::ModelInterface& model, const std::string& tip);

/// Returns a moving joint of the chain, with what is stated for it.
Joint joint_of(const urdf::Joint& source, const JointLimits& stated);

/// Refuses limits that are stated of no moving joint of the chain.
void check_stated_limits(const JointLimits& stated, const std::vector<urdf::JointSharedPtr>& chain);

/// Adds what is passed over, or looks like a mistake, in a moving joint of the chain.
void note_limits(const urdf::Joint& source, const Joint& joint, std::vector<std::string>& notices);

/// Where the joints off the chain stand.
class HeldJoints {
 public:
  HeldJoints(const urdf::ModelInterface& model, const std::vector<urdf::JointSharedPtr>& chain,
             const std::map<std::string, double>& stated);

  /// Returns the motion of a joint off the chain to where it is held.
  geometry::Pose motion(const urdf::Joint& joint);
  /// Returns which joints were held, in a sentence; empty if there was none.
  const std::string& notice() const { return notice_; }

 private:
  bool can_be_stated(const urdf::Joint& joint) const;
  void check_stated(const std::string& name, double q) const;
  double position(const urdf::Joint& joint) const;
  double own_position(const urdf::Joint& joint) const;

  const urdf::ModelInterface& model_;
  const std::map<std::string, double>& stated_;
  std::set<std::string> in_chain_;  // those that move
  std::string notice_;
};

}  // namespace phantom::robot::detail
