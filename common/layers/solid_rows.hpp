#pragma once

// Private to this library: a solid's voxels in the form from which layers are computed.

#include <hwy/cache_control.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "common/voxelise/voxelise.hpp"
#include "common/workspace/large_pages.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers::detail {

/// What cells of a brick's size, aligned with bricks, hold of the solid; they may lie beyond the grid.
struct Cells {
  /// For each axis, bit i is set if the cell holds a solid voxel whose coordinate's last 5 bits are i.
  struct Bits {
    std::uint32_t x = 0, y = 0, z = 0;
    bool interior = false;  ///< the whole cell
  };

  workspace::VoxelBox box;  ///< of brick addresses
  std::vector<Bits> bits;   ///< by box.index()
};

/// A solid's voxels (boundary or interior) as columns of bits. A word holds 32 voxels along x. Words follow
/// each other along z, then along y, so that words used together are close in memory. Columns begin where
/// bricks begin.
class SolidRows {
 public:
  /// Keeps a reference to `solid`.
  SolidRows(const voxelise::SolidVoxels& solid, int threads);

  static constexpr std::size_t kReadBeyond = 8;

  static constexpr std::size_t kTile = 16;  // columns and slices: a cache line of either
  /// The words of kTile columns and slices at one y.
  struct Tile {
    alignas(64) std::uint32_t solid[kTile][kTile];  ///< [slice][column]
    alignas(64) std::uint32_t inner[kTile];         ///< [column]: interior in all slices
    alignas(64) std::uint32_t any[kTile];           ///< [column]: solid in any slice
  };

  /// Where a tile's words come from: rows of bits, 64 in a word.
  struct TileSource {
    const workspace::LargeVector<std::uint64_t>*boundary, *inside;
    std::size_t at;     ///< index of the word of the tile's first slice, in both volumes
    std::size_t ahead;  ///< the same for a later tile
    std::size_t layer;  ///< words from one slice to the next
    std::size_t words;  ///< left in the row from `at` on; 0 if it ended before
    int shift;          ///< bits between the start of the column and the start of the row
    bool follows;       ///< whether the row has words before `at`
  };

  /// The words at one y, for slices within a range.
  struct Lines {
    std::int32_t first = 0,
                 last = 0;  ///< slices that have words, in addresses of the grid; all others are free
    std::size_t place = 0, united = 0, layers = 0;
  };
  /// Returns the words at `y` for slices within [from, to).
  Lines lines(std::int32_t y, std::int32_t from, std::int32_t to) const noexcept {
    const std::int32_t in_y = y - box_.min.y;
    const std::int32_t first = std::max(from, box_.min.z), last = std::min(to, box_.min.z + box_.size[2]);
    if (in_y < 0 || in_y >= box_.size[1] || first >= last) return {};
    const auto row = static_cast<std::size_t>(in_y);
    const std::int32_t layer = (first >> 5) - cells_.box.min.z;
    return {first, last,
            row * static_cast<std::size_t>(box_.size[2]) + static_cast<std::size_t>(first - box_.min.z),
            row * static_cast<std::size_t>(cells_.box.size[2]) + static_cast<std::size_t>(layer),
            static_cast<std::size_t>(((last - 1) >> 5) - (first >> 5) + 1)};
  }
  /// Returns the words of the lines, one for each slice, in the column of bricks `x`. kReadBeyond more words
  /// may be read; their values are arbitrary.
  const std::uint32_t* words(const Lines& lines, std::int32_t x) const noexcept {
    const std::int32_t column = x - cells_.box.min.x;
    return column < 0 || column >= cells_.box.size[0]
               ? free_.data()
               : words_.data() + static_cast<std::size_t>(column) * column_words_ + lines.place;
  }
  /// Prefetches the same words. (If this is not inlined, GCC removes it as a function without effect.)
  HWY_INLINE void prefetch(const Lines& lines, std::int32_t x) const noexcept {
    const std::uint32_t* const from = words(lines, x);
    for (std::int32_t i = 0; i < lines.last - lines.first; i += 16) hwy::Prefetch(from + i);
  }
  /// Returns the voxels along x that are solid in any of the slices, or perhaps in other slices of the same
  /// layers of bricks.
  std::uint32_t united(const Lines& lines, std::int32_t x) const noexcept {
    const std::int32_t column = x - cells_.box.min.x;
    if (column < 0 || column >= cells_.box.size[0]) return 0;
    const std::uint32_t* layer =
        united_.data() + static_cast<std::size_t>(column) * column_united_ + lines.united;
    std::uint32_t all = 0;
    for (std::size_t i = 0; i < lines.layers; ++i) all |= layer[i];
    return all;
  }
  /// Returns 64 voxels of the boundary from x on, in kCount rows from y on.
  template <std::size_t kCount>
  std::array<std::uint64_t, kCount> boundary(std::int32_t x, std::int32_t y, std::int32_t z) const noexcept {
    std::array<std::uint64_t, kCount> bits{};
    const std::int32_t in_x = x - box_.min.x, in_y = y - box_.min.y, in_z = z - box_.min.z;
    if (in_z < 0 || in_z >= box_.size[2]) return bits;
    const auto words = static_cast<std::int32_t>(solid_.boundary.words_per_row());
    const std::int32_t at = in_x >> 6, shift = in_x & 63, last = words - 1;
    const std::uint64_t in_low = at >= 0 && at <= last ? ~std::uint64_t{0} : 0,
                        in_high = at >= -1 && at < last ? ~std::uint64_t{0} : 0;
    const std::int32_t low = std::clamp(at, 0, last), high = std::clamp(at + 1, 0, last);
    for (std::int32_t r = std::max(0, -in_y); r < std::min<std::int32_t>(kCount, box_.size[1] - in_y); ++r) {
      const std::uint64_t* const row = solid_.boundary.row(in_y + r, in_z);
      bits[static_cast<std::size_t>(r)] = (row[low] & in_low) >> shift | (row[high] & in_high)
                                                                             << 1 << (63 - shift);
    }
    return bits;
  }
  const Cells& cells() const noexcept { return cells_; }

 private:
  TileSource tile_source(std::size_t y, std::size_t z, std::size_t first_column) const;
  void take_layer(std::int32_t layer);
  void finish_cells(std::int32_t layer, bool whole_along_z, const std::vector<std::uint32_t>& inner);

  const voxelise::SolidVoxels& solid_;
  workspace::VoxelBox box_;
  Cells cells_;
  std::size_t column_words_, column_united_;
  workspace::LargeVector<std::uint32_t> words_;   // [column][y][z]
  workspace::LargeVector<std::uint32_t> united_;  // [column][y][layer of bricks]
  std::vector<std::uint32_t> free_;               // a column beyond the solid
};

}  // namespace phantom::layers::detail
