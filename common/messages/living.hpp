#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/sample_id.hpp"
#include "common/workspace/grid.hpp"

// The samples of the topics by which what depth cameras see comes into the workspace.

namespace phantom::messages {

/// Greatest number of pixels of a depth_image, and of blocks and cameras of an occupancy_change.
inline constexpr std::uint64_t kMaxDepthPixels = 1'000'000;
inline constexpr std::size_t kMaxOccupancyBlocks = 20'000, kMaxDepthCameras = 16;

/// Topic depth_image: what a depth camera measures.
struct DepthImage {
  core::SampleId stamp;
  std::string camera;                           ///< its name in workspace_camera's configuration
  double age_s = 0.0;                           ///< from the exposure until the image was sent
  std::uint32_t width = 0, height = 0;          ///< pixels
  double fx_px = 0.0, fy_px = 0.0;              ///< focal lengths
  double cx_px = 0.0, cy_px = 0.0;              ///< principal point
  double min_depth_m = 0.0, max_depth_m = 0.0;  ///< that the camera can measure
  std::vector<std::uint16_t> depth_mm;          ///< row by row from the upper left; 0: nothing was measured

  friend bool operator==(const DepthImage&, const DepthImage&) = default;
};

/// 8×8×8 voxels.
struct OccupancyBlock {
  std::uint16_t x = 0, y = 0, z = 0;    ///< voxel index div 8
  std::array<std::uint64_t, 8> bits{};  ///< 1: occupied; word z, bit 8·y + x

  friend bool operator==(const OccupancyBlock&, const OccupancyBlock&) = default;
};

enum class DepthCameraState : std::uint8_t {
  kWaiting,  ///< no image has come yet
  kLive,
  kLate,  ///< its newest image is older than it may be
  kDead   ///< no image comes any more, or the same again and again
};
/// Returns "waiting", "live", "late" or "dead".
const char* name_of(DepthCameraState state) noexcept;

/// A camera that an occupancy rests on.
struct DepthCameraHealth {
  std::string name;
  DepthCameraState state = DepthCameraState::kWaiting;
  double age_s = 0.0;    ///< of its newest image, since the exposure; 0 while waiting
  double rate_hz = 0.0;  ///< images fused during the last second

  friend bool operator==(const DepthCameraHealth&, const DepthCameraHealth&) = default;
};

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
