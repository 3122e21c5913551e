#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/geometry/pose.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/skin/skin.hpp"

namespace phantom::runtime {

/// One skin segment of a link (spec 2.2), in the link's frame. If `along_axis_m` places it along the link's
/// axis, load_skin() sets `from_m` and `to_m`.
struct SkinSegmentConfig : robot::SkinSegment {
  std::optional<std::pair<double, double>>
      along_axis_m;  ///< SOJ and SL (thesis 5.7.2): offset and length along the link's axis
};

/// Sensors in a line. With `along_link_axis` they lie along the link's own axis (LASP to LAEP).
struct AxisSensorsConfig : robot::AxisSensors {
  bool along_link_axis = false;
};

/// Sensors spread over a mesh that load_skin() reads.
struct MeshSensorsConfig {
  std::filesystem::path mesh;  ///< empty: the link's own visual meshes
  double mesh_scale = 1.0;     ///< metres per mesh unit
  geometry::Pose X_LM;         ///< mesh in the link's frame
  double gain = 1.0;
  std::optional<robot::ClusterSpec> cluster;
};

struct LinkSkinConfig {
  std::string link;  ///< URDF or DH link name
  std::vector<SkinSegmentConfig> segments;
  std::vector<AxisSensorsConfig> axes;
  std::vector<MeshSensorsConfig> meshes;
};

/// Greatest number of interest points of an arm.
inline constexpr std::size_t kMaxInterestPoints = 32;

/// An interest point: a named point of the arm that is watched (spec 2.5), such as an elbow or a motor body.
struct InterestPointConfig {
  std::string name;
  std::string link;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the link's frame
};

/// An object that this arm, or one of its links, is meant to touch. It causes neither percepts nor hit alerts
/// there.
struct AllowedContactConfig {
  std::string object;
  std::string link;  ///< empty: the whole arm
};

/// What a moving link displaces of a medium, instead of what its visuals enclose.
struct DisplacedLinkConfig {
  std::string link;                         ///< the frame of `centre_m`, and with it its moving link
  double volume_m3 = 0.0;                   ///< ≥ 0, of the whole moving link
  std::optional<Eigen::Vector3d> centre_m;  ///< none: that of the visuals
};

struct ArmConfig {
  std::string name;
  std::filesystem::path file;                 ///< describes the arm: the cell's file, or a file of its own
  std::filesystem::path urdf;                 ///< empty: the arm is described by a DH table
  std::string tip_link;                       ///< last link of the serial chain
  std::map<std::string, double> held_joints;  ///< positions of the URDF's joints off the chain, rad or m
  std::map<std::string, double>
      gripper_closed;         ///< of those, where a closed gripper's stand; empty: none moves
  robot::JointLimits limits;  ///< instead of the URDF's
  std::vector<robot::DhRow> dh;
  robot::DhConvention dh_convention = robot::DhConvention::kClassic;
  geometry::Pose X_WB;       ///< pose of the base link in the workspace frame
  std::vector<double> home;  ///< joint positions in rad or m, one per moving joint
  std::vector<LinkSkinConfig> skin;
  std::vector<DisplacedLinkConfig> displaced;
  std::vector<InterestPointConfig> interest_points;
  std::vector<AllowedContactConfig> allowed_contact;
};

}  // namespace phantom::runtime
