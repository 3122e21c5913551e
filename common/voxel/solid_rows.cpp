#include "common/voxel/solid_rows.hpp"

#include "common/core/parallel.hpp"

namespace phantom::voxel::detail {
namespace {

constexpr std::int32_t brick_of(std::int32_t voxel) { return voxel >> 5; }  // rounds down, below 0 too
static_assert(kBrickEdge == 32);

/// Words of 32 of a row that begins `shift` (< 32) bits later.
class Shifter {
 public:
  explicit Shifter(int shift) : shift_(shift) {}
  /// The next 64 bits.
  std::uint64_t operator()(std::uint64_t word) {
    const std::uint64_t shifted = word << shift_ | carried_;
    carried_ = shift_ == 0 ? 0 : word >> (64 - shift_);
    return shifted;
  }

 private:
  int shift_;
  std::uint64_t carried_ = 0;
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
      free_(static_cast<std::size_t>(box_.size[2]), 0) {
  words_.resize(static_cast<std::size_t>(cells_.size[0]) * column_words_);
  united_.resize(static_cast<std::size_t>(cells_.size[0]) * column_united_);
  core::parallel_for(threads, static_cast<std::size_t>(cells_.size[2]),
                     [&](std::size_t layer, std::size_t) { take_layer(static_cast<std::int32_t>(layer)); });
}

/// Takes a layer of bricks, slice by slice.
void SolidRows::take_layer(std::int32_t layer) {
  const std::int32_t from_z = std::max(box_.min.z, (cells_.min.z + layer) * kBrickEdge);
  const std::int32_t to_z = std::min(box_.min.z + box_.size[2], (cells_.min.z + layer + 1) * kBrickEdge);
  const std::size_t words = solid_.boundary.words_per_row(),
                    columns = static_cast<std::size_t>(cells_.size[0]),
                    rows = static_cast<std::size_t>(box_.size[1]);
  std::vector<std::uint32_t> inner(rows * columns, ~std::uint32_t{0}), any(rows * columns, 0);
  for (std::int32_t z = from_z; z < to_z; ++z) {
    const std::uint32_t z_bit = std::uint32_t{1} << (z & 31);
    const std::int32_t in_z = z - box_.min.z;
    for (std::size_t y = 0; y < rows; ++y) {
      const auto in_y = static_cast<std::int32_t>(y);
      const std::uint64_t *boundary = solid_.boundary.row(in_y, in_z),
                          *interior = solid_.interior.row(in_y, in_z);
      Shifter boundary_word(box_.min.x & 31), interior_word(box_.min.x & 31);
      Cells::Bits* const here =
          &cells_.bits[cells_.index(0, brick_of(in_y + box_.min.y) - cells_.min.y, layer)];
      std::uint32_t* to =
          words_.data() + y * static_cast<std::size_t>(box_.size[2]) + static_cast<std::size_t>(in_z);
      for (std::size_t i = 0; i < columns; i += 2) {
        const bool more = i / 2 < words;
        const std::uint64_t in = interior_word(more ? interior[i / 2] : 0),
                            all = in | boundary_word(more ? boundary[i / 2] : 0);
        for (std::size_t half = 0; half < 2 && i + half < columns; ++half, to += column_words_) {
          const auto word = static_cast<std::uint32_t>(all >> (32 * half));
          *to = word;
          any[y * columns + i + half] |= word;
          inner[y * columns + i + half] &= static_cast<std::uint32_t>(in >> (32 * half));
          if (word != 0) here[i + half].z |= z_bit;
        }
      }
    }
  }
  for (std::size_t y = 0; y < rows; ++y) {
    for (std::size_t i = 0; i < columns; ++i)
      united_[i * column_united_ + y * static_cast<std::size_t>(cells_.size[2]) +
              static_cast<std::size_t>(layer)] = any[y * columns + i];
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
