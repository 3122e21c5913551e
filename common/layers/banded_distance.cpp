#include "common/layers/banded_distance.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <climits>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "common/workspace/workspace.hpp"

// Compiled once for each instruction set; the best one is chosen at run time.
#define HWY_WANT_AVX3_DL
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/layers/banded_distance.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/layers/banded_lines-inl.hpp"
#include "common/layers/banded_ranks-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::layers::detail::HWY_NAMESPACE {

/// Computes the squared distances of one slice, for a vector of columns. Returns the least of them.
HWY_INLINE std::uint16_t squares_of_columns(const Extent& e, const BandedDistance& work,
                                            const std::uint8_t* proximity, std::uint16_t* squares) {
  const hn::Rebind<std::uint8_t, decltype(kShorts)> half_bytes;
  const auto top = hn::Set(kShorts, static_cast<std::uint16_t>(e.reach + 1));
  auto least = hn::Mul(top, top);
  for (std::size_t y = 0; y < e.rows; ++y, proximity += e.length, squares += e.width) {
    if (work.solid_in[y].empty()) continue;
    const auto d = hn::Sub(top, hn::PromoteTo(kShorts, hn::LoadU(half_bytes, proximity)));
    const auto square = hn::Mul(d, d);
    hn::StoreU(square, kShorts, squares);
    least = hn::Min(least, square);
  }
  return hn::GetLane(hn::MinOfLanes(kShorts, least));
}

