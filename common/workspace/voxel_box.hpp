#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "common/workspace/grid.hpp"
#include "common/workspace/large_pages.hpp"

namespace phantom::workspace {

/// A box of voxels: [min, min + size). May reach beyond the grid.
struct VoxelBox {
  Index3 min;
  std::array<std::int32_t, 3> size{0, 0, 0};

  bool empty() const { return size[0] <= 0 || size[1] <= 0 || size[2] <= 0; }
  std::size_t voxel_count() const {
    return empty() ? 0
                   : static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                         static_cast<std::size_t>(size[2]);
  }
  /// Returns the box enlarged by `margin` voxels on each side.
  VoxelBox grown(std::int32_t margin) const {
    return {{min.x - margin, min.y - margin, min.z - margin},
            {size[0] + 2 * margin, size[1] + 2 * margin, size[2] + 2 * margin}};
  }
  /// Returns the part that both boxes share; empty if there is none.
  VoxelBox intersection(const VoxelBox& other) const {
    VoxelBox shared;
    const auto axis = [](std::int32_t a, std::int32_t a_size, std::int32_t b, std::int32_t b_size,
                         std::int32_t& from, std::int32_t& count) {
      from = std::max(a, b);
      count = std::max(0, std::min(a + a_size, b + b_size) - from);
    };
    axis(min.x, size[0], other.min.x, other.size[0], shared.min.x, shared.size[0]);
    axis(min.y, size[1], other.min.y, other.size[1], shared.min.y, shared.size[1]);
    axis(min.z, size[2], other.min.z, other.size[2], shared.min.z, shared.size[2]);
    return shared;
  }
  /// Returns the smallest box that holds both; an empty box adds nothing.
  VoxelBox hull(const VoxelBox& other) const {
    if (empty()) return other;
    if (other.empty()) return *this;
    VoxelBox both;
    const auto axis = [](std::int32_t a, std::int32_t a_size, std::int32_t b, std::int32_t b_size,
                         std::int32_t& from, std::int32_t& count) {
      from = std::min(a, b);
      count = std::max(a + a_size, b + b_size) - from;
    };
    axis(min.x, size[0], other.min.x, other.size[0], both.min.x, both.size[0]);
    axis(min.y, size[1], other.min.y, other.size[1], both.min.y, both.size[1]);
    axis(min.z, size[2], other.min.z, other.size[2], both.min.z, both.size[2]);
    return both;
  }
  static VoxelBox of(const GridSpec& grid) { return {{0, 0, 0}, grid.size_vox}; }
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
  explicit BitVolume(const std::array<std::int32_t, 3>& size)
      : size_(size),
        words_per_row_((static_cast<std::size_t>(size[0]) + 63) / 64),
        words_(words_per_row_ * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]), 0) {}

  /// Returns a volume with undefined bits. The caller must write all of them. This lets each thread touch its
  /// own part of the memory first.
  static BitVolume unwritten(const std::array<std::int32_t, 3>& size) {
    BitVolume volume;
    volume.size_ = size;
    volume.words_per_row_ = (static_cast<std::size_t>(size[0]) + 63) / 64;
    volume.words_.resize(volume.words_per_row_ * static_cast<std::size_t>(size[1]) *
                         static_cast<std::size_t>(size[2]));
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
  void set(std::int32_t x, std::int32_t y, std::int32_t z) {
    row(y, z)[x >> 6] |= std::uint64_t{1} << (x & 63);
  }
  void flip(std::int32_t x, std::int32_t y, std::int32_t z) {
    row(y, z)[x >> 6] ^= std::uint64_t{1} << (x & 63);
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
