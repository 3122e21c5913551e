#include "common/voxel/banded_distance.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <climits>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "common/core/parallel.hpp"
#include "common/voxel/workspace.hpp"

// Compiled once per instruction set; the best one that the machine has is picked when it runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/voxel/banded_distance.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::voxel::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<std::uint8_t> kBytes;
constexpr hn::ScalableTag<std::uint16_t> kShorts;
constexpr std::size_t kPad = kLongestVector;
constexpr std::size_t kMoreOffsets = 3;  // neighbours are looked at in groups
static_assert(kMoreOffsets < kPad);
static_assert(kPad == 64, "a word of bits");
constexpr std::size_t kMostWords = (kMostBricksAlongX * kBrickEdge + 2 * 256) / 64;
using MergedRows = std::array<std::uint64_t, kMostWords + kLongestVector / sizeof(std::uint64_t)>;

/// Sizes of one block with its surroundings.
struct Extent {
  Extent(const BrickBlock& block, std::size_t reach_vox)
      : reach(reach_vox),
        halo((reach_vox + 7) / 8 * 8),
        nx(static_cast<std::size_t>(block.nx) * kBrickEdge),
        ny(static_cast<std::size_t>(block.ny) * kBrickEdge),
        nz(static_cast<std::size_t>(block.nz) * kBrickEdge),
        rows(ny + 2 * reach),
        used(nx + 2 * halo),
        length((used + kPad - 1) / kPad * kPad),
        width(length + kPad / 2),
        slice((rows * length / kPad | 1) * kPad) {}
  std::size_t reach, halo;  // along x what lies around begins at a whole byte of bits
  std::size_t nx, ny, nz;
  std::size_t rows;           // along y, with what lies within reach
  std::size_t used;           // along x, with what lies within reach
  std::size_t length;         // the same in whole words and vectors
  std::size_t width, slice;   // from a row of squares to the next, from a slice of distances along z to the next:
                              // odd numbers of cache lines, so that neighbours do not fall into the same few sets
};

/// How far neighbours are to be looked at: first … last.
struct Offsets {
  int first, last;
};

/// Where there is anything solid along an axis, in places of the block's surroundings.
struct SolidSpan {
  int first = INT_MAX, last = -1;

  void add(int at) {
    first = std::min(first, at);
    last = std::max(last, at);
  }
  /// From which of them a voxel between `from` and `to` can be within reach of something solid.
  Offsets offsets_from(int from, int to, int reach) const {
    return {std::max({1, first - to, from - last}), std::min(reach, std::max(to - first, last - from))};
  }
};

/// Squared distance that stands for "farther than the reach".
std::uint16_t far_of(std::size_t reach) { return static_cast<std::uint16_t>((reach + 1) * (reach + 1)); }

/// The voxels of a vector from bit `x` of a row on that are solid.
HWY_INLINE hn::Mask<decltype(kBytes)> solid_at(const std::uint8_t* bits, std::size_t x) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Ne(hn::Set(kBytes, static_cast<std::uint8_t>(bits[x / 8] >> (x & 7) & 1)), hn::Zero(kBytes));
#else
  return hn::LoadMaskBits(kBytes, bits + x / 8);
#endif
}

/// The block's slices that rows of the solid stand at, counted from the block's first slice within reach.
struct Rows {
  const std::uint8_t* bits;
  std::size_t stride, first, last;
};

/// Bits of all rows in one, in words of 64 along x; what lies behind the row's length says nothing.
void merge_rows(const Extent& e, const Rows& rows, MergedRows& merged) {
  auto* to = reinterpret_cast<std::uint8_t*>(merged.data());
  for (std::size_t i = 0; i < e.length / 8; i += hn::Lanes(kBytes)) {
    auto all = hn::Zero(kBytes);
    const std::uint8_t* bits = rows.bits + i;
    for (std::size_t slice = rows.first; slice < rows.last; ++slice, bits += rows.stride) all = hn::Or(all, hn::LoadU(kBytes, bits));
    hn::StoreU(all, kBytes, to + i);
  }
}

