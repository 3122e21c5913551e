#pragma once

#include <cstdint>
#include <vector>

#include "common/core/status.hpp"
#include "common/fusion/depth_image.hpp"
#include "common/fusion/prepared_depth.hpp"
#include "common/workspace/grid.hpp"
#include "common/workspace/voxel_box.hpp"

namespace phantom::fusion {

/// What is published of voxels that no camera has measured.
enum class UnknownPolicy : std::uint8_t {
  kIgnore,   ///< they keep what is published of them: nothing at the start
  kFree,     ///< they are free
  kOccupied  ///< they are occupied until they are seen to be free
};

/// A part of the grid with a policy of its own. A block belongs to it if its centre does.
struct UnknownRegion {
  workspace::VoxelBox box;
  UnknownPolicy policy = UnknownPolicy::kIgnore;
};

struct FusionParameters {
  workspace::GridSpec grid;     ///< cubes
  double truncation_vox = 4.0;  ///< τ: distances are kept up to this; 1 to 16
  double shell_vox = 3.0;  ///< matter is taken to be this deep behind a surface; at most τ − hysteresis
  double hysteresis_vox = 0.75;      ///< a voxel changes where the surface passed its centre by this; 0 to 1
  int max_weight = 128;              ///< frames that an average counts; 8 to 255
  DepthSigma sigma;                  ///< of the cameras
  double surprise_sigmas = 5.0;      ///< a measurement that is farther off than this and
  double surprise_vox = 1.5;         ///< this resets a voxel
  double decision_sigma_vox = 0.25;  ///< once a mean is as certain as this, its sign alone decides, for once
  MaskParameters masks;
  int min_component_vox = 8;       ///< smaller connected components are speckle; 1 to kMaxSpeckle_vox
  std::size_t max_blocks = 11000;  ///< blocks of 8³ voxels with content; each takes 1.9 kB
  UnknownPolicy unknown = UnknownPolicy::kIgnore;
  std::vector<UnknownRegion> unknown_regions;  ///< later ones prevail
};

/// Greatest number of voxels of a grid, of blocks and of regions.
inline constexpr std::int64_t kMaxFusionVoxels = std::int64_t{1} << 29;
inline constexpr std::size_t kMaxFusionBlocks = std::size_t{1} << 20, kMaxUnknownRegions = 1000;

/// Checks every value. The error names the value and what is allowed.
core::Status check_parameters(const FusionParameters& parameters);

}  // namespace phantom::fusion
