#include "common/layers/solid_rows.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "common/core/parallel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/layers/solid_rows.cpp"
#include <hwy/foreach_target.h>  // compiled once for each instruction set
// foreach_target.h must come before highway.h.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::layers::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Words = hn::CappedTag<std::uint64_t, SolidRows::kTile / 2>;
constexpr Words kWords;
constexpr std::size_t kTileWords = SolidRows::kTile / 2;  // of 64 bits

/// Returns words of 64 bits of a row that begins `shift` bits later, with zeros beyond its ends. `at`: index
/// in the volume of the row's first word; `part`: index of the first wanted word in the row.
HWY_INLINE hn::Vec<Words> words_at(const SolidRows::TileSource& from,
                                   const workspace::LargeVector<std::uint64_t>& volume, std::size_t at,
                                   std::size_t part) {
  const std::size_t lanes = hn::Lanes(kWords), left = from.words - std::min(from.words, part);
  const bool before = from.follows || part > 0;  // whether the row has a word before these
  hn::Vec<Words> here, earlier;
  if (at + part > 0 && at + part + lanes <= volume.size()) {
    const std::uint64_t* const words = volume.data() + at + part;
    here = hn::IfThenElseZero(hn::FirstN(kWords, left), hn::LoadU(kWords, words));
    earlier = hn::IfThenElseZero(hn::FirstN(kWords, left == 0 && part > from.words ? 0 : left + 1),
                                 hn::LoadU(kWords, words - 1));
    if (!before) earlier = hn::IfThenElse(hn::FirstN(kWords, 1), hn::Zero(kWords), earlier);
  } else {  // near the volume's ends
    alignas(64) std::uint64_t row[kTileWords + 1] = {};
    for (std::size_t i = 0; i < std::min(left, lanes); ++i) row[i + 1] = volume[at + part + i];
    if (before && part <= from.words) row[0] = volume[at + part - 1];
    here = hn::LoadU(kWords, row + 1);
    earlier = hn::LoadU(kWords, row);
  }
  return hn::Or(hn::ShiftLeftSame(here, from.shift),
                hn::ShiftRight<1>(hn::ShiftRightSame(earlier, 63 - from.shift)));
}

/// Transposes a tile's words [slice][column] to columns, in which words follow each other along z. Also
/// collects in `in_slice` [slice][column] what each slice has.
void TakeTile(const SolidRows::TileSource& from, SolidRows::Tile& tile, std::size_t deep, std::size_t wide,
              std::uint32_t* to, std::size_t column_words, std::uint32_t* in_slice) {
  constexpr std::size_t kTile = SolidRows::kTile;
  for (std::size_t k = 0; k < deep; ++k) {
    hwy::Prefetch(from.boundary->data() + from.ahead + k * from.layer);
    hwy::Prefetch(from.inside->data() + from.ahead + k * from.layer);
  }
  for (std::size_t part = 0; part < kTileWords; part += hn::Lanes(kWords)) {
    // Words of 32 bits, two in each word of 64 bits.
    const hn::Repartition<std::uint32_t, Words> halves;
    const auto load = [&](const std::uint32_t* words)
                          HWY_ATTR { return hn::BitCast(kWords, hn::Load(halves, words + 2 * part)); };
    const auto store = [&](hn::Vec<Words> pairs, std::uint32_t* words)
                           HWY_ATTR { hn::Store(hn::BitCast(halves, pairs), halves, words + 2 * part); };
    auto inner = load(tile.inner), any = load(tile.any);
    std::size_t at = from.at;
    for (std::size_t k = 0; k < deep; ++k, at += from.layer) {
      const auto inside = words_at(from, *from.inside, at, part);
      const auto boundary = words_at(from, *from.boundary, at, part);
      const auto solid = hn::Or(inside, boundary);
      inner = hn::And(inner, hn::AndNot(boundary, inside));
      any = hn::Or(any, solid);
      store(solid, tile.solid[k]);
      store(hn::Or(load(in_slice + k * kTile), solid), in_slice + k * kTile);
    }
    store(inner, tile.inner);
    store(any, tile.any);
  }
  const hn::CappedTag<std::uint32_t, kTile> d;
  const std::size_t lanes = hn::Lanes(d);
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
      // The first, second, … of each four columns, with four slices each.
      alignas(64) std::uint32_t columns[4][kTile];
      hn::Store(hn::BitCast(d, hn::InterleaveLower(pairs, low_ab, low_ce)), d, columns[0]);
      hn::Store(hn::BitCast(d, hn::InterleaveUpper(pairs, low_ab, low_ce)), d, columns[1]);
      hn::Store(hn::BitCast(d, hn::InterleaveLower(pairs, high_ab, high_ce)), d, columns[2]);
      hn::Store(hn::BitCast(d, hn::InterleaveUpper(pairs, high_ab, high_ce)), d, columns[3]);
      for (std::size_t column = i; column < std::min(i + lanes, wide); ++column) {
        const std::uint32_t* const words = &columns[column % 4][(column - i) / 4 * 4];
        if (bytes == 16) {
          std::memcpy(to + column * column_words + k, words, 16);
        } else {
          std::memcpy(to + column * column_words + k, words, bytes);
        }
      }
    }
  }
}

}  // namespace phantom::layers::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::layers::detail {