/// Distance along z of a vector of lines, for all slices of the block.
HWY_INLINE void distances_along_lines(const Extent& e, const Rows& rows, std::size_t x, std::uint8_t* out) {
  const std::size_t stride = e.slice, begin = e.reach, end = e.reach + e.nz;
  const auto one = hn::Set(kBytes, std::uint8_t{1}), top = hn::Set(kBytes, static_cast<std::uint8_t>(e.reach + 1));
  const auto close_at = [&](auto close, std::size_t slice) HWY_ATTR {
    close = hn::SaturatedSub(close, one);
    if (slice < rows.first || slice >= rows.last) return close;
    return hn::IfThenElse(solid_at(rows.bits + (slice - rows.first) * rows.stride, x), top, close);
  };
  auto close = hn::Zero(kBytes);
  for (std::size_t slice = rows.first; slice < begin; ++slice) close = close_at(close, slice);
  std::uint8_t* to = out;
  for (std::size_t slice = begin; slice < end; ++slice, to += stride) {
    close = close_at(close, slice);
    hn::StoreU(close, kBytes, to);
  }
  close = hn::Zero(kBytes);
  for (std::size_t slice = rows.last; slice-- > end;) close = close_at(close, slice);
  for (std::size_t slice = end; slice-- > begin;) {
    to -= stride;
    close = close_at(close, slice);
    hn::StoreU(hn::Max(close, hn::LoadU(kBytes, to)), kBytes, to);
  }
}

/// Distance along z of one row, for all slices of the block; false (and nothing written) if all are beyond reach.
bool distances_along_z(const Extent& e, const Rows& rows, SolidSpan& along_x, std::uint8_t* out) {
  bool any = false;
  const auto clear = [&](std::size_t x, std::size_t length) {
    for (std::size_t slice = 0; slice < e.nz; ++slice) std::memset(out + slice * e.slice + x, 0, length);
  };
  MergedRows merged;
  merge_rows(e, rows, merged);
  for (std::size_t part = 0; part < e.length; part += kPad) {
    if (merged[part / 64] != 0) {
      if (!any && part > 0) clear(0, part);
      any = true;
      along_x.add(static_cast<int>(part) + std::countr_zero(merged[part / 64]));
      along_x.add(static_cast<int>(part) + 63 - std::countl_zero(merged[part / 64]));
      for (std::size_t x = part; x < part + kPad; x += hn::Lanes(kBytes)) distances_along_lines(e, rows, x, out + x);
    } else if (any) {
      clear(part, kPad);
    }
  }
  return any;
}

/// Squares of the distances of one slice, for a vector of columns. Returns the least of them.
HWY_INLINE std::uint16_t squares_of_columns(const Extent& e, const BandedDistance& work, const std::uint8_t* closeness, std::uint16_t* squares) {
  const hn::Rebind<std::uint8_t, decltype(kShorts)> half_bytes;
  const auto top = hn::Set(kShorts, static_cast<std::uint16_t>(e.reach + 1));
  auto least = hn::Mul(top, top);
  for (std::size_t y = 0; y < e.rows; ++y, closeness += e.length, squares += e.width) {
    if (work.filled[y] == 0) continue;
    const auto d = hn::Sub(top, hn::PromoteTo(kShorts, hn::LoadU(half_bytes, closeness)));
    const auto square = hn::Mul(d, d);
    hn::StoreU(square, kShorts, squares);
    least = hn::Min(least, square);
  }
  return hn::GetLane(hn::MinOfLanes(kShorts, least));
}