/// Returns the least of the centre and the neighbours at ±k·stride plus k², for k in `offsets`. Up to
/// kMoreOffsets more neighbours are read, which does not change the result. Stops as soon as no farther
/// neighbour can be nearer. Saturation keeps large sums from wrapping. `squares`: k² as a vector,
/// kMaxVector bytes each.
HWY_INLINE hn::Vec<decltype(kShorts)> nearest(const std::uint16_t* centre, std::ptrdiff_t stride,
                                              Offsets offsets, const std::uint16_t* squares) {
  constexpr std::size_t kStep = kMaxVector / sizeof(std::uint16_t);
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

/// Computes the squared distances of row y in the plane y, z. Returns false if all are beyond the reach.
bool distances_along_y(const Extent& e, BandedDistance& work, SolidSpan along_y, std::size_t y) {
  const auto stride = static_cast<std::ptrdiff_t>(e.width);
  const std::uint16_t* row = work.squares.data() + (y + e.reach + kMoreOffsets) * e.width;
  std::uint16_t* line = work.line.data() + kPad;
  const int at = static_cast<int>(y + e.reach);
  const auto far = hn::Set(kShorts, far_of(e.reach));
  auto least = far;
  for (std::size_t x = 0, i = 0; x < e.used; x += hn::Lanes(kShorts), ++i) {
    if (!work.columns[x / kPad].wanted) continue;
    const Offsets offsets = offsets_from(along_y, at, at, work.reach_for[work.least_in_slice[i]]);
    const auto best = nearest(row + x, stride, offsets, work.k_squares.data());
    hn::StoreU(best, kShorts, line + x);
    least = hn::Min(least, best);
  }
  return !hn::AllTrue(kShorts, hn::Eq(least, far));
}

/// Returns the least square, or less, that is within reach of a vector of voxels whose first is at `centre`.
HWY_INLINE std::uint16_t least_around(const std::uint16_t* centre, std::size_t reach) {
  const std::size_t lanes = hn::Lanes(kShorts);
  const std::uint16_t* const end = centre + lanes + reach;
  auto least = hn::LoadU(kShorts, end - lanes);
  for (const std::uint16_t* from = centre - reach; from < end - lanes; from += lanes)
    least = hn::Min(least, hn::LoadU(kShorts, from));
  return hn::GetLane(hn::MinOfLanes(kShorts, least));
}

/// Computes the orders of a row from its distances in the plane y, z.
void orders_along_x(const Extent& e, std::int8_t* const* bricks, BandedDistance& work, SolidSpan along_x) {
  const hn::Rebind<std::uint8_t, decltype(kShorts)> half_bytes;
  constexpr std::size_t kStep = kMaxVector / sizeof(std::uint16_t);
  const std::uint16_t* changes = work.changes.data();
  const std::size_t borders = work.steps().above.size();
  for (std::size_t x = 0; x < e.nx; x += hn::Lanes(kShorts)) {
    if (bricks[x / workspace::kBrickEdge] == nullptr) continue;
    const int first = static_cast<int>(e.halo + x), last = first + static_cast<int>(hn::Lanes(kShorts)) - 1;
    const std::uint16_t* centre = work.line.data() + kPad + first;
    const Offsets offsets = offsets_from(along_x, first, last, work.reach_for[least_around(centre, e.reach)]);
    const auto best = nearest(centre, 1, offsets, work.k_squares.data());
    auto order = hn::LoadU(kShorts, changes);
    for (std::size_t i = 0; i < borders; ++i) {
      const auto above = hn::Gt(best, hn::LoadU(kShorts, changes + (2 * i + 1) * kStep));
      order = hn::Add(order, hn::IfThenElseZero(above, hn::LoadU(kShorts, changes + (2 * i + 2) * kStep)));
    }
    const auto low = hn::And(order, hn::Set(kShorts, std::uint16_t{255}));
    hn::StoreU(hn::DemoteTo(half_bytes, hn::BitCast(hn::RebindToSigned<decltype(kShorts)>(), low)),
               half_bytes, work.orders.data() + x);
  }
}

/// Marks the boundary voxels of a row of orders that begins at voxel `first`.
void mark_boundary(const SolidRows& solid, workspace::Index3 first, std::size_t length,
                   std::uint8_t* orders) {
  const auto boundary = hn::Set(kBytes, static_cast<std::uint8_t>(workspace::kOrderBoundary));
  for (std::size_t x = 0; x < length; x += 64) {
    const auto [word] = solid.boundary<1>(first.x + static_cast<std::int32_t>(x), first.y, first.z);
    if (word == 0) continue;
    for (std::size_t i = 0; i < 64; i += hn::Lanes(kBytes)) {
      const auto here = hn::LoadU(kBytes, orders + x + i);
      hn::StoreU(hn::IfThenElse(solid_at(&word, i), boundary, here), kBytes, orders + x + i);
    }
  }
}

/// Writes a row of orders into the bricks that it crosses. The row begins at the block's first brick.
void put_row(const BrickBlock& block, const std::uint8_t* orders, std::size_t y, std::size_t z) {
  std::int8_t* const* bricks = bricks_at(block, y, z);
  const std::size_t offset =
      workspace::brick_offset(0, static_cast<std::uint32_t>(y & 31), static_cast<std::uint32_t>(z & 31));
  for (std::size_t i = 0; i < static_cast<std::size_t>(block.nx); ++i, orders += workspace::kBrickEdge) {
    if (bricks[i] == nullptr) continue;
    for (std::size_t tile = 0; tile < 8; ++tile)
      std::memcpy(bricks[i] + offset + 64 * tile, orders + 4 * tile, 4);
  }
}

/// The ranges that hold anything solid around a block.
struct Surroundings {
  SolidSpan along_x, along_y;
};

/// Moves rows that the previous block had as well to their new positions. Returns how many.
std::size_t take_over(const Extent& e, const BrickBlock& block, BandedDistance& work) {
  const BrickBlock& last = work.last;
  const bool follows = last.nx == block.nx && last.ny == block.ny && last.nz == block.nz &&
                       last.min.x == block.min.x && last.min.z == block.min.z &&
                       last.min.y + last.ny * workspace::kBrickEdge == block.min.y;
  work.last = {block.min, block.nx, block.ny, block.nz, {}};
  if (!follows) return 0;
  for (std::size_t z = 0; z < e.nz; ++z) {
    std::uint8_t* const rows = work.proximity.data() + z * e.slice + kMoreOffsets * e.length;
    std::memmove(rows, rows + e.ny * e.length, 2 * e.reach * e.length);
  }
  std::copy(work.solid_in.begin() + static_cast<std::ptrdiff_t>(e.ny), work.solid_in.end(),
            work.solid_in.begin());
  return 2 * e.reach;
}

/// Computes the new rows of the surroundings, and passes `summaries` their distances along z.
template <class Summaries>
Surroundings load(const Extent& e, const BrickBlock& block, BandedDistance& work, Summaries summaries) {
  const auto reach = static_cast<std::int32_t>(e.reach);
  const workspace::Index3 corner{block.min.x - static_cast<std::int32_t>(e.halo), block.min.y - reach,
                                 block.min.z - reach};
  work.solid_in.resize(e.rows);
  const std::size_t known = take_over(e, block, work);
  summaries.keep(known);
  for (std::size_t y = known; y < e.rows; ++y) {
    work.solid_in[y] = distances_along_z(
        e, work, {corner.x, corner.y + static_cast<std::int32_t>(y), corner.z}, y, summaries);
  }
  Surroundings found;
  for (std::size_t y = 0; y < e.rows; ++y) {
    if (work.solid_in[y].empty()) continue;
    found.along_x.add(work.solid_in[y]);
    found.along_y.add({static_cast<int>(y), static_cast<int>(y)});
  }
  return found;
}

/// Summaries of kernels that read the rows themselves.
struct NoSummaries {
  static constexpr bool kWanted = false;
  void keep(std::size_t) {}
  void add(std::size_t, std::size_t, std::size_t, std::uint32_t, const std::uint64_t*) {}
};

/// Converts one slice of distances along z to squares. Returns false if all are beyond the reach.
bool load_slice(const Extent& e, BandedDistance& work, std::size_t z) {
  const std::uint16_t far = far_of(e.reach);
  std::uint16_t least_of_all = far;
  for (std::size_t x = 0, i = 0; x < e.used; x += hn::Lanes(kShorts), ++i) {
    if (!work.columns[x / kPad].wanted) continue;
    work.least_in_slice[i] =
        squares_of_columns(e, work, work.proximity.data() + z * e.slice + kMoreOffsets * e.length + x,
                           work.squares.data() + kMoreOffsets * e.width + x);
    least_of_all = std::min(least_of_all, work.least_in_slice[i]);
  }
  return least_of_all < far;
}

/// Finds the vectors of columns that a layer of bricks needs: those of the wanted bricks and those within
/// reach of them.
void find_wanted(const Extent& e, const BrickBlock& block, std::size_t layer, BandedDistance& work) {
  for (RowsOfColumns& columns : work.columns) columns.wanted = false;
  const auto in_layer = static_cast<std::size_t>(block.nx) * static_cast<std::size_t>(block.ny);
  for (std::size_t i = 0; i < in_layer; ++i) {
    if (block.bricks[layer * in_layer + i] == nullptr) continue;
    const std::size_t x = i % static_cast<std::size_t>(block.nx) * workspace::kBrickEdge;
    for (std::size_t column = (x + e.halo - e.reach) / kPad;
         column <= (x + workspace::kBrickEdge + e.halo + e.reach - 1) / kPad; ++column)
      work.columns[column].wanted = true;
  }
}

#if HWY_TARGET == HWY_AVX3_DL
void run_block_in_bytes(const Extent& e, const BrickBlock& block, BandedDistance& work) {
  for (std::size_t z = 0; z < e.nz; ++z) {  // padding rows, because neighbours are read in groups
    std::uint8_t* const slice = work.proximity.data() + z * e.slice;
    std::memset(slice, 0, kMoreOffsets * e.length);
    std::memset(slice + (kMoreOffsets + e.rows) * e.length, 0, kMoreOffsets * e.length);
  }
  work.rank_columns.assign(kRowsAtOnce * (kPad + e.length + kPad), work.ranks.far);
  work.least_ranks.assign(e.length / kPad + 4,
                          0x01010101U * work.ranks.far);  // with padding for least_around()
  work.in_band.assign(4 + e.length / kPad, 0);
  const Surroundings around = load(e, block, work, RowSummaries(e, work));
  for (std::size_t z = 0; z < e.nz; ++z) {
    if (z % workspace::kBrickEdge == 0) find_wanted(e, block, z / workspace::kBrickEdge, work);
    const bool in_band = !around.along_y.empty() && look_at_columns(e, work, z);
    for (std::size_t y = 0; y < e.ny; y += kRowsAtOnce) rows_of_slice(e, block, y, z, in_band, work);
  }
}
#endif

void run_block(const BrickBlock& block, BandedDistance& work) {
  assert(block.nx <= static_cast<std::int32_t>(kMaxBricksAlongX));
  const Extent e(block, work.steps().reach);
  work.proximity.resize(e.nz * e.slice);
  work.orders.resize(e.length);
  work.columns.resize(e.length / kPad);
#if HWY_TARGET == HWY_AVX3_DL
  if (work.ranks.fit) return run_block_in_bytes(e, block, work);
#endif
  const std::uint16_t far = far_of(e.reach);
  work.squares.assign((e.rows + 2 * kMoreOffsets) * e.width, far);  // empty rows stay far
  work.line.assign(kPad + e.length + kPad, far);
  work.least_in_slice.resize(e.length);
  const auto beyond = static_cast<std::uint8_t>(work.steps().order.back());
  const Surroundings around = load(e, block, work, NoSummaries());
  for (std::size_t z = 0; z < e.nz; ++z) {
    if (z % workspace::kBrickEdge == 0) find_wanted(e, block, z / workspace::kBrickEdge, work);
    const bool in_band = !around.along_y.empty() && load_slice(e, work, z);
    for (std::size_t y = 0; y < e.ny; ++y) {
      if (in_band && distances_along_y(e, work, around.along_y, y)) {
        orders_along_x(e, bricks_at(block, y, z), work, around.along_x);
        mark_boundary(work.solid(), voxel_of(block, y, z), e.nx, work.orders.data());
      } else {
        std::memset(work.orders.data(), beyond, e.nx);
      }
      put_row(block, work.orders.data(), y, z);
    }
  }
}

}  // namespace phantom::layers::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::layers::detail {