HWY_EXPORT(TakeTile);

namespace {

Cells cells_over(const workspace::VoxelBox& box) {
  Cells cells{workspace::bricks_of(box), {}};
  cells.bits.resize(cells.box.voxel_count());
  return cells;
}

}  // namespace

SolidRows::SolidRows(const voxelise::SolidVoxels& solid, int threads)
    : solid_(solid),
      box_(solid.box),
      cells_(cells_over(solid.box)),
      column_words_(static_cast<std::size_t>(box_.size[1]) * static_cast<std::size_t>(box_.size[2])),
      column_united_(static_cast<std::size_t>(box_.size[1]) * static_cast<std::size_t>(cells_.box.size[2])),
      free_(static_cast<std::size_t>(box_.size[2]) + kReadBeyond, 0) {
  words_.resize(static_cast<std::size_t>(cells_.box.size[0]) * column_words_ + kReadBeyond);
  united_.resize(static_cast<std::size_t>(cells_.box.size[0]) * column_united_);
  core::parallel_for(threads, static_cast<std::size_t>(cells_.box.size[2]),
                     [&](std::size_t layer, std::size_t) { take_layer(static_cast<std::int32_t>(layer)); });
}

/// Returns the rows of a tile that begins at these indices. They include the rows of a later tile to
/// prefetch.
SolidRows::TileSource SolidRows::tile_source(std::size_t y, std::size_t z, std::size_t first_column) const {
  const std::size_t row = solid_.boundary.words_per_row(), rows = static_cast<std::size_t>(box_.size[1]),
                    first = first_column / 2;
  constexpr std::size_t kAhead = 6;  // rows; the next slice is too far away for the hardware prefetcher
  const std::size_t at = (z * rows + y) * row + first;
  return {&solid_.boundary.words(),
          &solid_.inside.words(),
          at,
          at + std::min(kAhead, rows - 1 - y) * row,
          rows * row,
          row - std::min(row, first),
          box_.min.x & 31,
          first > 0};
}

