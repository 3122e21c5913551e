#pragma once

// Private to this library: exact Euclidean distance up to a reach B, in small integers, one axis after the
// other, block by block. Blocks are whole bricks; each looks at the solid within B around it, so that blocks
// do not depend on each other and memory does not depend on the object's size.

#include <algorithm>
#include <array>
#include <climits>
#include <cstdint>
#include <new>
#include <vector>

#include "common/layers/solid_rows.hpp"

namespace phantom::layers::detail {

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

/// Neighbour order as a function of the squared distance d² in voxels: `order[i]` for above[i−1] < d² ≤
/// above[i], the last one beyond the last border. `above` rises, begins with 0 and ends with reach²; one
/// `order` more than `above`.
struct OrderSteps {
  std::uint8_t reach = 0;  ///< B ≤ 254
  std::vector<std::uint16_t> above;
  std::vector<std::int8_t> order;
};

inline constexpr std::size_t kMostBricksAlongX = 8;

/// A block of nx × ny × nz bricks; nx ≤ kMostBricksAlongX.
struct BrickBlock {
  workspace::Index3 min;  ///< its first voxel: a brick's corner
  std::int32_t nx = 0, ny = 1, nz = 1;
  std::vector<std::int8_t*> bricks;  ///< where each one's orders go (kBrickVoxels, brick_offset layout), x
                                     ///< fastest; null: not wanted
};

/// Where there is anything solid along an axis, in places of the block's surroundings.
struct SolidSpan {
  int first = INT_MAX, last = -1;

  bool empty() const { return last < 0; }
  void add(const SolidSpan& other) {
    first = std::min(first, other.first);
    last = std::max(last, other.last);
  }
};

/// A bit for each row of the surroundings in which a vector of columns of a slice has any closeness; a word
/// more before and behind.
using RowBits = std::array<std::uint64_t, 6>;

/// What a vector of columns of a row holds in a layer of bricks: a bit for each slice.
struct RowNote {
  std::uint32_t in_reach = 0;  ///< where there is any closeness
  std::uint32_t solid = 0;
};

/// What a vector of columns of a slice knows of its rows.
struct RowsOfColumns {
  bool wanted = false;    ///< whether anybody asks
  std::uint8_t most = 0;  ///< the greatest closeness
  SolidSpan span;         ///< rows with any closeness
  RowBits bits{};
};

/// Work space of one thread.
class BandedDistance {
 public:
  BandedDistance(const SolidRows& solid, const OrderSteps& steps);

  /// Writes every voxel of every brick wanted; order[0] in the interior. A block that follows the last one
  /// along y, the others of its sides alike, takes less time.
  void run(const BrickBlock& block);

  /// For a machine that looks up many bytes in a table at once. Squares of distances fall into ranks: two of
  /// one rank lead to the same order whatever k², 0 ≤ k ≤ B, is added; classes are orders by distance, from 0
  /// (solid) on.
  struct Ranks {
    explicit Ranks(const OrderSteps& steps);

    bool fit = false;                       ///< whether all of it fits into bytes
    std::uint8_t far = 0;                   ///< rank of what is beyond the reach; one more than all others
    LineVector<std::uint8_t> of_closeness;  ///< [k][64]: rank of distance² + k², by closeness
    LineVector<std::uint8_t> classes;       ///< [k][128]: class of square + k², by rank
    LineVector<std::uint8_t> orders;        ///< [64]: by class
    std::vector<std::uint8_t> reach_of_closeness, reach_of_rank;  ///< how far a neighbour with it can matter
  };

  // For the kernel.
  const SolidRows& solid() const { return solid_; }
  const OrderSteps& steps() const { return steps_; }
  LineVector<std::uint16_t> k_squares;  // k² for 0 ≤ k ≤ B, a vector each
  LineVector<std::uint16_t> changes;  // order[0], then above[i], order[i + 1] − order[i], …, a vector each
  LineVector<std::uint8_t> closeness;     // [z][y][x]: B + 1 − distance along z, 0 for "farther than B"
  std::vector<std::uint64_t> solid_bits;  // [z]: 64 voxels of a row, in each slice of the surroundings
  std::vector<SolidSpan> solid_in;        // [y]: what the row holds, along x; if nothing, its closeness is 0
  BrickBlock last;                        // the block whose closeness is held; nx == 0: none
  LineVector<std::uint16_t>
      squares;  // [y][x] of one z: squared distance along z, some rows more before and behind
  LineVector<std::uint16_t>
      line;  // [x]: squared distance in the plane y, z, something more before and behind
  std::vector<std::uint8_t>
      reach_for;  // by a square: how far a neighbour with it can matter; beyond it is out of the band
  std::vector<std::uint16_t> least_in_slice;  // per vector along x: the least square of its columns
  LineVector<std::uint8_t> orders;            // [x] of one row
  Ranks ranks;
  LineVector<std::uint8_t>
      rank_columns;  // [x][y], four rows: rank in the plane y, z; something more before and behind
  std::vector<std::uint32_t> least_ranks;  // of sixteen columns each, a byte each
  std::vector<std::uint64_t>
      in_band;  // [x]: a bit where the rank in one of the rows is not far, a word more before and behind
  std::vector<RowsOfColumns> columns;  // per vector along x, of one slice
  std::vector<RowNote> row_notes;      // [layer of bricks][vector along x][y]

 private:
  const SolidRows& solid_;
  const OrderSteps& steps_;
};

}  // namespace phantom::layers::detail
