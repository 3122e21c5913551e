#pragma once

// Private to this library: shaping elements centred on the voxels of slices of bits.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/workspace/aligned.hpp"
#include "common/workspace/profile.hpp"
#include "common/workspace/voxel_box.hpp"

namespace phantom::layers::detail {

/// One row along x of an element: cells −half…half at dy. Rows are grouped by |dz|. All elements are
/// symmetric along each axis.
struct ElementRow {
  int dy, half;
};
struct Element {
  int m;
  std::vector<std::vector<ElementRow>> rows;  // index: |dz|, 0…m
};
Element element_of(workspace::ShapingElement shape, int m);

/// Number of words of a row that are processed together; rows are padded to multiples of it.
inline constexpr std::size_t kGroup = 8;
using Words = workspace::AlignedVector<std::uint64_t>;

/// A volume of bits that records which of its rows hold any. Most rows are empty, and are skipped.
class MarkedBits {
 public:
  /// Creates a volume of zeros.
  explicit MarkedBits(const std::array<std::int32_t, 3>& size);
  /// Takes existing bits and finds out which rows hold any.
  explicit MarkedBits(workspace::BitVolume bits);

  const workspace::BitVolume& bits() const { return bits_; }
  std::uint64_t* row(std::int32_t y, std::int32_t z) { return bits_.row(y, z); }
  const std::uint64_t* row(std::int32_t y, std::int32_t z) const { return bits_.row(y, z); }
  /// Whether a row holds any bit. Code that writes bits must keep this up to date.
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

/// Every row of a slice widened along x by 0…m voxels on both sides. Rows without bits are 0.
class WidenedSlice {
 public:
  /// Allocates memory for slices of `rows` rows of `words` words.
  WidenedSlice(const Element& element, std::int32_t rows, std::size_t words);

  /// Loads slice z. Returns false if it is empty.
  bool load(const MarkedBits& bits, std::int32_t z);

  int m() const { return m_; }
  /// Calls work(y, words) for the rows y that the element, centred on the slice's voxels, may reach. The
  /// words that it contains there begin at offsets() from `words`.
  template <class Work>
  void for_rows_near(const Work& work) const {
    for (std::size_t y = 0; y < near_.size(); ++y) {
      if (near_[y] != 0) work(y, words_.data() + place(y));
    }
  }
  /// By |dz|: one offset for each row of the element.
  const std::vector<std::vector<std::ptrdiff_t>>& offsets() const { return offsets_; }

 private:
  /// Returns where the widened rows of row y begin in words_.
  std::size_t place(std::size_t y) const { return (y + static_cast<std::size_t>(m_)) * place_words_; }

  int m_;
  std::size_t row_words_, stride_;   // of a row, and from one row to the next
  std::size_t padding_;              // words of 0 before and after every row of rows_
  std::size_t place_words_;          // of m + 1 rows
  std::vector<std::size_t> loaded_;  // rows that hold any bit
  std::vector<std::uint8_t> near_;   // by row
  Words rows_;                       // [row][word], padded
  Words words_;                      // [place][half][word]: all rows, and m more before and after
  std::vector<std::vector<std::ptrdiff_t>> offsets_;  // by |dz|
};

/// What the element, centred on the voxels of slices, contains in the slices around them. Holds as many
/// slices at a time as the element spans, and a few more.
class GrownSlices {
 public:
  /// Allocates memory for 2 m + 1 + `more` slices of `rows` rows of `words` words.
  GrownSlices(int m, std::int32_t more, std::int32_t rows, std::size_t words);

  /// Adds what the element, centred on the voxels of slice z, contains in slices [from, to).
  void add(const WidenedSlice& slice, std::int32_t z, std::int32_t from, std::int32_t to);
  /// Returns a row, or null if nothing was added to it.
  const std::uint64_t* row(std::int32_t y, std::int32_t z) const {
    const std::size_t slot = slot_of(z), at = static_cast<std::size_t>(y);
    return written_[slot * row_count_ + at] == 0 ? nullptr
                                                 : words_.data() + slot * slot_words_ + at * stride_;
  }
  /// Clears slice z to make room for another one.
  void clear(std::int32_t z);

 private:
  std::size_t slot_of(std::int32_t z) const { return static_cast<std::size_t>(z) % slots_; }

  std::size_t row_count_, stride_, slots_, slot_words_;
  std::vector<std::uint8_t> written_;  // [slot][row]
  Words words_;                        // [slot][row][word]
};

}  // namespace phantom::layers::detail
