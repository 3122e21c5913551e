#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "common/layers/merge.hpp"
#include "common/runtime/cell_arms.hpp"
#include "common/runtime/cell_objects.hpp"

namespace phantom::runtime {

/// deploy/cells/<name>/cell.yaml, checked. Frames: W is the workspace frame, z up, metres.
struct CellConfig {
  std::string name;
  std::filesystem::path file;
  Eigen::Vector3d min_m;  ///< the workspace box in W
  Eigen::Vector3d max_m;
  double voxel_size_m = 0.005;
  layers::MergeLaw merge = layers::MergeLaw::kHighestViscosity;  ///< whose voxel it is where objects meet
  workspace::LayerProfile profile;                               ///< of objects that have none of their own
  std::vector<ObjectConfig> objects;  ///< object id on topics and in voxels = index + 1
  std::vector<ArmConfig> arms;

  /// The arm called `name`, or the only one if `name` is empty. Throws ConfigError naming the arms there are.
  const ArmConfig& arm(const std::string& arm_name = "") const;
};

/// Whether a cell must have an arm: not for whom only the space around its objects counts.
enum class CellArms { kNeeded, kOptional };

/// Reads and checks a cell file. Throws ConfigError (file, line, key, value, what is allowed). Not real-time
/// safe.
CellConfig load_cell(const std::filesystem::path& path, CellArms arms = CellArms::kNeeded);

}  // namespace phantom::runtime
