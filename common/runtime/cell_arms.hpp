#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/pose.hpp"

namespace phantom::runtime {

/// One skin segment of a link (spec 2.2): rings at both ends of its axis, in the link's frame.
struct SkinSegmentConfig {
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_m = Eigen::Vector3d::Zero();
  double from_radius_m = 0.0;
  double to_radius_m = 0.0;
  std::optional<int>
      sides;  ///< sensors around a ring; absent: chosen so that their pitch is below the voxel size
  std::optional<int> rings;  ///< rings along the axis (K ≥ 2); absent: likewise
  double spin_rad = 0.0;     ///< rotation of the first vertex about the axis
  double gain = 1.0;         ///< SG
};

struct LinkSkinConfig {
  std::string link;  ///< URDF link name
  std::vector<SkinSegmentConfig> segments;
};

/// A point of the arm that is watched by name (spec 2.5, interest points): an elbow, a motor body.
struct InterestPointConfig {
  std::string name;
  std::string link;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the link's frame
};

struct ArmConfig {
  std::string name;
  std::filesystem::path urdf;
  std::string tip_link;      ///< last link of the serial chain
  geometry::Pose X_WB;       ///< base link in the workspace frame
  std::vector<double> home;  ///< joint positions in rad or m, one per moving joint
  std::vector<LinkSkinConfig> skin;
  std::vector<InterestPointConfig> interest_points;
};

}  // namespace phantom::runtime
