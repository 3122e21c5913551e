#include "common/voxel/solid_rows.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "common/core/parallel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/voxel/solid_rows.cpp"
#include <hwy/foreach_target.h>  // once per instruction set
// (keep this order)
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::voxel::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Puts a tile of words [slice][column] where they belong, those of a column one after the other; `in_slice`:
/// gathers what each slice has, [slice][column].
void PutTile(SolidRows::Tile& tile, std::size_t deep, std::size_t wide, std::uint32_t* to,
             std::size_t column_words, std::uint32_t* in_slice) {
  constexpr std::size_t kTile = SolidRows::kTile;
  const hn::CappedTag<std::uint32_t, kTile> d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t k = 0; k < deep; ++k) {
    for (std::size_t i = 0; i < kTile; i += lanes) {
      const auto solid = hn::Load(d, tile.solid[k] + i);
      std::uint32_t* const here = in_slice + k * kTile + i;
      hn::Store(hn::Or(hn::Load(d, here), solid), d, here);
      hn::Store(hn::Or(hn::Load(d, tile.any + i), solid), d, tile.any + i);
    }
  }
#if HWY_TARGET == HWY_SCALAR
  for (std::size_t i = 0; i < wide; ++i) {
    for (std::size_t k = 0; k < deep; ++k) to[i * column_words + k] = tile.solid[k][i];
  }
#else
  const hn::Repartition<std::uint64_t, decltype(d)> pairs;
  for (std::size_t k = 0; k < deep; k += 4) {
    const std::size_t bytes = 4 * std::min<std::size_t>(4, deep - k);
    for (std::size_t i = 0; i < wide; i += lanes) {
      const auto a = hn::Load(d, tile.solid[k] + i), b = hn::Load(d, tile.solid[k + 1] + i),
                 c = hn::Load(d, tile.solid[k + 2] + i), e = hn::Load(d, tile.solid[k + 3] + i);
      const auto low_ab = hn::BitCast(pairs, hn::InterleaveLower(d, a, b)),
                 low_ce = hn::BitCast(pairs, hn::InterleaveLower(d, c, e)),
                 high_ab = hn::BitCast(pairs, hn::InterleaveUpper(d, a, b)),
                 high_ce = hn::BitCast(pairs, hn::InterleaveUpper(d, c, e));
      // Of each four columns the first, the second, … with four slices each.
      alignas(64) std::uint32_t columns[4][kTile];
      hn::Store(hn::BitCast(d, hn::InterleaveLower(pairs, low_ab, low_ce)), d, columns[0]);
      hn::Store(hn::BitCast(d, hn::InterleaveUpper(pairs, low_ab, low_ce)), d, columns[1]);
      hn::Store(hn::BitCast(d, hn::InterleaveLower(pairs, high_ab, high_ce)), d, columns[2]);
      hn::Store(hn::BitCast(d, hn::InterleaveUpper(pairs, high_ab, high_ce)), d, columns[3]);
      for (std::size_t column = i; column < std::min(i + lanes, wide); ++column) {
        const std::uint32_t* const from = &columns[column % 4][(column - i) / 4 * 4];
        if (bytes == 16) {
          std::memcpy(to + column * column_words + k, from, 16);
        } else {
          std::memcpy(to + column * column_words + k, from, bytes);
        }
      }
    }
  }
#endif
}

}  // namespace phantom::voxel::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::voxel::detail {

HWY_EXPORT(PutTile);

namespace {

constexpr std::int32_t brick_of(std::int32_t voxel) { return voxel >> 5; }  // rounds down, below 0 too
static_assert(kBrickEdge == 32);

/// Words of a row of 64 bits each that begins `shift` (< 64) bits later.
class ShiftedRow {
 public:
  ShiftedRow(const std::uint64_t* row, std::size_t words, int shift)
      : row_(row), words_(words), shift_(shift) {}
  std::uint64_t operator[](std::size_t i) const {
    const std::uint64_t here = i < words_ ? row_[i] : 0, before = i > 0 && i <= words_ ? row_[i - 1] : 0;
    return here << shift_ | before >> 1 >> (63 - shift_);
  }

 private:
  const std::uint64_t* row_;
  std::size_t words_;
  int shift_;
};

Cells cells_over(const VoxelBox& box) {
  Cells cells;
  cells.min = {brick_of(box.min.x), brick_of(box.min.y), brick_of(box.min.z)};
  cells.size = {brick_of(box.min.x + box.size[0] - 1) - cells.min.x + 1,
                brick_of(box.min.y + box.size[1] - 1) - cells.min.y + 1,
                brick_of(box.min.z + box.size[2] - 1) - cells.min.z + 1};
  cells.bits.resize(cells.index(0, 0, cells.size[2]));
  return cells;
}

}  // namespace

SolidRows::SolidRows(const SolidVoxels& solid, int threads)
    : solid_(solid),
      box_(solid.box),
      cells_(cells_over(solid.box)),
      column_words_(static_cast<std::size_t>(box_.size[1]) * static_cast<std::size_t>(box_.size[2])),
      column_united_(static_cast<std::size_t>(box_.size[1]) * static_cast<std::size_t>(cells_.size[2])),
      free_(static_cast<std::size_t>(box_.size[2]) + kReadBeyond, 0) {
  words_.resize(static_cast<std::size_t>(cells_.size[0]) * column_words_ + kReadBeyond);
  united_.resize(static_cast<std::size_t>(cells_.size[0]) * column_united_);
  core::parallel_for(threads, static_cast<std::size_t>(cells_.size[2]),
                     [&](std::size_t layer, std::size_t) { take_layer(static_cast<std::int32_t>(layer)); });
}

