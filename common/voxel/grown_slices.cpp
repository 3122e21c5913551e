#include "common/voxel/grown_slices.hpp"

#include <algorithm>
#include <functional>
#include <new>
#include <numeric>

#include "common/voxel/dilation.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/voxel/grown_slices.cpp"
#include <hwy/foreach_target.h>  // once per instruction set
// (keep this order)
#include <hwy/highway.h>

#ifndef PHANTOM_VOXEL_GROWN_SLICES_SLOT
#define PHANTOM_VOXEL_GROWN_SLICES_SLOT
namespace phantom::voxel::detail {

/// Where a slice is gathered; null if it is not wanted.
struct GrownSlot {
  std::uint64_t* words;
  std::uint8_t* written;
};

}  // namespace phantom::voxel::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace phantom::voxel::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Writes the row widened by 0…m voxels on both sides to wide, wide + stride, … Before and behind the row are
/// zeros, one word more than m voxels fill.
void Widen(const std::uint64_t* row, std::size_t words, int m, std::uint64_t* wide, std::size_t stride) {
  const hn::CappedTag<std::uint64_t, kGroup> d;
  for (std::size_t i = 0; i < words; i += hn::Lanes(d)) {
    auto all = hn::Load(d, row + i);
    hn::Store(all, d, wide + i);
    for (int half = 1; half <= m; ++half) {
      const std::uint64_t* const here = row + i;
      const int far = half / 64, bits = half % 64;
      if (bits == 0) {
        all = hn::Or(all, hn::Or(hn::LoadU(d, here - far), hn::LoadU(d, here + far)));
      } else {
        const auto up = hn::Or(hn::ShiftLeftSame(hn::LoadU(d, here - far), bits),
                               hn::ShiftRightSame(hn::LoadU(d, here - far - 1), 64 - bits));
        const auto down = hn::Or(hn::ShiftRightSame(hn::LoadU(d, here + far), bits),
                                 hn::ShiftLeftSame(hn::LoadU(d, here + far + 1), 64 - bits));
        all = hn::Or(all, hn::Or(up, down));
      }
      hn::Store(all, d, wide + static_cast<std::size_t>(half) * stride + i);
    }
  }
}

/// Adds a group of what the element holds to slots[m + dz], −m ≤ dz ≤ m.
void AddGroup(const std::uint64_t* from, const std::vector<std::vector<std::ptrdiff_t>>& offsets,
              const GrownSlot* slots, std::size_t group) {
  const hn::CappedTag<std::uint64_t, kGroup> d;
  const std::size_t m = offsets.size() - 1;
  for (std::size_t dz = 0; dz <= m; ++dz) {
    const GrownSlot targets[2] = {slots[m + dz], slots[m - dz]};
    if (targets[0].words == nullptr && targets[1].words == nullptr) continue;
    for (std::size_t part = 0; part < kGroup; part += hn::Lanes(d)) {
      auto gathered = hn::Zero(d);
      for (const std::ptrdiff_t offset : offsets[dz])
        gathered = hn::Or(gathered, hn::Load(d, from + offset + part));
      for (const GrownSlot& target : targets) {
        if (target.words == nullptr) continue;
        std::uint64_t* const to = target.words + group * kGroup + part;
        hn::Store(target.written[group] != 0 ? hn::Or(gathered, hn::Load(d, to)) : gathered, d, to);
      }
    }
    for (const GrownSlot& target : targets) {
      if (target.words != nullptr) target.written[group] = 1;
    }
  }
}

}  // namespace phantom::voxel::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::voxel::detail {

HWY_EXPORT(Widen);
HWY_EXPORT(AddGroup);

namespace {

constexpr std::size_t kWord = 64;

std::size_t groups_of(std::size_t words) { return (words + kGroup - 1) / kGroup; }

/// Words from one slice to the next. Slices a power of two apart would have each row's words of all slices
/// compete for the same places of the processor's caches, and wait for one another's writes.
std::size_t apart(std::size_t slice_words, std::size_t slices) {
  constexpr std::size_t kPage = 4096 / sizeof(std::uint64_t);
  const std::size_t shift = std::max(kGroup, kPage / slices / kGroup * kGroup);
  return (slice_words + kPage - 1) / kPage * kPage + shift;
}

Words aligned_words(std::size_t count) {
  Words words = hwy::AllocateAligned<std::uint64_t>(count);
  if (!words) throw std::bad_alloc();
  return words;
}

}  // namespace

