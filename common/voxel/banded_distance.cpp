#include "common/voxel/banded_distance.hpp"

#include <algorithm>
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

/// Sizes of one block with its surroundings.
struct Extent {
  Extent(const BrickBlock& block, std::size_t reach_vox)
      : reach(reach_vox),
        halo((reach_vox + 7) / 8 * 8),
        nx(static_cast<std::size_t>(block.nx) * kBrickEdge),
        ny(static_cast<std::size_t>(block.ny) * kBrickEdge),
        nz(static_cast<std::size_t>(block.nz) * kBrickEdge),
        rows(ny + 2 * reach),
        slices(nz + 2 * reach),
        length((nx + 2 * halo + kPad - 1) / kPad * kPad),
        width(length + kPad) {}
  std::size_t reach, halo;  // along x what lies around begins at a whole byte of bits
  std::size_t nx, ny, nz;
  std::size_t rows, slices;   // with what lies within reach
  std::size_t length, width;  // of a row: with what lies within reach, and in memory
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

/// Whether any of the slices has something in the kPad voxels from x on.
bool any_solid(const Extent& e, const std::uint8_t* const* bits, std::size_t x) {
  std::uint64_t any = 0;
  for (std::size_t slice = 0; slice < e.slices; ++slice) {
    std::uint64_t word;
    std::memcpy(&word, bits[slice] + x / 8, sizeof word);
    any |= word;
  }
  return any != 0;
}

/// Distance along z of a vector of lines, for all slices of the block.
HWY_INLINE void distances_along_lines(const Extent& e, const std::uint8_t* const* bits, std::size_t x, std::uint8_t* to) {
  const std::size_t stride = e.rows * e.width;
  const auto one = hn::Set(kBytes, std::uint8_t{1}), top = hn::Set(kBytes, static_cast<std::uint8_t>(e.reach + 1));
  const auto step = [&](auto close, std::size_t slice) HWY_ATTR {
    return hn::IfThenElse(solid_at(bits[slice], x), top, hn::SaturatedSub(close, one));
  };
  auto close = hn::Zero(kBytes);
  std::size_t slice = 0;
  for (; slice < e.reach; ++slice) close = step(close, slice);
  for (; slice < e.reach + e.nz; ++slice, to += stride) {
    close = step(close, slice);
    hn::StoreU(close, kBytes, to);
  }
  close = hn::Zero(kBytes);
  for (slice = e.slices; slice-- > e.reach + e.nz;) close = step(close, slice);
  for (; slice + 1 > e.reach; --slice) {
    to -= stride;
    close = step(close, slice);
    hn::StoreU(hn::Max(close, hn::LoadU(kBytes, to)), kBytes, to);
  }
}

/// Distance along z of one row, for all slices of the block; false (and nothing written) if all are beyond reach.
bool distances_along_z(const Extent& e, const std::uint8_t* const* bits, std::uint8_t* out) {
  bool any = false;
  for (std::size_t part = 0; part < e.length; part += kPad) {
    if (any_solid(e, bits, part)) {
      if (!any && part > 0) {
        for (std::size_t slice = 0; slice < e.nz; ++slice) std::memset(out + slice * e.rows * e.width, 0, part);
      }
      any = true;
      for (std::size_t x = part; x < part + kPad; x += hn::Lanes(kBytes)) distances_along_lines(e, bits, x, out + x);
    } else if (any) {
      for (std::size_t slice = 0; slice < e.nz; ++slice) std::memset(out + slice * e.rows * e.width + part, 0, kPad);
    }
  }
  return any;
}

/// Squares of the distances of one slice, for a vector of columns. Returns the least of them.
HWY_INLINE std::uint16_t squares_of_columns(const Extent& e, const BandedDistance& work, const std::uint8_t* closeness, std::uint16_t* squares) {
  const hn::Rebind<std::uint8_t, decltype(kShorts)> half_bytes;
  const auto top = hn::Set(kShorts, static_cast<std::uint16_t>(e.reach + 1));
  auto least = hn::Mul(top, top);
  for (std::size_t y = 0; y < e.rows; ++y, closeness += e.width, squares += e.width) {
    if (work.filled[y] == 0) continue;
    const auto d = hn::Sub(top, hn::PromoteTo(kShorts, hn::LoadU(half_bytes, closeness)));
    const auto square = hn::Mul(d, d);
    hn::StoreU(square, kShorts, squares);
    least = hn::Min(least, square);
  }
  return hn::GetLane(hn::MinOfLanes(kShorts, least));
}

/// The least of centre + 0 and, for 1 ≤ k ≤ reach, the neighbours at ±k·stride plus k². Ends as soon as no farther
/// neighbour can be nearer. Saturation keeps what is too far from wrapping.
HWY_INLINE hn::Vec<decltype(kShorts)> nearest(const std::uint16_t* centre, std::ptrdiff_t stride, std::size_t reach) {
  auto best = hn::LoadU(kShorts, centre);
  for (std::size_t k = 1; k <= reach; ++k) {
    const auto square = hn::Set(kShorts, static_cast<std::uint16_t>(k * k));
    if ((k & 3) == 1 && hn::AllTrue(kShorts, hn::Eq(best, hn::Min(best, square)))) break;
    const std::ptrdiff_t away = static_cast<std::ptrdiff_t>(k) * stride;
    const auto neighbour = hn::Min(hn::LoadU(kShorts, centre - away), hn::LoadU(kShorts, centre + away));
    best = hn::Min(best, hn::SaturatedAdd(neighbour, square));
  }
  return best;
}

/// How far a neighbour can matter if the least square is `least`: beyond, least + k² is out of the band.
std::uint16_t useful_reach(std::size_t reach, std::uint16_t least) {
  const int left = static_cast<int>(reach * reach) - least;
  return left < 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(std::sqrt(static_cast<float>(left)) + 1e-3F);
}

/// Squared distances of row y in the plane y, z. Returns the least of them.
std::uint16_t distances_along_y(const Extent& e, BandedDistance& work, std::size_t y) {
  auto least = hn::Set(kShorts, far_of(e.reach));
  const std::uint16_t* row = work.squares.data() + (y + e.reach) * e.width;
  for (std::size_t x = 0; x < e.length; x += hn::Lanes(kShorts)) {
    const auto best = nearest(row + x, static_cast<std::ptrdiff_t>(e.width), work.reach_of[x / hn::Lanes(kShorts)]);
    hn::StoreU(best, kShorts, work.line.data() + x);
    least = hn::Min(least, best);
  }
  return hn::GetLane(hn::MinOfLanes(kShorts, least));
}

/// Orders of a row from its distances in the plane y, z.
void orders_along_x(const Extent& e, BandedDistance& work, std::size_t reach) {
  const hn::Rebind<std::uint8_t, decltype(kShorts)> half_bytes;
  const OrderSteps& steps = work.steps();
  for (std::size_t x = 0; x < e.nx; x += hn::Lanes(kShorts)) {
    const auto best = nearest(work.line.data() + e.halo + x, 1, reach);
    auto order = hn::Set(kShorts, static_cast<std::uint16_t>(steps.order[0]));
    for (std::size_t i = 0; i < steps.above.size(); ++i) {
      const auto change = static_cast<std::uint16_t>(steps.order[i + 1] - steps.order[i]);
      const auto above = hn::Gt(best, hn::Set(kShorts, steps.above[i]));
      order = hn::Add(order, hn::IfThenElseZero(above, hn::Set(kShorts, change)));
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

/// Looks at all rows of the surroundings; false if there is nothing solid.
bool load(const Extent& e, const BrickBlock& block, BandedDistance& work) {
  bool any = false;
  const auto reach = static_cast<std::int32_t>(e.reach);
  for (std::size_t y = 0; y < e.rows; ++y) {
    for (std::size_t z = 0; z < e.slices; ++z) {
      work.bits[z] = work.solid().row(block.min.x - static_cast<std::int32_t>(e.halo), block.min.y - reach + static_cast<std::int32_t>(y),
                                      block.min.z - reach + static_cast<std::int32_t>(z));
    }
    work.filled[y] = distances_along_z(e, work.bits.data(), work.closeness.data() + y * e.width) ? 1 : 0;
    any |= work.filled[y] != 0;
  }
  return any;
}

/// One slice from distances along z to squares; false if nothing of it is in the band.
bool load_slice(const Extent& e, BandedDistance& work, std::size_t z) {
  const std::uint16_t far = far_of(e.reach);
  std::uint16_t least_of_all = far;
  for (std::size_t x = 0; x < e.length; x += hn::Lanes(kShorts)) {
    const std::uint16_t least =
        squares_of_columns(e, work, work.closeness.data() + z * e.rows * e.width + x, work.squares.data() + x);
    work.reach_of[x / hn::Lanes(kShorts)] = useful_reach(e.reach, least);
    least_of_all = std::min(least_of_all, least);
  }
  return least_of_all < far;
}

void run_block(const BrickBlock& block, BandedDistance& work) {
  const Extent e(block, work.steps().reach);
  const std::uint16_t far = far_of(e.reach);
  work.bits.resize(e.slices);
  work.closeness.resize(e.nz * e.rows * e.width);
  work.filled.resize(e.rows);
  work.squares.assign(e.rows * e.width, far);  // rows without anything stay far
  work.line.assign(e.width, far);
  work.reach_of.resize(e.width);
  work.orders.resize(e.width);
  const auto beyond = static_cast<std::uint8_t>(work.steps().order.back());
  const bool any = load(e, block, work);
  for (std::size_t z = 0; z < e.nz; ++z) {
    const bool in_band = any && load_slice(e, work, z);
    for (std::size_t y = 0; y < e.ny; ++y) {
      const std::uint16_t least = in_band ? distances_along_y(e, work, y) : far;
      if (least < far) {
        orders_along_x(e, work, useful_reach(e.reach, least));
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

/// Ors a row of bits into another that begins `shift` bits later.
void put_bits(const std::uint64_t* from, std::size_t words, std::size_t shift, std::uint8_t* to) {
  to += shift / 64 * 8;
  shift %= 64;
  std::uint64_t carried = 0;
  for (std::size_t i = 0; i < words; ++i, to += 8) {
    const std::uint64_t word = from[i] << shift | carried;
    carried = shift == 0 ? 0 : from[i] >> (64 - shift);
    std::uint64_t there;
    std::memcpy(&there, to, sizeof there);
    there |= word;
    std::memcpy(to, &there, sizeof there);
  }
  std::uint64_t there;
  std::memcpy(&there, to, sizeof there);
  there |= carried;
  std::memcpy(to, &there, sizeof there);
}

}  // namespace

SolidRows::SolidRows(const SolidVoxels& solid, std::int32_t margin_vox, int threads) : box_(solid.box) {
  const std::int32_t before = (margin_vox + kBrickEdge - 1) / kBrickEdge * kBrickEdge;
  first_x_ = (box_.min.x >> 5) * kBrickEdge - before;
  const std::int32_t behind = box_.min.x + box_.size[0] + margin_vox + 2 * static_cast<std::int32_t>(kLongestVector);
  row_bytes_ = static_cast<std::size_t>(behind - first_x_ + 63) / 64 * 8 + 8;
  const auto rows_per_slice = static_cast<std::size_t>(box_.size[1]);
  bits_ = std::make_unique<std::uint8_t[]>(row_bytes_ * (1 + rows_per_slice * static_cast<std::size_t>(box_.size[2])));
  core::parallel_for(threads, static_cast<std::size_t>(box_.size[2]), [&](std::size_t z, std::size_t) {
    std::uint8_t* to = bits_.get() + (1 + z * rows_per_slice) * row_bytes_;
    for (std::int32_t y = 0; y < box_.size[1]; ++y, to += row_bytes_) {
      for (const BitVolume* volume : {&solid.boundary, &solid.interior}) {
        put_bits(volume->row(y, static_cast<std::int32_t>(z)), volume->words_per_row(), static_cast<std::size_t>(box_.min.x - first_x_), to);
      }
    }
  });
}

HWY_EXPORT(run_block);

void BandedDistance::run(const BrickBlock& block) { HWY_DYNAMIC_DISPATCH(run_block)(block, *this); }

}  // namespace phantom::voxel::detail
#endif  // HWY_ONCE