/// Takes up to kTile words of a row, from a column on, into a tile's slice.
void SolidRows::take_row(std::int32_t in_y, std::int32_t in_z, std::size_t first_column, Tile& tile,
                         std::size_t slice) const {
  constexpr std::int32_t kAhead =
      6;  // rows; the next slice is too far away for the processor to see what comes
  const std::size_t words = solid_.boundary.words_per_row();
  const std::uint64_t *boundary_row = solid_.boundary.row(in_y, in_z),
                      *interior_row = solid_.interior.row(in_y, in_z);
  const std::size_t ahead =
      static_cast<std::size_t>(std::min(kAhead, box_.size[1] - 1 - in_y)) * words + first_column / 2;
  hwy::Prefetch(boundary_row + ahead);
  hwy::Prefetch(interior_row + ahead);
  const int shift = box_.min.x & 31;
  const ShiftedRow boundary(boundary_row, words, shift), interior(interior_row, words, shift);
  for (std::size_t i = 0; i < kTile; i += 2) {
    const std::uint64_t inner = interior[(first_column + i) / 2],
                        solid = inner | boundary[(first_column + i) / 2];
    tile.solid[slice][i] = static_cast<std::uint32_t>(solid);
    tile.solid[slice][i + 1] = static_cast<std::uint32_t>(solid >> 32);
    tile.inner[i] &= static_cast<std::uint32_t>(inner);
    tile.inner[i + 1] &= static_cast<std::uint32_t>(inner >> 32);
  }
}

/// Takes a layer of bricks, in tiles of columns and slices of one y.
void SolidRows::take_layer(std::int32_t layer) {
  const std::int32_t from_z = std::max(box_.min.z, (cells_.min.z + layer) * kBrickEdge);
  const std::int32_t to_z = std::min(box_.min.z + box_.size[2], (cells_.min.z + layer + 1) * kBrickEdge);
  const auto columns = static_cast<std::size_t>(cells_.size[0]),
             rows = static_cast<std::size_t>(box_.size[1]), layers = static_cast<std::size_t>(cells_.size[2]);
  const auto deep = static_cast<std::size_t>(to_z - from_z),
             below = static_cast<std::size_t>(from_z - box_.min.z);
  std::vector<std::uint32_t> inner(rows * columns);
  Tile tile{};
  alignas(64) std::array<std::array<std::uint32_t, kTile>, kBrickEdge> in_slice;
  for (std::size_t first = 0; first < columns; first += kTile) {
    const std::size_t wide = std::min(kTile, columns - first);
    in_slice = {};
    for (std::size_t y = 0; y < rows; ++y) {
      const auto in_y = static_cast<std::int32_t>(y);
      std::fill(std::begin(tile.inner), std::end(tile.inner), ~std::uint32_t{0});
      std::fill(std::begin(tile.any), std::end(tile.any), 0);
      for (std::size_t z = 0; z < deep; z += kTile) {
        const std::size_t slices = std::min(kTile, deep - z);
        for (std::size_t k = 0; k < slices; ++k)
          take_row(in_y, static_cast<std::int32_t>(below + z + k), first, tile, k);
        HWY_DYNAMIC_DISPATCH(PutTile)
        (tile, slices, wide,
         words_.data() + first * column_words_ + y * static_cast<std::size_t>(box_.size[2]) + below + z,
         column_words_, in_slice[z].data());
      }
      std::copy_n(tile.inner, wide, inner.data() + y * columns + first);
      for (std::size_t i = 0; i < wide; ++i)
        united_[(first + i) * column_united_ + y * layers + static_cast<std::size_t>(layer)] = tile.any[i];
      const std::int32_t cell_y = brick_of(in_y + box_.min.y) - cells_.min.y;
      if (y + 1 < rows && brick_of(in_y + 1 + box_.min.y) - cells_.min.y == cell_y) continue;
      Cells::Bits* const here = &cells_.bits[cells_.index(static_cast<std::int32_t>(first), cell_y, layer)];
      for (std::size_t z = 0; z < deep; ++z) {
        const std::uint32_t bit = std::uint32_t{1} << ((from_z + static_cast<std::int32_t>(z)) & 31);
        for (std::size_t i = 0; i < wide; ++i) here[i].z |= in_slice[z][i] != 0 ? bit : 0;
      }
      in_slice = {};
    }
  }
  settle_cells(layer, to_z - from_z == kBrickEdge, inner);
}

/// What is left to be said of a layer's cells; `inner`: by y and column, where all slices are interior.
void SolidRows::settle_cells(std::int32_t layer, bool whole_along_z,
                             const std::vector<std::uint32_t>& inner) {
  const auto columns = static_cast<std::size_t>(cells_.size[0]);
  for (std::int32_t y = box_.min.y; y < box_.min.y + box_.size[1]; ++y) {
    const auto row = static_cast<std::size_t>(y - box_.min.y);
    const std::int32_t cell_y = brick_of(y), from_y = cell_y * kBrickEdge;
    const bool whole =
        whole_along_z && from_y >= box_.min.y && from_y + kBrickEdge <= box_.min.y + box_.size[1];
    Cells::Bits* const here = &cells_.bits[cells_.index(0, cell_y - cells_.min.y, layer)];
    for (std::size_t i = 0; i < columns; ++i) {
      const std::uint32_t any = united_[i * column_united_ + row * static_cast<std::size_t>(cells_.size[2]) +
                                        static_cast<std::size_t>(layer)];
      here[i].x |= any;
      here[i].y |= any != 0 ? std::uint32_t{1} << (y & 31) : 0;
      here[i].interior =
          whole && (y == from_y || here[i].interior) && inner[row * columns + i] == ~std::uint32_t{0};
    }
  }
}

}  // namespace phantom::voxel::detail
#endif  // HWY_ONCE
