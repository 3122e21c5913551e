#pragma once

// Private to this library: a frame against the voxels of a block, in vectors.

#include <array>
#include <cstdint>
#include <span>

#include "common/fusion/depth_image.hpp"
#include "common/fusion/fused_block.hpp"
#include "common/workspace/aligned.hpp"

namespace phantom::fusion::detail {

/// Lengths in voxels by which blocks are updated.
struct FuseRules {
  float truncation = 4.0F;   ///< τ
  float hysteresis = 0.75F;  ///< a surface must pass a voxel's centre by this
  float shell = 3.0F;        ///< how deep behind the surface voxels count as occupied
  float sigma = 0.0F;        ///< σ = sigma · depth²
  float surprise = 1.5F;     ///< least deviation that resets a voxel
  float surprise_sigmas = 5.0F;
  float max_weight = 128.0F;
  float decision_sigma = 0.25F;  ///< a voxel decides by the sign alone once its mean is as certain as this
};

/// A voxel that is farther than this part of τ in front of the surface has no surface near it.
inline constexpr float kSaturated = 0.95F;
/// Such a voxel is reset at this part of τ at most, whatever σ is.
inline constexpr float kSaturatedSurprise = 0.75F;

/// Voxels this many σ deeper than τ behind a measured depth are measured, too, with −τ: otherwise only the
/// nearest of their measurements would count.
inline constexpr float kTailSigmas = 3.0F;
/// In how many frames a voxel decides by the sign alone: what it takes to change in the gate.
inline constexpr float kDecisionFrames = 3.0F;

/// A frame as the kernels read it. Lengths in voxels. A voxel centre of the camera's frame (x, y, z) is kept
/// as (fx x + cx z, fy y + cy z, z), so that dividing by z gives the pixel.
struct FrameView {
  const float* depth = nullptr;  ///< as PreparedDepth::fused_vox(), row by row
  std::int32_t width = 0, height = 0;
  float min_z = 1.0F;  ///< voxels nearer to the camera's plane are not updated
  FuseRules rules;
  /// From the first voxel of a block to each of its voxels.
  alignas(64) std::array<float, kBlockVoxels> du, dv, dz;
};

/// What a frame says of a block's voxels.
struct BlockVotes {
  BlockBits observed;   ///< measured in this frame
  BlockBits in_front;   ///< measured, and in front of the surface; this and the next two by more than the
                        ///< hysteresis, or at all in the frames in which a voxel decides by the sign
  BlockBits occupied;   ///< measured, and in the shell behind the surface
  BlockBits behind;     ///< measured, and behind the shell
  BlockBits saturated;  ///< measured, and no surface near
};

/// Fuses a frame into a block. `u`, `v`, `z`: its first voxel, as FrameView has it. Real-time safe: yes.
void fuse_block(const FrameView& frame, float u, float v, float z, FusedBlock& block, BlockVotes& votes);

/// How rays cross the directory of blocks. Lengths in blocks, in the grid's axes.
struct RayView {
  std::array<float, 3> eye, along_x, along_y, along_z;  ///< the eye, and the axes of C per unit of depth
  float inverse_fx = 0.0F, inverse_fy = 0.0F, cx = 0.0F, cy = 0.0F;
  float voxels_to_blocks = 0.125F;
  float truncation = 4.0F;  ///< voxels
  std::array<std::int32_t, 3> size{};
  const std::int32_t* directory = nullptr;
};
/// Greatest number of places that find_missing() returns for a row.
constexpr std::size_t max_missing(std::size_t width) { return 3 * (width + 16); }

/// Finds the blocks within ±τ of the depths of a row, in places of the directory, that have no content. A
/// place may occur several times. Returns how many; `missing` has room for max_missing(). Real-time safe:
/// yes.
std::size_t find_missing(const RayView& rays, const float* depth_vox, std::int32_t width, std::int32_t v,
                         std::int32_t* missing);

}  // namespace phantom::fusion::detail
