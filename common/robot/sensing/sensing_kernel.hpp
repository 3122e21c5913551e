#pragma once
// Private to skin sensing: its inner loops, in SIMD for the best instruction set of the machine.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/workspace/workspace.hpp"

namespace phantom::robot::kernel {

/// Sensors are packed in whole groups of this many. Padding sensors of weight 0 fill the last group; their
/// codes mean nothing.
inline constexpr std::size_t kGroup = 16;
constexpr std::size_t whole_groups(std::size_t sensors) noexcept {
  return (sensors + kGroup - 1) / kGroup * kGroup;
}
/// Number of sensors for which one greatest code is kept: a whole number of groups.
inline constexpr std::size_t kBlock = 256;
/// A point that is at most this far below a voxel's border counts as beyond it. Otherwise rounding would
/// decide for sensors that lie exactly on a border.
inline constexpr double kBorderShift_vox = 1.0 / (1U << 30U);

/// Point sensors of one link, in the link's frame. `count` is a multiple of kGroup.
struct Points {
  const double *x_m, *y_m, *z_m, *weight;
  std::size_t count;
};

/// Bounds of a block of kBlock points, in the link's frame.
struct Block {
  double centre_m[3];
  double radius_m;  ///< no point is farther from the centre
  double step_m;    ///< length of one step of its Offsets
  double weight;    ///< weight of each of its points; negative: each point has its own
};
/// Positions of points relative to their blocks' centres, in steps of 2^-31 of the block. They are as precise
/// as doubles at half the memory traffic.
struct Offsets {
  const Block* blocks;
  const std::int32_t *x, *y, *z;
};
/// Computes the blocks of `points`, of which the first `sensors` are real. Fills points.count steps and the
/// ⌈sensors / kBlock⌉ blocks. Real-time safe: yes.
void measure_blocks(const Points& points, std::size_t sensors, Block* blocks, std::int32_t* x,
                    std::int32_t* y, std::int32_t* z) noexcept;

/// A workspace in the form that the loops read.
struct Field {
  const std::uint32_t* directory;
  const std::uint8_t* codes;
  std::int32_t size_vox[3];
  std::int32_t size_bricks[3];
};
Field field_of(const workspace::Workspace& workspace) noexcept;

/// Transform from the link's frame to voxel coordinates: v = r·p + t, with r row by row. A point is in voxel
/// floor(v + kBorderShift_vox). |v| must stay below 2^31; otherwise the voxel is arbitrary.
struct ToVoxels {
  double r[9], t[3];
  double stretch[3] = {1.0, 1.0, 1.0};  ///< sides of a voxel in reference lengths (workspace::VoxelSize)
};

/// Ten sums over sensors in the link's frame, with m = w·μ: Σm, Σm(x,y,z), Σm(xx, xy, xz, yy, yz, zz).
struct Moments {
  double sum[10];
};

/// Sums of the gradient over the sensors that meet fluid, in W axes and reference lengths: Σw∇μ, Σ(r×w∇μ)
/// with r from the link's origin, Σw|∇μ|²/μ.
struct GradientSums {
  double sum[7];
};

/// Looks up the codes of all points and, if `voxels` is not null, their voxel indices folded into 32 bits so
/// that neighbours differ. Real-time safe: yes.
void look_up(const Field& field, const ToVoxels& to_voxels, const Points& points, std::uint8_t* codes,
             std::uint32_t* voxels) noexcept;
/// Adds the moments for given μ (one value for each point). Real-time safe: yes.
void add_moments(const Points& points, const double* mu, Moments& moments) noexcept;
/// Does look_up and add_moments in one pass, with μ from the palette. The palette has 256 entries, of which
/// codes use the first `palette_size` (the fewer, the faster: up to 64 need no gather with 512-bit vectors).
/// `to_voxels` must be a rotation, each row divided by the voxel's side. Real-time safe: yes.
///
/// Cost: a block of points within the grid that spans at most two bricks along each axis is computed in
/// floats. Any other block is computed in doubles, which takes about half as long again. A group with a point
/// within 2^-13 voxels of a border takes both. A group wholly in free space needs no sums.
void sense(const Field& field, const ToVoxels& to_voxels, const Points& points, const Offsets& offsets,
           const float* palette, std::size_t palette_size, std::uint8_t* codes, Moments& moments) noexcept;
/// Adds the sums of ∇μ by central differences over ± reach voxels, for points whose code is not 0. |∇μ|² is
/// divided by the palette's μ, or by `mu` if it is not null. Real-time safe: yes.
void add_gradients(const Field& field, const ToVoxels& to_voxels, const Points& points, const float* palette,
                   std::size_t palette_size, const std::uint8_t* codes, const double* mu, int reach_vox,
                   GradientSums& sums) noexcept;

/// Greatest code among n, and the number of codes that are not 0.
struct CodeFigures {
  std::uint8_t greatest = 0;
  std::size_t active = 0;
};
CodeFigures figures_of(const std::uint8_t* codes, std::size_t n) noexcept;

/// Sets counts[c], for c = 1…codes − 1, to the number of voxels in n tiles (64 bytes each) that hold c and
/// whose bit in the tile's mask is set. One word past the last mask must be readable. Real-time safe: yes.
void count_codes(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n,
                 std::size_t codes, std::uint32_t* counts) noexcept;

/// Returns the name of the instruction set in use, for reports.
const char* target_name() noexcept;

}  // namespace phantom::robot::kernel