/// The least of centre + 0 and the neighbours at ±k·stride plus k², k in `offsets` and up to kMoreOffsets beyond, which
/// changes nothing. Ends as soon as no farther neighbour can be nearer. Saturation keeps what is too far from wrapping.
/// `squares`: k² as a vector, kLongestVector bytes each.
HWY_INLINE hn::Vec<decltype(kShorts)> nearest(const std::uint16_t* centre, std::ptrdiff_t stride, Offsets offsets, const std::uint16_t* squares) {
  constexpr std::size_t kStep = kLongestVector / sizeof(std::uint16_t);
  auto best = hn::LoadU(kShorts, centre);
  const std::uint16_t *before = centre - offsets.first * stride, *behind = centre + offsets.first * stride;
  squares += static_cast<std::size_t>(offsets.first) * kStep;
  const auto step = [&](auto so_far, auto square) HWY_ATTR {
    const auto nearer = hn::Min(hn::LoadU(kShorts, before), hn::LoadU(kShorts, behind));
    before -= stride;
    behind += stride;
    squares += kStep;
    return hn::Min(so_far, hn::SaturatedAdd(nearer, square));
  };
  for (int k = offsets.first; k <= offsets.last; k += static_cast<int>(kMoreOffsets) + 1) {
    const auto square = hn::LoadU(kShorts, squares);
    if (hn::AllTrue(kShorts, hn::Eq(best, hn::Min(best, square)))) break;
    best = step(best, square);
    for (std::size_t more = 0; more < kMoreOffsets; ++more) best = step(best, hn::LoadU(kShorts, squares));
  }
  return best;
}

/// Squared distances of row y in the plane y, z; false if all are out of the band.
bool distances_along_y(const Extent& e, BandedDistance& work, SolidSpan along_y, std::size_t y) {
  const auto stride = static_cast<std::ptrdiff_t>(e.width);
  const std::uint16_t* row = work.squares.data() + (y + e.reach + kMoreOffsets) * e.width;
  std::uint16_t* line = work.line.data() + kPad;
  const int at = static_cast<int>(y + e.reach);
  const auto far = hn::Set(kShorts, far_of(e.reach));
  auto least = far;
  for (std::size_t x = 0, i = 0; x < e.used; x += hn::Lanes(kShorts), ++i) {
    const Offsets offsets = along_y.offsets_from(at, at, work.reach_for[work.least_in_slice[i]]);
    const auto best = nearest(row + x, stride, offsets, work.k_squares.data());
    hn::StoreU(best, kShorts, line + x);
    least = hn::Min(least, best);
  }
  return !hn::AllTrue(kShorts, hn::Eq(least, far));
}

/// The least square that a vector of voxels can see, whose first one stands at `centre` of a row; or less.
HWY_INLINE std::uint16_t least_around(const std::uint16_t* centre, std::size_t reach) {
  const std::size_t lanes = hn::Lanes(kShorts);
  const std::uint16_t* const end = centre + lanes + reach;
  auto least = hn::LoadU(kShorts, end - lanes);
  for (const std::uint16_t* from = centre - reach; from < end - lanes; from += lanes) least = hn::Min(least, hn::LoadU(kShorts, from));
  return hn::GetLane(hn::MinOfLanes(kShorts, least));
}

/// Orders of a row from its distances in the plane y, z.
void orders_along_x(const Extent& e, BandedDistance& work, SolidSpan along_x) {
  const hn::Rebind<std::uint8_t, decltype(kShorts)> half_bytes;
  constexpr std::size_t kStep = kLongestVector / sizeof(std::uint16_t);
  const std::uint16_t* changes = work.changes.data();
  const std::size_t borders = work.steps().above.size();
  for (std::size_t x = 0; x < e.nx; x += hn::Lanes(kShorts)) {
    const int first = static_cast<int>(e.halo + x), last = first + static_cast<int>(hn::Lanes(kShorts)) - 1;
    const std::uint16_t* centre = work.line.data() + kPad + first;
    const Offsets offsets = along_x.offsets_from(first, last, work.reach_for[least_around(centre, e.reach)]);
    const auto best = nearest(centre, 1, offsets, work.k_squares.data());
    auto order = hn::LoadU(kShorts, changes);
    for (std::size_t i = 0; i < borders; ++i) {
      const auto above = hn::Gt(best, hn::LoadU(kShorts, changes + (2 * i + 1) * kStep));
      order = hn::Add(order, hn::IfThenElseZero(above, hn::LoadU(kShorts, changes + (2 * i + 2) * kStep)));
    }
    const auto low = hn::And(order, hn::Set(kShorts, std::uint16_t{255}));
    hn::StoreU(hn::DemoteTo(half_bytes, hn::BitCast(hn::RebindToSigned<decltype(kShorts)>(), low)), half_bytes,
               work.orders.data() + x);
  }
}

