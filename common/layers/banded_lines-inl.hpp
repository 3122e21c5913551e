// Private to banded_distance.cpp, which includes it once for each instruction set (it has no guard): its
// first pass, distances along z in bytes.

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

#include "common/layers/banded_distance.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::layers::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<std::uint8_t> kBytes;
constexpr hn::ScalableTag<std::uint16_t> kShorts;
constexpr std::size_t kPad = kMaxVector;
constexpr std::size_t kMoreOffsets = 3;  // neighbours are read in groups of one more
static_assert(kMoreOffsets < kPad);
static_assert(kPad == 64, "a word of bits");

/// Sizes of one block with its surroundings.
struct Extent {
  Extent(const BrickBlock& block, std::size_t reach_vox)
      : reach(reach_vox),
        halo((reach_vox + workspace::kBrickEdge - 1) / workspace::kBrickEdge * workspace::kBrickEdge),
        nx(static_cast<std::size_t>(block.nx) * workspace::kBrickEdge),
        ny(static_cast<std::size_t>(block.ny) * workspace::kBrickEdge),
        nz(static_cast<std::size_t>(block.nz) * workspace::kBrickEdge),
        rows(ny + 2 * reach),
        used(nx + 2 * halo),
        length((used + kPad - 1) / kPad * kPad),
        width(length + kPad / 2),
        slice(((rows + 2 * kMoreOffsets) * length / kPad | 1) * kPad) {}
  std::size_t reach, halo;  // along x, the surroundings begin at a whole brick
  std::size_t nx, ny, nz;
  std::size_t rows;    // along y, including the reach
  std::size_t used;    // along x, including the halo
  std::size_t length;  // `used` rounded up to whole words and vectors
  // Distance from a row of squares to the next, and from a slice of distances along z to the next. Odd
  // numbers of cache lines keep neighbours from sharing the same few cache sets.
  std::size_t width, slice;
};

/// Returns the first voxel of a row of the block.
workspace::Index3 voxel_of(const BrickBlock& block, std::size_t y, std::size_t z) {
  return {block.min.x, block.min.y + static_cast<std::int32_t>(y),
          block.min.z + static_cast<std::int32_t>(z)};
}

/// Returns where to write the orders of the bricks that a row crosses.
std::int8_t* const* bricks_at(const BrickBlock& block, std::size_t y, std::size_t z) {
  return block.bricks.data() +
         ((z / workspace::kBrickEdge) * static_cast<std::size_t>(block.ny) + y / workspace::kBrickEdge) *
             static_cast<std::size_t>(block.nx);
}

/// The range of neighbour offsets to read, first … last.
struct Offsets {
  int first, last;
};

/// Returns the offsets from the positions of a span that a voxel in `from` … `to` can have within reach.
Offsets offsets_from(const SolidSpan& span, int from, int to, int reach) {
  return {std::max({1, span.first - to, from - span.last}),
          std::min(reach, std::max(to - span.first, span.last - from))};
}

/// Squared distance that means "farther than the reach".
std::uint16_t far_of(std::size_t reach) { return static_cast<std::uint16_t>((reach + 1) * (reach + 1)); }

/// Returns a mask of the solid voxels of a vector, from bit x on.
HWY_INLINE hn::Mask<decltype(kBytes)> solid_at(const std::uint64_t* bits, std::size_t x) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(bits) + x / 8;
  return hn::LoadMaskBits(kBytes, bytes);
}

/// Range of slices for which the solid has words, counted from the first slice of the block's surroundings.
struct Slices {
  std::size_t first, last;
};

/// Joins two columns of 32 voxels to words of 64 bits, one word for each slice. Writes up to one vector more
/// than `count`.
void join_words(const std::uint32_t* low, const std::uint32_t* high, std::size_t count, std::uint64_t* bits) {
  constexpr hn::ScalableTag<std::uint64_t> kWords;
  constexpr hn::Rebind<std::uint32_t, decltype(kWords)> kHalves;
  static_assert(hn::MaxLanes(kWords) <= SolidRows::kReadBeyond);
  for (std::size_t i = 0; i < count; i += hn::Lanes(kWords)) {
    const auto here = hn::PromoteTo(kWords, hn::LoadU(kHalves, low + i)),
               behind = hn::PromoteTo(kWords, hn::LoadU(kHalves, high + i));
    hn::StoreU(hn::Or(here, hn::ShiftLeft<32>(behind)), kWords, bits + i);
  }
}

