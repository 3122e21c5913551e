#include "common/layers/grown_slices.hpp"

#include <algorithm>
#include <cstring>

#include "common/layers/layers.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/layers/grown_slices.cpp"
#include <hwy/foreach_target.h>  // compiled once for each instruction set
// foreach_target.h must come before highway.h.
#include <hwy/highway.h>

#ifndef PHANTOM_LAYERS_GROWN_SLICES_SLOT
#define PHANTOM_LAYERS_GROWN_SLICES_SLOT
namespace phantom::layers::detail {

/// Where to add up a slice; null if it is not wanted.
struct GrownSlot {
  std::uint64_t* words;
  std::uint8_t* written;
};

}  // namespace phantom::layers::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace phantom::layers::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Writes the row widened by 0…m voxels on both sides to wide, wide + stride, … The row must have zeros
/// before and after it, one word more than m voxels fill.
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

/// Adds the element's voxels around row y, which has `words` words, to slots[m + dz], −m ≤ dz ≤ m.
void AddRow(const std::uint64_t* from, const std::vector<std::vector<std::ptrdiff_t>>& offsets,
            const GrownSlot* slots, std::size_t y, std::size_t words) {
  const hn::CappedTag<std::uint64_t, kGroup> d;
  const std::size_t m = offsets.size() - 1;
  for (std::size_t dz = 0; dz <= m; ++dz) {
    const GrownSlot targets[2] = {slots[m + dz], slots[m - dz]};
    if (targets[0].words == nullptr && targets[1].words == nullptr) continue;
    for (std::size_t i = 0; i < words; i += hn::Lanes(d)) {
      auto gathered = hn::Zero(d);
      for (const std::ptrdiff_t offset : offsets[dz])
        gathered = hn::Or(gathered, hn::Load(d, from + offset + i));
      for (const GrownSlot& target : targets) {
        if (target.words == nullptr) continue;
        std::uint64_t* const to = target.words + y * words + i;
        hn::Store(target.written[y] != 0 ? hn::Or(gathered, hn::Load(d, to)) : gathered, d, to);
      }
    }
    for (const GrownSlot& target : targets) {
      if (target.words != nullptr) target.written[y] = 1;
    }
  }
}

}  // namespace phantom::layers::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::layers::detail {

HWY_EXPORT(Widen);
HWY_EXPORT(AddRow);

namespace {

/// Rounds the words of a row up to whole groups.
std::size_t padded(std::size_t words) { return (words + kGroup - 1) / kGroup * kGroup; }

/// Returns the words from one slice to the next. If slices were a power of two apart, a row's words of all
/// slices would compete for the same cache sets and wait for each other's writes.
std::size_t apart(std::size_t slice_words, std::size_t slices) {
  constexpr std::size_t kPage = 4096 / sizeof(std::uint64_t);
  const std::size_t shift = std::max(kGroup, kPage / slices / kGroup * kGroup);
  return (slice_words + kPage - 1) / kPage * kPage + shift;
}

}  // namespace

MarkedBits::MarkedBits(const std::array<std::int32_t, 3>& size)
    : bits_(size), any_(static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2])) {}

MarkedBits::MarkedBits(workspace::BitVolume bits)
    : MarkedBits(std::array<std::int32_t, 3>{0, bits.size()[1], bits.size()[2]}) {
  bits_ = std::move(bits);
  const std::size_t words = bits_.words_per_row();
  for (std::size_t row = 0; row < any_.size(); ++row) {
    const std::uint64_t* const from = bits_.words().data() + row * words;
    any_[row] = std::any_of(from, from + words, [](std::uint64_t word) { return word != 0; }) ? 1 : 0;
  }
}

Element element_of(workspace::ShapingElement shape, int m) {
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
      row_words_(words),
      stride_(padded(words)),
      padding_(padded(static_cast<std::size_t>(m_) / 64 + 2)),
      place_words_((static_cast<std::size_t>(m_) + 1) * stride_),
      near_(static_cast<std::size_t>(rows)),
      rows_(padding_ + near_.size() * (stride_ + padding_)),
      words_((near_.size() + 2 * static_cast<std::size_t>(m_)) * place_words_) {
  for (const std::vector<ElementRow>& cells : element.rows) {
    std::vector<std::ptrdiff_t>& offsets = offsets_.emplace_back();
    for (const ElementRow& cell : cells) {
      offsets.push_back(cell.dy * static_cast<std::ptrdiff_t>(place_words_) +
                        cell.half * static_cast<std::ptrdiff_t>(stride_));
    }
  }
}

bool WidenedSlice::load(const MarkedBits& bits, std::int32_t z) {
  const auto padded_row = [&](std::size_t y) { return rows_.data() + padding_ + y * (stride_ + padding_); };
  for (const std::size_t y : loaded_)
    std::fill_n(words_.begin() + static_cast<std::ptrdiff_t>(place(y)), place_words_, 0);
  loaded_.clear();
  std::fill(near_.begin(), near_.end(), 0);
  const auto m = static_cast<std::size_t>(m_);
  for (std::size_t y = 0; y < near_.size(); ++y) {
    if (!bits.any(static_cast<std::int32_t>(y), z)) continue;
    loaded_.push_back(y);
    std::copy_n(bits.row(static_cast<std::int32_t>(y), z), row_words_, padded_row(y));
    const std::size_t first = y - std::min(y, m), last = std::min(near_.size() - 1, y + m);
    std::memset(&near_[first], 1, last - first + 1);
  }
  // Widening only starts here, so that no row is read while its stores are still pending.
  const auto widen = HWY_DYNAMIC_DISPATCH(Widen);
  for (const std::size_t y : loaded_) {
    std::uint64_t* const wide = words_.data() + place(y);
    widen(padded_row(y), stride_, m_, wide, stride_);
    for (std::size_t half = 1; half <= m; ++half) {
      std::uint64_t* const row = wide + half * stride_;
      std::fill(row + row_words_, row + stride_, 0);
    }
  }
  return !loaded_.empty();
}

GrownSlices::GrownSlices(int m, std::int32_t more, std::int32_t rows, std::size_t words)
    : row_count_(static_cast<std::size_t>(rows)),
      stride_(padded(words)),
      slots_(static_cast<std::size_t>(2 * m + 1 + more)),
      slot_words_(apart(row_count_ * stride_, slots_)),
      written_(slots_ * row_count_),
      words_(slots_ * slot_words_) {}

void GrownSlices::add(const WidenedSlice& slice, std::int32_t z, std::int32_t from, std::int32_t to) {
  const int m = slice.m();
  std::vector<GrownSlot> slots;
  for (std::int32_t to_z = z - m; to_z <= z + m; ++to_z) {
    const std::size_t slot = slot_of(std::max(0, to_z));
    slots.push_back(to_z >= from && to_z < to
                        ? GrownSlot{words_.data() + slot * slot_words_, written_.data() + slot * row_count_}
                        : GrownSlot{nullptr, nullptr});
  }
  const auto add_row = HWY_DYNAMIC_DISPATCH(AddRow);
  slice.for_rows_near([&](std::size_t y, const std::uint64_t* words) {
    add_row(words, slice.offsets(), slots.data(), y, stride_);
  });
}

void GrownSlices::clear(std::int32_t z) {
  std::fill_n(written_.begin() + static_cast<std::ptrdiff_t>(slot_of(z) * row_count_), row_count_, 0);
}

}  // namespace phantom::layers::detail
#endif