/// Puts a row of orders into the bricks that it crosses; rows begin at the block's first brick.
void put_row(const BrickBlock& block, const std::uint8_t* orders, std::size_t y, std::size_t z) {
  const std::size_t first = ((z / kBrickEdge) * static_cast<std::size_t>(block.ny) + y / kBrickEdge) * static_cast<std::size_t>(block.nx);
  const std::size_t offset = brick_offset(0, static_cast<std::uint32_t>(y & 31), static_cast<std::uint32_t>(z & 31));
  for (std::size_t i = 0; i < static_cast<std::size_t>(block.nx); ++i, orders += kBrickEdge) {
    std::int8_t* brick = block.bricks[first + i];
    if (brick == nullptr) continue;
    for (std::size_t tile = 0; tile < 8; ++tile) std::memcpy(brick + offset + 64 * tile, orders + 4 * tile, 4);
  }
}

/// What is solid around a block.
struct Surroundings {
  SolidSpan along_x, along_y;
};

/// Looks at all rows of the surroundings.
Surroundings load(const Extent& e, const BrickBlock& block, BandedDistance& work) {
  Surroundings found;
  const auto reach = static_cast<std::int32_t>(e.reach);
  const std::int32_t from_z = block.min.z - reach, to_z = from_z + static_cast<std::int32_t>(e.nz) + 2 * reach;
  for (std::size_t y = 0; y < e.rows; ++y) {
    const SolidRows::Lines lines =
        work.solid().lines(block.min.x - static_cast<std::int32_t>(e.halo), block.min.y - reach + static_cast<std::int32_t>(y), from_z, to_z);
    const Rows rows{lines.bits, lines.stride, static_cast<std::size_t>(lines.first - from_z), static_cast<std::size_t>(lines.last - from_z)};
    work.filled[y] = lines.bits != nullptr && distances_along_z(e, rows, found.along_x, work.closeness.data() + y * e.length) ? 1 : 0;
    if (work.filled[y] != 0) found.along_y.add(static_cast<int>(y));
  }
  return found;
}

/// One slice from distances along z to squares; false if nothing of it is in the band.
bool load_slice(const Extent& e, BandedDistance& work, std::size_t z) {
  const std::uint16_t far = far_of(e.reach);
  std::uint16_t least_of_all = far;
  for (std::size_t x = 0, i = 0; x < e.used; x += hn::Lanes(kShorts), ++i) {
    work.least_in_slice[i] = squares_of_columns(e, work, work.closeness.data() + z * e.slice + x, work.squares.data() + kMoreOffsets * e.width + x);
    least_of_all = std::min(least_of_all, work.least_in_slice[i]);
  }
  return least_of_all < far;
}

void run_block(const BrickBlock& block, BandedDistance& work) {
  assert(block.nx <= static_cast<std::int32_t>(kMostBricksAlongX));
  const Extent e(block, work.steps().reach);
  const std::uint16_t far = far_of(e.reach);
  work.closeness.resize(e.nz * e.slice);
  work.filled.resize(e.rows);
  work.squares.assign((e.rows + 2 * kMoreOffsets) * e.width, far);  // rows without anything stay far
  work.line.assign(kPad + e.length + kPad, far);
  work.least_in_slice.resize(e.length);
  work.orders.resize(e.length);
  const auto beyond = static_cast<std::uint8_t>(work.steps().order.back());
  const Surroundings around = load(e, block, work);
  for (std::size_t z = 0; z < e.nz; ++z) {
    const bool in_band = around.along_y.last >= 0 && load_slice(e, work, z);
    for (std::size_t y = 0; y < e.ny; ++y) {
      if (in_band && distances_along_y(e, work, around.along_y, y)) {
        orders_along_x(e, work, around.along_x);
      } else {
        std::memset(work.orders.data(), beyond, e.nx);
      }
      put_row(block, work.orders.data(), y, z);
    }
  }
}

}  // namespace phantom::voxel::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::voxel::detail {