/// Processes a layer of bricks, in tiles of columns and slices of one y.
void SolidRows::take_layer(std::int32_t layer) {
  const std::int32_t from_z = std::max(box_.min.z, (cells_.box.min.z + layer) * workspace::kBrickEdge);
  const std::int32_t to_z =
      std::min(box_.min.z + box_.size[2], (cells_.box.min.z + layer + 1) * workspace::kBrickEdge);
  const auto columns = static_cast<std::size_t>(cells_.box.size[0]),
             rows = static_cast<std::size_t>(box_.size[1]),
             layers = static_cast<std::size_t>(cells_.box.size[2]);
  const auto deep = static_cast<std::size_t>(to_z - from_z),
             below = static_cast<std::size_t>(from_z - box_.min.z);
  std::vector<std::uint32_t> inner(rows * columns);
  Tile tile{};
  alignas(64) std::array<std::array<std::uint32_t, kTile>, workspace::kBrickEdge> in_slice;
  for (std::size_t first = 0; first < columns; first += kTile) {
    const std::size_t wide = std::min(kTile, columns - first);
    in_slice = {};
    for (std::size_t y = 0; y < rows; ++y) {
      const auto in_y = static_cast<std::int32_t>(y);
      std::fill(std::begin(tile.inner), std::end(tile.inner), ~std::uint32_t{0});
      std::fill(std::begin(tile.any), std::end(tile.any), 0);
      for (std::size_t z = 0; z < deep; z += kTile) {
        const std::size_t slices = std::min(kTile, deep - z);
        HWY_DYNAMIC_DISPATCH(TakeTile)
        (tile_source(y, below + z, first), tile, slices, wide,
         words_.data() + first * column_words_ + y * static_cast<std::size_t>(box_.size[2]) + below + z,
         column_words_, in_slice[z].data());
      }
      std::copy_n(tile.inner, wide, inner.data() + y * columns + first);
      for (std::size_t i = 0; i < wide; ++i)
        united_[(first + i) * column_united_ + y * layers + static_cast<std::size_t>(layer)] = tile.any[i];
      const std::int32_t cell_y = workspace::brick_along(in_y + box_.min.y);
      if (y + 1 < rows && workspace::brick_along(in_y + 1 + box_.min.y) == cell_y) continue;
      Cells::Bits* const here = &cells_.bits[cells_.box.index(
          {cells_.box.min.x + static_cast<std::int32_t>(first), cell_y, cells_.box.min.z + layer})];
      for (std::size_t z = 0; z < deep; ++z) {
        const std::uint32_t bit = std::uint32_t{1} << ((from_z + static_cast<std::int32_t>(z)) & 31);
        for (std::size_t i = 0; i < wide; ++i) here[i].z |= in_slice[z][i] != 0 ? bit : 0;
      }
      in_slice = {};
    }
  }
  finish_cells(layer, to_z - from_z == workspace::kBrickEdge, inner);
}

/// Completes a layer's cells. `inner`: for each y and column, the voxels that are interior in all slices.
void SolidRows::finish_cells(std::int32_t layer, bool whole_along_z,
                             const std::vector<std::uint32_t>& inner) {
  const auto columns = static_cast<std::size_t>(cells_.box.size[0]);
  for (std::int32_t y = box_.min.y; y < box_.min.y + box_.size[1]; ++y) {
    const auto row = static_cast<std::size_t>(y - box_.min.y);
    const std::int32_t cell_y = workspace::brick_along(y), from_y = cell_y * workspace::kBrickEdge;
    const bool whole =
        whole_along_z && from_y >= box_.min.y && from_y + workspace::kBrickEdge <= box_.min.y + box_.size[1];
    Cells::Bits* const here =
        &cells_.bits[cells_.box.index({cells_.box.min.x, cell_y, cells_.box.min.z + layer})];
    for (std::size_t i = 0; i < columns; ++i) {
      const std::uint32_t any =
          united_[i * column_united_ + row * static_cast<std::size_t>(cells_.box.size[2]) +
                  static_cast<std::size_t>(layer)];
      here[i].x |= any;
      here[i].y |= any != 0 ? std::uint32_t{1} << (y & 31) : 0;
      here[i].interior =
          whole && (y == from_y || here[i].interior) && inner[row * columns + i] == ~std::uint32_t{0};
    }
  }
}

}  // namespace phantom::layers::detail
#endif  // HWY_ONCE
