#pragma once

// Private to this library: shaping elements centred on the voxels of slices of bits.

#include <hwy/aligned_allocator.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/voxel/profile.hpp"
#include "common/voxel/voxel_box.hpp"

namespace phantom::voxel::detail {

/// An element as rows along x: cells −half…half at dy, by |dz|. All elements are the same both ways along
/// each axis.
struct ElementRow {
  int dy, half;
};
struct Element {
  int m;
  std::vector<std::vector<ElementRow>> rows;  // index: |dz|, 0…m
};
Element element_of(ShapingElement shape, int m);

/// Words of a row that are worked on together.
inline constexpr std::size_t kGroup = 8;
using Words = hwy::AlignedFreeUniquePtr<std::uint64_t[]>;

/// What a group of words holds: kAny, and where it is in the first or last of them.
using GroupMark = std::uint8_t;
inline constexpr GroupMark kAny = 1, kInFirstWord = 2, kInLastWord = 4;
inline GroupMark mark_of(std::uint64_t any, std::uint64_t first_word, std::uint64_t last_word) {
  return static_cast<GroupMark>((any != 0 ? kAny : 0) | (first_word != 0 ? kInFirstWord : 0) |
                                (last_word != 0 ? kInLastWord : 0));
}

/// Bits, and what the groups of a row's words hold.
class MarkedBits {
 public:
  /// All 0.
  explicit MarkedBits(const std::array<std::int32_t, 3>& size);
  /// The same bits; finds out what holds any.
  explicit MarkedBits(BitVolume bits);

  std::uint64_t* row(std::int32_t y, std::int32_t z) { return bits_.row(y, z); }
  const std::uint64_t* row(std::int32_t y, std::int32_t z) const { return bits_.row(y, z); }
  /// By group of a row. Who writes bits keeps them so.
  GroupMark* marks(std::int32_t y, std::int32_t z) { return marks_.data() + mark_index(y, z); }
  const GroupMark* marks(std::int32_t y, std::int32_t z) const { return marks_.data() + mark_index(y, z); }

 private:
  std::size_t mark_index(std::int32_t y, std::int32_t z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(bits_.size()[1]) +
            static_cast<std::size_t>(y)) *
           groups_;
  }
  BitVolume bits_;
  std::size_t groups_;
  std::vector<GroupMark> marks_;
};

/// Every row of a slice widened along x by 0…m voxels on both sides. Rows that hold nothing are looked at
/// only near others, and then hold 0.
class WidenedSlice {
 public:
  /// For slices of `rows` rows of `words` words.
  WidenedSlice(const Element& element, std::int32_t rows, std::size_t words);

  /// False if the slice is empty.
  bool load(const MarkedBits& bits, std::int32_t z);

  int m() const { return m_; }
  /// Calls work(y, words) for the rows y of which the element, centred on the slice's voxels, may reach group
  /// `group`. What it holds there are the words that begin at offsets() from `words`.
  template <class Work>
  void for_rows_near(std::size_t group, const Work& work) const {
    for_bits(near_.data() + group * flag_words_, [&](std::size_t place) {
      const auto y = static_cast<std::ptrdiff_t>(place) - 2 * m_;
      if (y >= 0 && y < static_cast<std::ptrdiff_t>(row_count_))
        work(static_cast<std::size_t>(y), words_.get() + place * place_words_ + group * kGroup);
    });
  }
  /// By |dz|: one offset for every row of the element.
  const std::vector<std::vector<std::ptrdiff_t>>& offsets() const { return offsets_; }

 private:
  using Flags = std::vector<std::uint64_t>;  // [group][a bit for every place]

  template <class Work>
  void for_bits(const std::uint64_t* flags, const Work& work) const {
    for (std::size_t i = 0; i < flag_words_; ++i) {
      for (std::uint64_t left = flags[i]; left != 0; left &= left - 1)
        work(64 * i + static_cast<std::size_t>(std::countr_zero(left)));
    }
  }
  std::size_t row_stride() const { return groups_ * kGroup + padding_; }
  bool find_any(const MarkedBits& bits, std::int32_t z);
  void find_near();
  void reach_rows_around(std::uint64_t* flags);

  int m_;
  std::size_t row_count_, row_words_, groups_;
  std::size_t padding_;      // words of 0 before and behind every row of rows_
  std::size_t place_words_;  // of m + 1 rows
  std::size_t flag_words_;   // of a bit for every place: rows, and 2 m more before and behind
  Flags any_, in_first_, in_last_, near_;
  std::vector<std::uint64_t> any_row_, asked_;        // of all groups; asked_: may be looked at
  Words rows_;                                        // [row][word], padded
  Words words_;                                       // [place][half][word]
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
  /// A group of a row; null if nothing was added.
  const std::uint64_t* group(std::int32_t y, std::int32_t z, std::size_t group) const {
    const std::size_t slot = slot_of(z), at = static_cast<std::size_t>(y) * groups_ + group;
    return written_[slot * row_count_ * groups_ + at] == 0 ? nullptr
                                                           : words_.get() + slot * slot_words_ + at * kGroup;
  }
  /// Makes room for another slice.
  void clear(std::int32_t z);

 private:
  std::size_t slot_of(std::int32_t z) const { return static_cast<std::size_t>(z) % slots_; }

  std::size_t row_count_, groups_, slots_, slot_words_;
  std::vector<std::uint8_t> written_;  // [slot][row][group]
  Words words_;                        // [slot][row][word]
};

}  // namespace phantom::voxel::detail