BandedDistance::BandedDistance(const SolidRows& solid, const OrderSteps& steps)
    : ranks(steps), solid_(solid), steps_(steps) {
  constexpr std::size_t kStep = kMaxVector / sizeof(std::uint16_t);
  const auto add = [](LineVector<std::uint16_t>& vectors, int value) {
    vectors.insert(vectors.end(), kStep, static_cast<std::uint16_t>(value));
  };
  for (int k = 0; k <= steps.reach + 4; ++k)
    add(k_squares, std::min(k * k, UINT16_MAX));  // with padding for nearest()
  for (int least = 0; least <= (steps.reach + 1) * (steps.reach + 1); ++least)
    reach_for.push_back(static_cast<std::uint8_t>(std::sqrt(std::max(0, steps.reach * steps.reach - least))));
  add(changes, steps.order[0]);
  for (std::size_t i = 0; i < steps.above.size(); ++i) {
    add(changes, steps.above[i]);
    add(changes, steps.order[i + 1] - steps.order[i]);
  }
}

BandedDistance::Ranks::Ranks(const OrderSteps& steps) {
  const int reach = steps.reach;
  std::vector<int> greatest;  // greatest square of each rank: the squares that separate orders k voxels away
  for (const int above : steps.above) {
    for (int k = 0; k * k <= above; ++k) greatest.push_back(above - k * k);
  }
  std::sort(greatest.begin(), greatest.end());
  greatest.erase(std::unique(greatest.begin(), greatest.end()), greatest.end());
  fit = reach + 2 <= 64 && reach <= static_cast<int>(kMaxVector) && greatest.size() < 128 &&
        steps.order.size() <= 64;
  if (!fit) return;
  far = static_cast<std::uint8_t>(greatest.size());
  const auto rank_of = [&](int square) {
    return static_cast<std::uint8_t>(std::lower_bound(greatest.begin(), greatest.end(), square) -
                                     greatest.begin());
  };
  const auto class_of = [&](int square) {
    return static_cast<std::uint8_t>(std::lower_bound(steps.above.begin(), steps.above.end(), square) -
                                     steps.above.begin());
  };
  const int beyond = (reach + 1) * (reach + 1);
  of_proximity.resize(64 * static_cast<std::size_t>(reach + 4));
  classes.resize(128 * static_cast<std::size_t>(reach + 4), class_of(beyond));
  for (int k = 0; k < reach + 4; ++k) {
    for (int proximity = 0; proximity < 64; ++proximity) {
      const int distance = std::max(0, reach + 1 - proximity);
      of_proximity[static_cast<std::size_t>(64 * k + proximity)] =
          rank_of(proximity == 0 ? beyond : distance * distance + k * k);
    }
    for (std::size_t rank = 0; rank < far; ++rank)
      classes[128 * static_cast<std::size_t>(k) + rank] = class_of(greatest[rank] + k * k);
  }
  for (int proximity = 0; proximity <= reach + 1; ++proximity) {
    const int distance = reach + 1 - proximity;
    reach_of_proximity.push_back(
        static_cast<std::uint8_t>(std::sqrt(std::max(0, reach * reach - distance * distance))));
  }
  for (const int square : greatest)
    reach_of_rank.push_back(static_cast<std::uint8_t>(std::sqrt(reach * reach - square)));
  reach_of_rank.push_back(0);
  orders.resize(64);
  for (std::size_t i = 0; i < steps.order.size(); ++i) orders[i] = static_cast<std::uint8_t>(steps.order[i]);
}

HWY_EXPORT(run_block);

void BandedDistance::run(const BrickBlock& block) { HWY_DYNAMIC_DISPATCH(run_block)(block, *this); }

}  // namespace phantom::layers::detail
#endif  // HWY_ONCE