namespace {

void put_word(std::uint64_t word, std::uint8_t*& to) {
  std::memcpy(to, &word, sizeof word);
  to += sizeof word;
}

/// Writes `bytes` bytes: a row of the solid that begins `shift` bits later, and free space around it.
void put_row(const std::uint64_t* boundary, const std::uint64_t* interior, std::size_t words, std::size_t shift, std::uint8_t* to,
             std::size_t bytes) {
  const std::uint8_t* const end = to + bytes;
  std::memset(to, 0, shift / 64 * 8);
  to += shift / 64 * 8;
  shift %= 64;
  std::uint64_t carried = 0;
  for (std::size_t i = 0; i < words; ++i) {
    const std::uint64_t word = boundary[i] | interior[i];
    put_word(word << shift | carried, to);
    carried = shift == 0 ? 0 : word >> (64 - shift);
  }
  put_word(carried, to);
  std::memset(to, 0, static_cast<std::size_t>(end - to));
}

}  // namespace

BandedDistance::BandedDistance(const SolidRows& solid, const OrderSteps& steps) : solid_(solid), steps_(steps) {
  constexpr std::size_t kStep = kLongestVector / sizeof(std::uint16_t);
  const auto add = [](LineVector<std::uint16_t>& vectors, int value) { vectors.insert(vectors.end(), kStep, static_cast<std::uint16_t>(value)); };
  for (int k = 0; k <= steps.reach + 4; ++k) add(k_squares, std::min(k * k, UINT16_MAX));  // some more: see nearest()
  for (int least = 0; least <= (steps.reach + 1) * (steps.reach + 1); ++least)
    reach_for.push_back(static_cast<std::uint8_t>(std::sqrt(std::max(0, steps.reach * steps.reach - least))));
  add(changes, steps.order[0]);
  for (std::size_t i = 0; i < steps.above.size(); ++i) {
    add(changes, steps.above[i]);
    add(changes, steps.order[i + 1] - steps.order[i]);
  }
}

SolidRows::SolidRows(const SolidVoxels& solid, std::int32_t margin_vox, int threads) : box_(solid.box) {
  const std::int32_t before = (margin_vox + kBrickEdge - 1) / kBrickEdge * kBrickEdge;
  first_x_ = (box_.min.x >> 5) * kBrickEdge - before;
  const std::int32_t behind = box_.min.x + box_.size[0] + margin_vox + 2 * static_cast<std::int32_t>(kLongestVector);
  row_bytes_ = static_cast<std::size_t>(behind - first_x_ + 63) / 64 * 8 + 8;
  const auto slices = static_cast<std::size_t>(box_.size[2]);
  const std::size_t bytes = row_bytes_ * slices * static_cast<std::size_t>(box_.size[1]);
  bits_.resize(bytes + kLongestVector);
  std::memset(bits_.data() + bytes, 0, kLongestVector);  // rows are loaded in whole vectors
  core::parallel_for(threads, slices, [&](std::size_t z, std::size_t) {
    for (std::int32_t y = 0; y < box_.size[1]; ++y) {
      std::uint8_t* to = bits_.data() + (static_cast<std::size_t>(y) * slices + z) * row_bytes_;
      const auto slice = static_cast<std::int32_t>(z);
      put_row(solid.boundary.row(y, slice), solid.interior.row(y, slice), solid.boundary.words_per_row(),
              static_cast<std::size_t>(box_.min.x - first_x_), to, row_bytes_);
    }
  });
}

HWY_EXPORT(run_block);

void BandedDistance::run(const BrickBlock& block) { HWY_DYNAMIC_DISPATCH(run_block)(block, *this); }

}  // namespace phantom::voxel::detail
#endif  // HWY_ONCE
