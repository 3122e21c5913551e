#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "common/layers/merge.hpp"
#include "common/robot/drag/medium.hpp"
#include "common/runtime/cell/cell_arms.hpp"
#include "common/runtime/cell/cell_objects.hpp"

namespace phantom::runtime {

/// A fluid that fills a box of space.
struct MediumConfig : robot::MediumRegion {
  std::string name;
};

/// Checked contents of deploy/cells/<name>/cell.yaml. Frames: W is the workspace frame, z up, metres.
struct CellConfig {
  std::string name;
  std::filesystem::path file;
  Eigen::Vector3d min_m;  ///< corners of the workspace box in W
  Eigen::Vector3d max_m;
  workspace::VoxelSize voxel_size_m;  ///< lengths in voxels of profiles are its reference lengths
  layers::MergeLaw merge =
      layers::MergeLaw::kHighestViscosity;  ///< decides which object's voxel counts where objects overlap
  workspace::LayerProfile profile;          ///< of objects without a profile of their own
  std::vector<ObjectConfig> objects;        ///< the object id on topics and in voxels is the index + 1
  std::vector<MediumConfig> media;          ///< where two overlap the later one counts
  std::vector<ArmConfig> arms;

  /// Returns the arm called `arm_name`, or the only arm if `arm_name` is empty. Throws ConfigError with the
  /// names of the cell's arms.
  const ArmConfig& arm(const std::string& arm_name = "") const;
};

/// Tables of the keys of cell files (cell.yaml) and arm files (arm.yaml).
extern const char* const kCellKeys;
extern const char* const kArmKeys;

/// Whether a cell must have an arm. Components that use only the space around the objects need none.
enum class CellArms { kNeeded, kOptional };

/// Reads and checks a cell file. Throws ConfigError (file, line, key, value, what is allowed). Not real-time
/// safe.
CellConfig load_cell(const std::filesystem::path& path, CellArms arms = CellArms::kNeeded);

}  // namespace phantom::runtime