MarkedBits::MarkedBits(const std::array<std::int32_t, 3>& size)
    : bits_(size),
      groups_(groups_of(bits_.words_per_row())),
      marks_(groups_ * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2])) {}

MarkedBits::MarkedBits(BitVolume bits) : bits_(std::move(bits)), groups_(groups_of(bits_.words_per_row())) {
  const std::size_t words = bits_.words_per_row();
  for (std::size_t row = 0; row < bits_.words().size(); row += words) {
    for (std::size_t first = 0; first < words; first += kGroup) {
      const std::uint64_t* const from = bits_.words().data() + row + first;
      const std::size_t count = std::min(kGroup, words - first);
      const std::uint64_t any = std::accumulate(from, from + count, std::uint64_t{0}, std::bit_or<>());
      marks_.push_back(mark_of(any, from[0], from[count - 1]));
    }
  }
}

Element element_of(ShapingElement shape, int m) {
  Element element{m, std::vector<std::vector<ElementRow>>(static_cast<std::size_t>(m) + 1)};
  for (int dz = 0; dz <= m; ++dz) {
    for (int dy = -m; dy <= m; ++dy) {
      int half = m;
      while (half >= 0 && !in_element(shape, m, half, dy, dz)) --half;
      if (half >= 0) element.rows[static_cast<std::size_t>(dz)].push_back({dy, half});
    }
  }
  return element;
}

WidenedSlice::WidenedSlice(const Element& element, std::int32_t rows, std::size_t words)
    : m_(element.m),
      row_count_(static_cast<std::size_t>(rows)),
      row_words_(words),
      groups_(groups_of(words)),
      padding_(groups_of(static_cast<std::size_t>(m_) / kWord + 2) * kGroup),
      place_words_((static_cast<std::size_t>(m_) + 1) * groups_ * kGroup),
      flag_words_((row_count_ + 4 * static_cast<std::size_t>(m_)) / kWord + 1),
      any_(groups_ * flag_words_),
      in_first_(groups_ * flag_words_),
      in_last_(groups_ * flag_words_),
      near_(groups_ * flag_words_),
      any_row_(flag_words_),
      asked_(flag_words_),
      rows_(aligned_words(padding_ + row_count_ * row_stride())),
      words_(aligned_words(flag_words_ * kWord * place_words_)) {
  std::fill_n(rows_.get(), padding_ + row_count_ * row_stride(), 0);
  for (const std::vector<ElementRow>& cells : element.rows) {
    std::vector<std::ptrdiff_t>& offsets = offsets_.emplace_back();
    for (const ElementRow& cell : cells) {
      offsets.push_back(cell.dy * static_cast<std::ptrdiff_t>(place_words_) +
                        cell.half * static_cast<std::ptrdiff_t>(groups_ * kGroup));
    }
  }
}

bool WidenedSlice::find_any(const MarkedBits& bits, std::int32_t z) {
  for (Flags* flags : {&any_, &in_first_, &in_last_, &any_row_}) std::fill(flags->begin(), flags->end(), 0);
  const GroupMark* mark = bits.marks(0, z);
  GroupMark all = 0;
  for (std::size_t place = 2 * static_cast<std::size_t>(m_);
       place < row_count_ + 2 * static_cast<std::size_t>(m_); ++place) {
    for (std::size_t group = 0; group < groups_; ++group, ++mark) {
      if (*mark == 0) continue;
      const std::size_t at = group * flag_words_ + place / kWord;
      const std::uint64_t flag = std::uint64_t{1} << (place % kWord);
      any_[at] |= flag;
      in_first_[at] |= (*mark & kInFirstWord) != 0 ? flag : 0;
      in_last_[at] |= (*mark & kInLastWord) != 0 ? flag : 0;
      any_row_[place / kWord] |= flag;
      all |= *mark;
    }
  }
  return all != 0;
}

/// Sets what is at most m places from what is set.
void WidenedSlice::reach_rows_around(std::uint64_t* flags) {
  for (int i = 0; i < m_; ++i) {
    std::uint64_t before = 0;
    for (std::size_t k = 0; k < flag_words_; ++k) {
      const std::uint64_t here = flags[k], behind = k + 1 < flag_words_ ? flags[k + 1] : 0;
      flags[k] = here | here << 1 | here >> 1 | before >> (kWord - 1) | behind << (kWord - 1);
      before = here;
    }
  }
}

