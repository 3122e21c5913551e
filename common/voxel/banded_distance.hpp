#pragma once

// Private to this library: exact Euclidean distance up to a reach B, in small integers, one axis after the other, block
// by block. Blocks are whole bricks; each looks at the solid within B around it, so that blocks do not depend on each
// other and memory does not depend on the object's size.

#include <algorithm>
#include <cstdint>
#include <new>
#include <vector>

#include "common/voxel/large_pages.hpp"
#include "common/voxel/voxelise.hpp"

namespace phantom::voxel::detail {

/// Bytes of the longest vector; rows are padded to it.
inline constexpr std::size_t kLongestVector = 64;

/// Memory whose rows begin where cache lines do, for whole vectors to be loaded from one line.
template <class T>
struct LineAllocator {
  using value_type = T;
  LineAllocator() = default;
  template <class U>
  LineAllocator(const LineAllocator<U>&) {}  // NOLINT: implicit by intent
  T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), kAlignment)); }
  void deallocate(T* memory, std::size_t) { ::operator delete(memory, kAlignment); }
  friend bool operator==(const LineAllocator&, const LineAllocator&) { return true; }
  static constexpr std::align_val_t kAlignment{kLongestVector};
};
template <class T>
using LineVector = std::vector<T, LineAllocator<T>>;

/// Neighbour order as a function of the squared distance d² in voxels: `order[i]` for above[i−1] < d² ≤ above[i], the
/// last one beyond the last border. `above` rises, begins with 0 and ends with reach²; one `order` more than `above`.
struct OrderSteps {
  std::uint8_t reach = 0;  ///< B ≤ 254
  std::vector<std::uint16_t> above;
  std::vector<std::int8_t> order;
};

/// A solid's voxels (boundary or interior) as rows of bits along x that begin at whole bricks, with free space before and
/// behind, so that any vector near the solid can be loaded as it stands.
class SolidRows {
 public:
  /// `margin_vox`: how far outside of the solid's bricks rows can be asked for.
  SolidRows(const SolidVoxels& solid, std::int32_t margin_vox, int threads);

  /// Rows of one y, for z in [first, last): that of `first` begins at `bits`, each further one `stride` bytes later.
  struct Lines {
    const std::uint8_t* bits = nullptr;
    std::size_t stride = 0;
    std::int32_t first = 0, last = 0;  ///< slices that have rows; all others are free
  };
  /// Rows from voxel x on (8 a byte; x a multiple of 8) at y, for slices within [from, to), in addresses of the grid.
  Lines lines(std::int32_t x, std::int32_t y, std::int32_t from, std::int32_t to) const noexcept {
    const std::int32_t in_y = y - box_.min.y;
    if (in_y < 0 || in_y >= box_.size[1]) return {};
    const std::int32_t first = std::max(from, box_.min.z), last = std::min(to, box_.min.z + box_.size[2]);
    if (first >= last) return {};
    const std::size_t row = static_cast<std::size_t>(in_y) * static_cast<std::size_t>(box_.size[2]) + static_cast<std::size_t>(first - box_.min.z);
    return {bits_.data() + row * row_bytes_ + (x - first_x_) / 8, row_bytes_, first, last};
  }

 private:
  VoxelBox box_;
  std::int32_t first_x_ = 0;
  std::size_t row_bytes_ = 0;
  LargeVector<std::uint8_t> bits_;  // z fastest: what is looked at together stands together
};

inline constexpr std::size_t kMostBricksAlongX = 8;

/// A block of nx × ny × nz bricks; nx ≤ kMostBricksAlongX.
struct BrickBlock {
  Index3 min;  ///< its first voxel: a brick's corner
  std::int32_t nx = 1, ny = 1, nz = 1;
  std::vector<std::int8_t*> bricks;  ///< where each one's orders go (kBrickVoxels, brick_offset layout), x fastest; null: not wanted
};

/// Work space of one thread.
class BandedDistance {
 public:
  BandedDistance(const SolidRows& solid, const OrderSteps& steps);

  /// Writes every voxel of every brick wanted; boundary voxels count as solid (order[0]) here.
  void run(const BrickBlock& block);

  // For the kernel.
  const SolidRows& solid() const { return solid_; }
  const OrderSteps& steps() const { return steps_; }
  LineVector<std::uint16_t> k_squares;     // k² for 0 ≤ k ≤ B, a vector each
  LineVector<std::uint16_t> changes;       // order[0], then above[i], order[i + 1] − order[i], …, a vector each
  LineVector<std::uint8_t> closeness;      // [z][y][x]: B + 1 − distance along z, 0 for "farther than B"
  std::vector<std::uint8_t> filled;         // [y]: whether the row has any closeness above 0
  LineVector<std::uint16_t> squares;       // [y][x] of one z: squared distance along z, some rows more before and behind
  LineVector<std::uint16_t> line;          // [x]: squared distance in the plane y, z, something more before and behind
  std::vector<std::uint8_t> reach_for;      // by a square: how far a neighbour with it can matter; beyond it is out of the band
  std::vector<std::uint16_t> least_in_slice;  // per vector along x: the least square of its columns
  LineVector<std::uint8_t> orders;         // [x] of one row

 private:
  const SolidRows& solid_;
  const OrderSteps& steps_;
};

}  // namespace phantom::voxel::detail
