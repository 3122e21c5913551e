#pragma once
// The inner loops of skin sensing, in SIMD for whichever instructions the machine has; for SkinSensing alone.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/workspace/workspace.hpp"

namespace phantom::robot::kernel {

/// Sensors are packed in whole groups of this many; the rest is filled with sensors that weigh nothing, whose
/// codes mean nothing.
inline constexpr std::size_t kGroup = 16;
constexpr std::size_t whole_groups(std::size_t sensors) noexcept {
  return (sensors + kGroup - 1) / kGroup * kGroup;
}
/// Sensors whose greatest code is kept together: a whole number of groups.
inline constexpr std::size_t kBlock = 256;
/// A place this little below a voxel's border counts as beyond it, so that rounding does not decide for
/// sensors that lie exactly on a border.
inline constexpr double kBorderShift_vox = 1.0 / (1U << 30U);

/// Point sensors of one link, in the link's frame; `count` is a multiple of kGroup.
struct Points {
  const double *x_m, *y_m, *z_m, *weight;
  std::size_t count;
};

/// Where a block of kBlock points lies, in the link's frame.
struct Block {
  double centre_m[3];
  double radius_m;  ///< no point is farther from the centre
  double step_m;    ///< unit of its Offsets
  double weight;    ///< of all its points; negative: each has its own
};
/// Points from their blocks' centres, in steps so fine (of 2^-31 of the block) that they are as good as
/// doubles, at half of the memory to be read.
struct Offsets {
  const Block* blocks;
  const std::int32_t *x, *y, *z;
};
/// Measures the blocks of points of which the first `sensors` count; fills points.count steps and as many
/// blocks as it takes. Not real-time safe.
void measure_blocks(const Points& points, std::size_t sensors, std::vector<Block>& blocks, std::int32_t* x,
                    std::int32_t* y, std::int32_t* z);

/// A workspace as the loops read it.
struct Field {
  const std::uint32_t* directory;
  const std::uint8_t* codes;
  std::int32_t size_vox[3];
  std::int32_t size_bricks[3];
};
Field field_of(const workspace::Workspace& workspace) noexcept;

/// From the link's frame to voxel coordinates: v = r·p + t, r row by row. A place is in voxel floor(v +
/// kBorderShift_vox); |v| must stay below 2^31, else its voxel is arbitrary.
struct ToVoxels {
  double r[9], t[3];
};

/// Ten sums over sensors in the link's frame, m = w·μ: Σm, Σm(x,y,z), Σm(xx, xy, xz, yy, yz, zz).
struct Moments {
  double sum[10];
};

/// Sums of the gradient over sensors that meet fluid, W axes, in voxels: Σw∇μ, Σ(r×w∇μ) with r from the
/// link's origin, Σw|∇μ|²/μ.
struct GradientSums {
  double sum[7];
};

/// Codes of all points; optionally their voxels, folded into 32 bits so that neighbours differ. Real-time
/// safe: yes.
void look_up(const Field& field, const ToVoxels& to_voxels, const Points& points, std::uint8_t* codes,
             std::uint32_t* voxels) noexcept;
/// Moments of given μ (one for each point). Real-time safe: yes.
void add_moments(const Points& points, const double* mu, Moments& moments) noexcept;
/// look_up and add_moments in one go, μ from the palette: 256 entries, of which codes use the first
/// `palette_size` (the fewer, the faster: up to 64 need no gather with 512-bit vectors). `to_voxels` must be
/// a rotation ÷ voxel size. A block of points within the grid that reaches over at most two bricks along each
/// axis is placed in floats, any other in doubles, which takes about half as long again; a group of which one
/// point lies within 2^-13 voxels of a border takes both. A group in free space alone needs no sums.
/// Real-time safe: yes.
void sense(const Field& field, const ToVoxels& to_voxels, const Points& points, const Offsets& offsets,
           const float* palette, std::size_t palette_size, std::uint8_t* codes, Moments& moments) noexcept;
/// Sums of ∇μ by central differences over ± reach voxels, over points whose code is not 0; |∇μ|² is divided
/// by the palette's μ, or by `mu` if given. Real-time safe: yes.
void add_gradients(const Field& field, const ToVoxels& to_voxels, const Points& points, const float* palette,
                   std::size_t palette_size, const std::uint8_t* codes, const double* mu, int reach_vox,
                   GradientSums& sums) noexcept;

/// Greatest code and number of codes that are not 0 among n. Real-time safe: yes.
struct CodeFigures {
  std::uint8_t greatest = 0;
  std::size_t active = 0;
};
CodeFigures figures_of(const std::uint8_t* codes, std::size_t n) noexcept;

/// counts[c] = how many voxels of n tiles (64 bytes each) hold c, for c = 1…codes − 1, of those whose bit in
/// the tile's mask is set; a word past the last mask must be there to be read. Real-time safe: yes.
void count_codes(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n,
                 std::size_t codes, std::uint32_t* counts) noexcept;

/// The same in plain C++: where Highway has no SIMD, and the tests' twin.
namespace scalar {
void look_up(const Field& field, const ToVoxels& to_voxels, const Points& points, std::uint8_t* codes,
             std::uint32_t* voxels) noexcept;
void add_moments(const Points& points, const double* mu, Moments& moments) noexcept;
void sense(const Field& field, const ToVoxels& to_voxels, const Points& points, const float* palette,
           std::uint8_t* codes, Moments& moments) noexcept;
void add_gradients(const Field& field, const ToVoxels& to, const Points& points, const float* palette,
                   const std::uint8_t* codes, const double* mu, int reach_vox, GradientSums& sums) noexcept;
CodeFigures figures_of(const std::uint8_t* codes, std::size_t n) noexcept;
void count_codes(const std::uint8_t* const* tiles, const std::uint64_t* masks, std::size_t n,
                 std::size_t codes, std::uint32_t* counts) noexcept;
}  // namespace scalar

/// Name of the instruction set in use. For reports.
const char* target_name() noexcept;

}  // namespace phantom::robot::kernel
