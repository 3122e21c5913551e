#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/sample_id.hpp"
#include "common/workspace/grid.hpp"
#include "phantom_contract/teleoperation_samples.hpp"
#include "phantom_contract/workspace_samples.hpp"

// The samples of the topics by which what depth cameras see comes into the workspace.

namespace phantom::messages {

/// Name and id of live matter in the workspace that is no object of its own, and the ids of its objects,
/// which are called "live object 1" and so on. These ids are given to nothing else while live matter is
/// served.
inline constexpr const char* kLiveName = "live matter";
inline constexpr std::uint16_t kLiveId = 65534;
inline constexpr std::size_t kMaxLiveObjects = 15;
inline constexpr std::uint16_t kFirstLiveObjectId = kLiveId - kMaxLiveObjects;

/// Returns whether an id is one of live matter or of one of its objects.
constexpr bool is_live(std::uint16_t id) noexcept { return id >= kFirstLiveObjectId && id <= kLiveId; }
/// Returns the name that live matter or one of its objects has until a person gives it another.
std::string live_name(std::uint16_t id);
/// Returns whether it is a name that live_name() may return.
bool is_live_name(const std::string& name);

/// Greatest number of pixels of a depth_image, and of blocks and cameras of an occupancy_change.
inline constexpr std::uint64_t kMaxDepthPixels = 1'000'000;
inline constexpr std::size_t kMaxOccupancyBlocks = 20'000, kMaxDepthCameras = 16;

/// Ages of a space_view: in steps, the greatest, and that of what was never seen; and its greatest number of
/// cubes.
inline constexpr double kSpaceAgeStep_s = 0.25;
inline constexpr std::uint8_t kSpaceAgeMax = 254, kSpaceNeverSeen = 255;
inline constexpr std::size_t kMaxSpaceCubes = 32768;

/// Returns "waiting", "live", "late" or "dead".
const char* name_of(DepthCameraState state) noexcept;

/// Topic occupancy_change: which voxels depth cameras see occupied.
struct OccupancyChange {
  core::SampleId stamp;  ///< its number rises by one with each sample: a gap means that changes were missed
  std::string source;    ///< name of the process
  std::string cell;
  workspace::GridSpec grid;   ///< cubes
  bool whole = false;         ///< all blocks that are not in `blocks` are free; else: are as before
  double image_age_s = -1.0;  ///< from the exposure to the sending; −1: no new image
  std::vector<OccupancyBlock> blocks;
  std::vector<DepthCameraHealth> cameras;
};

}  // namespace phantom::messages