/// Along x within whole words or, for long elements, groups; along y within the element's rows.
void WidenedSlice::find_near() {
  const auto reach_voxels = static_cast<std::size_t>(m_);
  const std::size_t reach =
      reach_voxels <= kWord ? 0 : (reach_voxels + kGroup * kWord - 1) / (kGroup * kWord);
  std::fill(near_.begin(), near_.end(), 0);
  std::fill(asked_.begin(), asked_.end(), 0);
  for (std::size_t group = 0; group < groups_; ++group) {
    std::uint64_t* const near = near_.data() + group * flag_words_;
    for (std::size_t from = group - std::min(group, reach); from <= std::min(groups_ - 1, group + reach);
         ++from) {
      for (std::size_t i = 0; i < flag_words_; ++i) near[i] |= any_[from * flag_words_ + i];
    }
    for (std::size_t i = 0; i < flag_words_; ++i) {
      if (group > 0) near[i] |= in_last_[(group - 1) * flag_words_ + i];
      if (group + 1 < groups_) near[i] |= in_first_[(group + 1) * flag_words_ + i];
    }
    reach_rows_around(near);
    for (std::size_t i = 0; i < flag_words_; ++i) asked_[i] |= near[i];
  }
  reach_rows_around(asked_.data());
}

bool WidenedSlice::load(const MarkedBits& bits, std::int32_t z) {
  if (!find_any(bits, z)) return false;
  find_near();
  const std::size_t before = 2 * static_cast<std::size_t>(m_);
  const auto padded = [&](std::size_t place) {
    return rows_.get() + padding_ + (place - before) * row_stride();
  };
  for_bits(any_row_.data(), [&](std::size_t place) {
    std::copy_n(bits.row(static_cast<std::int32_t>(place - before), z), row_words_, padded(place));
  });
  // Only now, so that no row is read while it is on its way to memory.
  const auto widen = HWY_DYNAMIC_DISPATCH(Widen);
  const std::size_t stride = groups_ * kGroup;
  for_bits(asked_.data(), [&](std::size_t place) {
    std::uint64_t* const wide = words_.get() + place * place_words_;
    if ((any_row_[place / kWord] >> (place % kWord) & 1) == 0) {
      std::fill_n(wide, place_words_, 0);
      return;
    }
    widen(padded(place), stride, m_, wide, stride);
    for (int half = 1; half <= m_; ++half) {
      std::uint64_t* const row = wide + static_cast<std::size_t>(half) * stride;
      std::fill(row + row_words_, row + stride, 0);
    }
  });
  return true;
}

GrownSlices::GrownSlices(int m, std::int32_t more, std::int32_t rows, std::size_t words)
    : row_count_(static_cast<std::size_t>(rows)),
      groups_(groups_of(words)),
      slots_(static_cast<std::size_t>(2 * m + 1 + more)),
      slot_words_(apart(row_count_ * groups_ * kGroup, slots_)),
      written_(slots_ * row_count_ * groups_),
      words_(aligned_words(slots_ * slot_words_)) {}

void GrownSlices::add(const WidenedSlice& slice, std::int32_t z, std::int32_t from, std::int32_t to) {
  const int m = slice.m();
  std::vector<GrownSlot> slots;
  for (std::int32_t to_z = z - m; to_z <= z + m; ++to_z) {
    const std::size_t slot = slot_of(std::max(0, to_z));
    slots.push_back(to_z >= from && to_z < to ? GrownSlot{words_.get() + slot * slot_words_,
                                                          written_.data() + slot * row_count_ * groups_}
                                              : GrownSlot{nullptr, nullptr});
  }
  const auto add_group = HWY_DYNAMIC_DISPATCH(AddGroup);
  for (std::size_t group = 0; group < groups_; ++group) {
    slice.for_rows_near(group, [&](std::size_t y, const std::uint64_t* words) {
      add_group(words, slice.offsets(), slots.data(), y * groups_ + group);
    });
  }
}

void GrownSlices::clear(std::int32_t z) {
  const auto first = written_.begin() + static_cast<std::ptrdiff_t>(slot_of(z) * row_count_ * groups_);
  std::fill(first, first + static_cast<std::ptrdiff_t>(row_count_ * groups_), 0);
}

}  // namespace phantom::voxel::detail
#endif
