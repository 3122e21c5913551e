#include "common/voxel/solid_rows.hpp"

#include <hwy/cache_control.h>

#include <algorithm>
#include <array>

#include "common/core/parallel.hpp"

namespace phantom::voxel::detail {
namespace {

constexpr std::int32_t brick_of(std::int32_t voxel) { return voxel >> 5; }  // rounds down, below 0 too
static_assert(kBrickEdge == 32);

constexpr std::size_t kTile = 16;  // columns and slices: a cache line of either

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

/// Up to kTile words of a row, from a column on: what is solid, and what is interior.
struct SolidRows::RowPart {
  std::array<std::uint32_t, kTile> solid, inner;
};

void SolidRows::take_row(std::int32_t in_y, std::int32_t in_z, std::size_t first_column,
                         RowPart& part) const {
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
    part.solid[i] = static_cast<std::uint32_t>(solid);
    part.solid[i + 1] = static_cast<std::uint32_t>(solid >> 32);
    part.inner[i] = static_cast<std::uint32_t>(inner);
    part.inner[i + 1] = static_cast<std::uint32_t>(inner >> 32);
  }
}

/// Takes a layer of bricks, in tiles of columns and slices of one y.
void SolidRows::take_layer(std::int32_t layer) {
  const std::int32_t from_z = std::max(box_.min.z, (cells_.min.z + layer) * kBrickEdge);
  const std::int32_t to_z = std::min(box_.min.z + box_.size[2], (cells_.min.z + layer + 1) * kBrickEdge);
  const auto columns = static_cast<std::size_t>(cells_.size[0]),
             rows = static_cast<std::size_t>(box_.size[1]);
  std::vector<std::uint32_t> inner(rows * columns, ~std::uint32_t{0});
  for (std::size_t first = 0; first < columns; first += kTile) {
    const std::size_t wide = std::min(kTile, columns - first);
    for (std::size_t y = 0; y < rows; ++y) {
      const auto in_y = static_cast<std::int32_t>(y);
      Cells::Bits* const here = &cells_.bits[cells_.index(static_cast<std::int32_t>(first),
                                                          brick_of(in_y + box_.min.y) - cells_.min.y, layer)];
      std::array<std::uint32_t, kTile> any{};
      for (std::int32_t z = from_z; z < to_z; z += static_cast<std::int32_t>(kTile)) {
        const std::size_t deep = std::min(kTile, static_cast<std::size_t>(to_z - z));
        std::array<RowPart, kTile> tile;
        for (std::size_t k = 0; k < deep; ++k) {
          take_row(in_y, z - box_.min.z + static_cast<std::int32_t>(k), first, tile[k]);
          for (std::size_t i = 0; i < kTile; ++i) any[i] |= tile[k].solid[i];
          for (std::size_t i = 0; i < wide; ++i) inner[y * columns + first + i] &= tile[k].inner[i];
        }
        for (std::size_t i = 0; i < wide; ++i) {
          std::uint32_t* const to = words_.data() + (first + i) * column_words_ +
                                    y * static_cast<std::size_t>(box_.size[2]) +
                                    static_cast<std::size_t>(z - box_.min.z);
          std::uint32_t slices = 0;
          for (std::size_t k = 0; k < deep; ++k) {
            to[k] = tile[k].solid[i];
            slices |= static_cast<std::uint32_t>(to[k] != 0) << k;
          }
          here[i].z |= slices << (z & 31);
        }
      }
      for (std::size_t i = 0; i < wide; ++i)
        united_[(first + i) * column_united_ + y * static_cast<std::size_t>(cells_.size[2]) +
                static_cast<std::size_t>(layer)] = any[i];
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
