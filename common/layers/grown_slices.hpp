#pragma once

// Private to this library: shaping elements centred on the voxels of slices of bits.

#include <hwy/aligned_allocator.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/workspace/profile.hpp"
#include "common/workspace/voxel_box.hpp"

namespace phantom::layers::detail {

/// An element as rows along x: cells −half…half at dy, by |dz|. All elements are the same both ways along
/// each axis.
struct ElementRow {
  int dy, half;
};
struct Element {
  int m;
  std::vector<std::vector<ElementRow>> rows;  // index: |dz|, 0…m
};
Element element_of(workspace::ShapingElement shape, int m);

/// Words of a row that are worked on together: rows are padded to them.
inline constexpr std::size_t kGroup = 8;
using Words = hwy::AlignedFreeUniquePtr<std::uint64_t[]>;

/// Bits, and which of their rows hold any: most hold nothing, and are not looked at.
class MarkedBits {
 public:
  /// All 0.
  explicit MarkedBits(const std::array<std::int32_t, 3>& size);
  /// The same bits; finds out which rows hold any.
  explicit MarkedBits(workspace::BitVolume bits);

  const workspace::BitVolume& bits() const { return bits_; }
  std::uint64_t* row(std::int32_t y, std::int32_t z) { return bits_.row(y, z); }
  const std::uint64_t* row(std::int32_t y, std::int32_t z) const { return bits_.row(y, z); }
  /// Whether a row holds any. Who writes bits keeps it so.
  std::uint8_t& any(std::int32_t y, std::int32_t z) { return any_[index(y, z)]; }
  bool any(std::int32_t y, std::int32_t z) const { return any_[index(y, z)] != 0; }

 private:
  std::size_t index(std::int32_t y, std::int32_t z) const {
    return static_cast<std::size_t>(z) * static_cast<std::size_t>(bits_.size()[1]) +
           static_cast<std::size_t>(y);
  }
  workspace::BitVolume bits_;
  std::vector<std::uint8_t> any_;
};

/// Every row of a slice widened along x by 0…m voxels on both sides; rows that hold nothing are 0.
class WidenedSlice {
 public:
  /// For slices of `rows` rows of `words` words.
  WidenedSlice(const Element& element, std::int32_t rows, std::size_t words);

  /// False if the slice is empty.
  bool load(const MarkedBits& bits, std::int32_t z);

  int m() const { return m_; }
  /// Calls work(y, words) for the rows y that the element, centred on the slice's voxels, may reach. What it
  /// holds there are the words that begin at offsets() from `words`.
  template <class Work>
  void for_rows_near(const Work& work) const {
    for (std::size_t y = 0; y < near_.size(); ++y) {
      if (near_[y] != 0) work(y, place(y));
    }
  }
  /// By |dz|: one offset for every row of the element.
  const std::vector<std::vector<std::ptrdiff_t>>& offsets() const { return offsets_; }

 private:
  std::uint64_t* place(std::size_t y) const {
    return words_.get() + (y + static_cast<std::size_t>(m_)) * place_words_;
  }

  int m_;
  std::size_t row_words_, stride_;   // of a row, and from one to the next
  std::size_t padding_;              // words of 0 before and behind every row of rows_
  std::size_t place_words_;          // of m + 1 rows
  std::vector<std::size_t> loaded_;  // rows that hold any
  std::vector<std::uint8_t> near_;   // by row
  Words rows_;                       // [row][word], padded
  Words words_;                      // [place][half][word]: rows, and m more before and behind
  std::vector<std::vector<std::ptrdiff_t>> offsets_;  // by |dz|
};

/// What the element, centred on the voxels of slices, holds of the slices around: of as many at a time as it
/// spans, and a few more.
class GrownSlices {
 public:
  /// For 2 m + 1 + `more` slices of `rows` rows of `words` words.
  GrownSlices(int m, std::int32_t more, std::int32_t rows, std::size_t words);

  /// Adds what the element, centred on the voxels of slice z, holds of slices [from, to).
  void add(const WidenedSlice& slice, std::int32_t z, std::int32_t from, std::int32_t to);
  /// A row; null if nothing was added.
  const std::uint64_t* row(std::int32_t y, std::int32_t z) const {
    const std::size_t slot = slot_of(z), at = static_cast<std::size_t>(y);
    return written_[slot * row_count_ + at] == 0 ? nullptr : words_.get() + slot * slot_words_ + at * stride_;
  }
  /// Makes room for another slice.
  void clear(std::int32_t z);

 private:
  std::size_t slot_of(std::int32_t z) const { return static_cast<std::size_t>(z) % slots_; }

  std::size_t row_count_, stride_, slots_, slot_words_;
  std::vector<std::uint8_t> written_;  // [slot][row]
  Words words_;                        // [slot][row][word]
};

}  // namespace phantom::layers::detail
