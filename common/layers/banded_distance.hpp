#pragma once

// Private to this library: exact Euclidean distance up to a reach B, in small integers, one axis after the
// other, block by block. Blocks consist of whole bricks. Each block reads the solid within B around it, so
// blocks do not depend on each other and memory does not depend on the object's size.

#include <algorithm>
#include <array>
#include <climits>
#include <cstdint>
#include <vector>

#include "common/layers/solid_rows.hpp"
#include "common/workspace/aligned.hpp"

namespace phantom::layers::detail {

/// Bytes of the longest vector; rows are padded to multiples of it.
inline constexpr std::size_t kMaxVector = 64;

template <class T>
using LineVector = workspace::AlignedVector<T>;  // a whole vector loads from a single line

/// Neighbour order as a function of the squared distance d² in voxels. It is `order[i]` for above[i−1] < d² ≤
/// above[i], and the last one beyond the last limit. `above` rises, begins with 0 and ends with reach².
/// `order` has one element more than `above`.
struct OrderSteps {
  std::uint8_t reach = 0;  ///< B ≤ 254
  std::vector<std::uint16_t> above;
  std::vector<std::int8_t> order;
};

inline constexpr std::size_t kMaxBricksAlongX = 8;

/// A block of nx × ny × nz bricks, with nx ≤ kMaxBricksAlongX.
struct BrickBlock {
  workspace::Index3 min;  ///< first voxel of the block, which is a brick's corner
  std::int32_t nx = 0, ny = 1, nz = 1;
  std::vector<std::int8_t*> bricks;  ///< where to write each brick's orders (kBrickVoxels, brick_offset
                                     ///< layout), x fastest; null: not wanted
};

/// The range along an axis that holds anything solid, in coordinates of the block's surroundings.
struct SolidSpan {
  int first = INT_MAX, last = -1;

  bool empty() const { return last < 0; }
  void add(const SolidSpan& other) {
    first = std::min(first, other.first);
    last = std::max(last, other.last);
  }
};

/// One bit for each row of the surroundings: whether a vector of columns of a slice has any proximity there.
/// One more word before and after.
using RowBits = std::array<std::uint64_t, 6>;

/// What a vector of columns of a row holds in a layer of bricks, one bit for each slice.
struct RowSummary {
  std::uint32_t in_reach = 0;  ///< slices with any proximity
  std::uint32_t solid = 0;
};

/// Summary of the rows of a vector of columns in one slice.
struct RowsOfColumns {
  bool wanted = false;    ///< whether a wanted brick depends on these columns
  std::uint8_t most = 0;  ///< greatest proximity
  SolidSpan span;         ///< rows with any proximity
  RowBits bits{};
};

/// Computes the orders of blocks of bricks from their distances to the solid. Holds the work space of one
/// thread.
class BandedDistance {
 public:
  BandedDistance(const SolidRows& solid, const OrderSteps& steps);

  /// Writes every voxel of every wanted brick; interior voxels get order[0]. Faster if the block follows the
  /// previous one along y and is the same otherwise.
  void run(const BrickBlock& block);

  /// Tables for machines that look up many bytes in a table at once. Squared distances are grouped into
  /// ranks. Two squares of one rank give the same order, whatever k², 0 ≤ k ≤ B, is added. Classes number the
  /// orders by distance, from 0 (solid).
  struct Ranks {
    explicit Ranks(const OrderSteps& steps);

    bool fit = false;                       ///< whether everything fits into bytes
    std::uint8_t far = 0;                   ///< rank of everything beyond the reach; the greatest
    LineVector<std::uint8_t> of_proximity;  ///< [k][64]: rank of distance² + k², indexed by proximity
    LineVector<std::uint8_t> classes;       ///< [k][128]: class of square + k², indexed by rank
    LineVector<std::uint8_t> orders;        ///< [64]: indexed by class
    std::vector<std::uint8_t> reach_of_proximity, reach_of_rank;  ///< how far away (k) a neighbour can matter
  };

  // For the kernel.
  const SolidRows& solid() const { return solid_; }
  const OrderSteps& steps() const { return steps_; }
  LineVector<std::uint16_t> k_squares;  // k² for 0 ≤ k ≤ B, one vector each
  LineVector<std::uint16_t> changes;  // order[0], then above[i], order[i + 1] − order[i], …, one vector each
  LineVector<std::uint8_t> proximity;     // [z][y][x]: B + 1 − distance along z, or 0 if farther than B
  std::vector<std::uint64_t> solid_bits;  // [z]: 64 voxels of a row, for each slice of the surroundings
  std::vector<SolidSpan> solid_in;        // [y]: solid range of the row along x; if empty, its proximity is 0
  BrickBlock last;                        // the block to which `proximity` belongs; nx == 0: none
  // [y][x] of one z: squared distance along z; padding rows before and after.
  LineVector<std::uint16_t> squares;
  LineVector<std::uint16_t> line;       // [x]: squared distance in the plane y, z; padded before and after
  std::vector<std::uint8_t> reach_for;  // for each square: how far away (k) a neighbour with it can matter
  std::vector<std::uint16_t> least_in_slice;  // for each vector along x: least square of its columns
  LineVector<std::uint8_t> orders;            // [x] of one row
  Ranks ranks;
  // [x][y], four rows: rank in the plane y, z; padded before and after.
  LineVector<std::uint8_t> rank_columns;
  std::vector<std::uint32_t> least_ranks;  // one byte for each sixteen columns
  // [x]: one bit, set if a row's rank is not far; one more word before and after.
  std::vector<std::uint64_t> in_band;
  std::vector<RowsOfColumns> columns;     // for each vector along x, of one slice
  std::vector<RowSummary> row_summaries;  // [layer of bricks][vector along x][y]

 private:
  const SolidRows& solid_;
  const OrderSteps& steps_;
};

}  // namespace phantom::layers::detail
