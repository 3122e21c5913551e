#pragma once
// Private to the files that lay out a skin: turns the parts of a skin into sensors.

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "common/robot/skin/skin.hpp"

namespace phantom::robot::detail {

/// A sensor in the frame of its part.
struct PlacedSensor {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  double area_m2 = 0.0;
  double gain = 1.0;
  std::optional<ClusterSpec> cluster;
  Eigen::Vector3d closing_m = Eigen::Vector3d::Zero();
};

/// Limits that apply to every part of a skin.
struct PartRules {
  double voxel_m = 0.0;
  double pitch_m = 0.0;      ///< for point sensors: neighbours must be closer than this
  std::size_t capacity = 0;  ///< number of sensors that may still be added
  Normalisation normalisation = Normalisation::kArea;

  /// A cluster sensor reads m voxels around it, so cluster sensors may be m times the pitch apart.
  double pitch_of(const std::optional<ClusterSpec>& cluster) const {
    return pitch_m * (cluster ? std::max(1, cluster->reach_vox) : 1);
  }
};

/// Returns what is wrong with the gain or the cluster of a part, or an empty string.
std::string check_sensor(double gain, const std::optional<ClusterSpec>& cluster);
/// Returns the error "the skin has more than the allowed …" if `more` sensors do not fit.
std::optional<core::Status> check_capacity(double more, const PartRules& rules);

core::Expected<std::vector<PlacedSensor>> sensors_of(const SkinSegment& segment, const PartRules& rules);
core::Expected<std::vector<PlacedSensor>> sensors_of(const AxisSensors& axis, const PartRules& rules);
core::Expected<std::vector<PlacedSensor>> sensors_of(const MeshSensors& mesh, const PartRules& rules);

}  // namespace phantom::robot::detail
