#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "common/workspace/grid.hpp"
#include "common/workspace/large_pages.hpp"

namespace phantom::workspace {

/// A box of voxels (or of bricks): [min, min + size). May reach beyond the grid.
struct VoxelBox {
  Index3 min;
  std::array<std::int32_t, 3> size{0, 0, 0};

  /// Returns the box [first, end).
  static constexpr VoxelBox between(Index3 first, Index3 end) {
    return {first, {end.x - first.x, end.y - first.y, end.z - first.z}};
  }
  static VoxelBox of(const GridSpec& grid) { return {{0, 0, 0}, grid.size_vox}; }

  constexpr Index3 end() const { return min + Index3{size[0], size[1], size[2]}; }
  constexpr bool empty() const { return size[0] <= 0 || size[1] <= 0 || size[2] <= 0; }
  std::size_t voxel_count() const {
    return empty() ? 0
                   : static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                         static_cast<std::size_t>(size[2]);
  }
  constexpr bool contains(Index3 v) const {
    const Index3 in = v - min;
    return in.x >= 0 && in.y >= 0 && in.z >= 0 && in.x < size[0] && in.y < size[1] && in.z < size[2];
  }
  constexpr bool contains(const VoxelBox& other) const {
    return contains(other.min) && contains(other.end() - Index3{1, 1, 1});
  }
  /// Returns the place of an address of the box, x fastest.
  std::size_t index(Index3 v) const {
    const Index3 in = v - min;
    return (static_cast<std::size_t>(in.z) * static_cast<std::size_t>(size[1]) +
            static_cast<std::size_t>(in.y)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(in.x);
  }
  /// Returns the box enlarged by `margin` voxels on each side.
  constexpr VoxelBox grown(std::int32_t margin) const {
    const Index3 by{margin, margin, margin};
    return between(min - by, end() + by);
  }
  /// Returns the part that both boxes share; empty if there is none.
  constexpr VoxelBox intersection(const VoxelBox& other) const {
    const Index3 first = workspace::max(min, other.min);
    return between(first, workspace::max(first, workspace::min(end(), other.end())));
  }
  /// Returns the smallest box that holds both; an empty box adds nothing.
  constexpr VoxelBox hull(const VoxelBox& other) const {
    if (empty()) return other;
    if (other.empty()) return *this;
    return between(workspace::min(min, other.min), workspace::max(end(), other.end()));
  }
  /// Calls visit(address) for every address of the box, x fastest.
  template <class Visit>
  void for_each(const Visit& visit) const {
    const Index3 last = end();
    for (std::int32_t z = min.z; z < last.z; ++z) {
      for (std::int32_t y = min.y; y < last.y; ++y) {
        for (std::int32_t x = min.x; x < last.x; ++x) visit(Index3{x, y, z});
      }
    }
  }
};

/// Counts the bits set in `a`, and those set in `b` but not in `a`; `count` words each.
struct BitCounts {
  std::size_t a = 0, only_b = 0;
};
BitCounts count_bits(const std::uint64_t* a, const std::uint64_t* b, std::size_t count);

/// Holds one bit per voxel of a box, as rows along x with 64 voxels per word, then y, then z. Bits past a
/// row's end are 0.
class BitVolume {
 public:
  BitVolume() = default;
  explicit BitVolume(const std::array<std::int32_t, 3>& size) : BitVolume(unwritten(size)) {
    std::fill(words_.begin(), words_.end(), 0);
  }
  /// Returns a volume with undefined bits. The caller must write all of them. This lets each thread touch its
  /// own part of the memory first.
  static BitVolume unwritten(const std::array<std::int32_t, 3>& size) {
    BitVolume volume;
    volume.size_ = size;
    volume.words_per_row_ = (static_cast<std::size_t>(size[0]) + 63) / 64;
    volume.words_.resize(volume.row_index(0, size[2]));
    return volume;
  }

  const std::array<std::int32_t, 3>& size() const { return size_; }
  std::size_t words_per_row() const { return words_per_row_; }
  std::uint64_t* row(std::int32_t y, std::int32_t z) { return words_.data() + row_index(y, z); }
  const std::uint64_t* row(std::int32_t y, std::int32_t z) const { return words_.data() + row_index(y, z); }
  LargeVector<std::uint64_t>& words() { return words_; }
  const LargeVector<std::uint64_t>& words() const { return words_; }

  bool get(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return (row(y, z)[x >> 6] >> (x & 63) & 1) != 0;
  }
  bool get(Index3 v) const { return get(v.x, v.y, v.z); }
  void set(std::int32_t x, std::int32_t y, std::int32_t z) {
    row(y, z)[x >> 6] |= std::uint64_t{1} << (x & 63);
  }
  void flip(std::int32_t x, std::int32_t y, std::int32_t z) {
    row(y, z)[x >> 6] ^= std::uint64_t{1} << (x & 63);
  }
  /// Sets the bits [first, end) of a row, of which there is at least one.
  void set_run(std::int32_t y, std::int32_t z, std::int32_t first, std::int32_t end) {
    std::uint64_t* const from = row(y, z) + (first >> 6);
    std::uint64_t* const to = row(y, z) + ((end - 1) >> 6);
    const std::uint64_t head = ~std::uint64_t{0} << (first & 63),
                        tail = ~std::uint64_t{0} >> (63 - ((end - 1) & 63));
    *from |= from == to ? head & tail : head;
    if (from == to) return;
    std::fill(from + 1, to, ~std::uint64_t{0});
    *to |= tail;
  }
  /// Returns the number of bits set.
  std::size_t count() const { return count_bits(words_.data(), words_.data(), words_.size()).a; }

 private:
  std::size_t row_index(std::int32_t y, std::int32_t z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(y)) *
           words_per_row_;
  }
  std::array<std::int32_t, 3> size_{0, 0, 0};
  std::size_t words_per_row_ = 0;
  LargeVector<std::uint64_t> words_;
};

}  // namespace phantom::workspace