/// Computes the proximity along z for a vector of lines that begins at bit x of `bits` (one word for each
/// slice of the surroundings), for all slices of the block. If summaries are wanted, calls add_summary(layer
/// of bricks, a bit for each of its slices with something in reach) for each layer.
template <bool kSummariesWanted, class AddSummary>
HWY_INLINE void distances_along_lines(const Extent& e, Slices slices, const std::uint64_t* bits,
                                      std::size_t x, std::uint8_t* out, const AddSummary& add_summary) {
  const std::size_t begin = e.reach, end = e.reach + e.nz;
  const auto one = hn::Set(kBytes, std::uint8_t{1}),
             top = hn::Set(kBytes, static_cast<std::uint8_t>(e.reach + 1));
  auto close = hn::Zero(kBytes);
  const auto step = [&](std::size_t slice) HWY_ATTR {
    close = hn::IfThenElse(solid_at(bits + slice, x), top, hn::SaturatedSub(close, one));
  };
  for (std::size_t slice = slices.first; slice < begin; ++slice) step(slice);
  std::uint8_t* to = out + x;
  for (std::size_t slice = begin; slice < end; ++slice, to += e.slice) {
    step(slice);
    hn::StoreU(close, kBytes, to);
  }
  close = hn::Zero(kBytes);
  for (std::size_t slice = slices.last; slice-- > end;) step(slice);
  for (std::size_t layer = e.nz / workspace::kBrickEdge; layer-- > 0;) {
    std::uint32_t any = 0;
    for (std::size_t slice = begin + (layer + 1) * workspace::kBrickEdge;
         slice-- > begin + layer * workspace::kBrickEdge;) {
      to -= e.slice;
      step(slice);
      const auto nearer = hn::Max(close, hn::LoadU(kBytes, to));
      hn::StoreU(nearer, kBytes, to);
      if constexpr (kSummariesWanted)
        any = any << 1 | (hn::AllTrue(kBytes, hn::Eq(nearer, hn::Zero(kBytes))) ? 0 : 1);
    }
    if constexpr (kSummariesWanted) add_summary(layer, any);
  }
}

/// Computes the proximity along z for row y of the surroundings, which begins at voxel `first`, for all
/// slices of the block. Returns the range along x that may be solid. Calls summaries.add(vector along x, y,
/// layer, slices in reach, words of the layer's slices) for each vector in that range.
constexpr std::int32_t kRowsAhead = 3;
template <class Summaries>
SolidSpan distances_along_z(const Extent& e, BandedDistance& work, workspace::Index3 first, std::size_t y,
                            Summaries& summaries) {
  const SolidRows& solid = work.solid();
  std::uint8_t* const out = work.proximity.data() + (y + kMoreOffsets) * e.length;
  const std::int32_t to_z = first.z + static_cast<std::int32_t>(e.nz + 2 * e.reach);
  const SolidRows::Lines lines = solid.lines(first.y, first.z, to_z);
  const SolidRows::Lines later = solid.lines(first.y + kRowsAhead, first.z, to_z);
  const Slices slices{static_cast<std::size_t>(lines.first - first.z),
                      static_cast<std::size_t>(lines.last - first.z)};
  const std::size_t end = e.nz + 2 * e.reach;
  work.solid_bits.assign(end + kPad, 0);
  std::uint64_t* const bits = work.solid_bits.data();
  SolidSpan span;
  const auto clear = [&](std::size_t x) {
    for (std::size_t slice = 0; slice < e.nz; ++slice) std::memset(out + slice * e.slice + x, 0, kPad);
  };
  for (std::size_t part = 0; part < e.length; part += kPad) {
    const std::int32_t column = (first.x + static_cast<std::int32_t>(part)) / workspace::kBrickEdge;
    if (later.layers != 0) {
      solid.prefetch(later, column);
      solid.prefetch(later, column + 1);
    }
    const std::uint64_t any = lines.layers == 0 ? 0
                                                : solid.united(lines, column) |
                                                      std::uint64_t{solid.united(lines, column + 1)} << 32;
    if (any == 0) {
      clear(part);
      continue;
    }
    const int x = static_cast<int>(part);
    span.add({x + std::countr_zero(any), x + 63 - std::countl_zero(any)});
    join_words(solid.words(lines, column), solid.words(lines, column + 1), slices.last - slices.first,
               bits + slices.first);
    std::fill(bits + slices.last, bits + end, 0);
    for (std::size_t i = 0; i < kPad; i += hn::Lanes(kBytes)) {
      distances_along_lines<Summaries::kWanted>(
          e, slices, bits, i, out + part, [&](std::size_t layer, std::uint32_t in_reach) HWY_ATTR {
            summaries.add(part / kPad, y, layer, in_reach, bits + e.reach + layer * workspace::kBrickEdge);
          });
    }
  }
  return span;
}

}  // namespace phantom::layers::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
