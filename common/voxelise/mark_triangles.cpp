#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "common/voxelise/snapped_mesh.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/voxelise/mark_triangles.cpp"
#include <hwy/foreach_target.h>  // once per instruction set
// (keep this order)
#include <hwy/highway.h>

#include "common/voxelise/corner_lanes-inl.hpp"
#include "common/voxelise/mark_medium-inl.hpp"
#include "common/voxelise/mark_small-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::voxelise::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Voxels are tested in tiles of 4 × 4 × 4, one bit each: bit 16 z + 4 y + x. A closed triangle and a closed
// cube intersect unless one of thirteen directions separates them: the cube's axes (the ranges below), the
// cross products of the axes with the triangle's edges (three projections with three edges each) and the
// triangle's normal.
alignas(64) constexpr std::int64_t kOddLanes[kTile] = {0, -1, 0, -1}, kUpperLanes[kTile] = {0, 0, -1, -1};
alignas(64) constexpr double kLaneNumbers[kTile] = {0, 1, 2, 3};

/// The triangle's projection (its projection) on the plane (u, v), tested against whole squares of the grid.
struct Projection {
  std::int64_t step_u[3], step_v[3], at_origin[3];
  int u, v;

  Projection(const std::array<SnappedPoint, 3>& t, int u_axis, int v_axis) : u(u_axis), v(v_axis) {
    const std::int64_t area = (std::int64_t{t[1][u]} - t[0][u]) * (std::int64_t{t[2][v]} - t[0][v]) -
                              (std::int64_t{t[2][u]} - t[0][u]) * (std::int64_t{t[1][v]} - t[0][v]);
    // Edges are directed so that the projection is on their left. A projection without area is a segment: its
    // edges run both ways, so both of its sides are tested.
    const std::int64_t way = area < 0 ? -1 : 1;
    for (int i = 0; i < 3; ++i) {
      const SnappedPoint &from = t[i], &to = t[(i + 1) % 3];
      const std::int64_t du = way * (std::int64_t{to[u]} - from[u]),
                         dv = way * (std::int64_t{to[v]} - from[v]);
      step_u[i] = -dv * kSub;
      step_v[i] = du * kSub;
      // The value at the square's corner that lies farthest to the left of the edge.
      at_origin[i] = dv * from[u] - du * from[v] + std::max<std::int64_t>(0, step_u[i]) +
                     std::max<std::int64_t>(0, step_v[i]);
    }
  }
  /// Returns the squares of the tile at (cell_u, cell_v) that meet the projection, for at least the first
  /// `rows` rows along v: bit 4 v + u.
  std::uint32_t tile(std::int64_t cell_u, std::int64_t cell_v, int rows) const {
    const hn::CappedTag<std::int64_t, kTile> d;
    const std::size_t lanes = hn::Lanes(d);
    std::int64_t corner[3];
    for (int i = 0; i < 3; ++i) corner[i] = at_origin[i] + cell_u * step_u[i] + cell_v * step_v[i];
    std::uint32_t outside = 0;
    for (std::size_t part = 0; part < kTile; part += lanes) {
      // Start + {0, 1, 2, 3} · step, computed in registers only.
      const auto odd = hn::Load(d, kOddLanes + part), upper = hn::Load(d, kUpperLanes + part);
      const auto ramp = [&](int i) {
        return hn::Add(hn::Set(d, corner[i]), hn::Add(hn::And(hn::Set(d, step_u[i]), odd),
                                                      hn::And(hn::Set(d, 2 * step_u[i]), upper)));
      };
      auto a = ramp(0), b = ramp(1), c = ramp(2);
      const auto up_a = hn::Set(d, step_v[0]), up_b = hn::Set(d, step_v[1]), up_c = hn::Set(d, step_v[2]);
      for (int k = 0; k < rows; ++k) {
        std::uint8_t bits[8];
        hn::StoreMaskBits(d, hn::Lt(hn::Or(hn::Or(a, b), c), hn::Zero(d)), bits);
        outside |= static_cast<std::uint32_t>(bits[0]) << (static_cast<std::size_t>(kTile * k) + part);
        a = hn::Add(a, up_a);
        b = hn::Add(b, up_b);
        c = hn::Add(c, up_c);
      }
    }
    return ~outside & 0xffff;
  }
};

/// The triangle's plane, tested against whole voxels.
class Plane {
 public:
  explicit Plane(const std::array<SnappedPoint, 3>& t) : origin_(t[0]) {
    std::int64_t b[3], c[3];
    double bound = 0;
    for (int i = 0; i < 3; ++i) {
      b[i] = std::int64_t{t[1][i]} - t[0][i];
      c[i] = std::int64_t{t[2][i]} - t[0][i];
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      normal_[i] = b[j] * c[k] - b[k] * c[j];
      step_[i] = static_cast<double>(normal_[i]) * static_cast<double>(kSub);
      low_ += std::min(0.0, step_[i]);
      span_ += std::abs(step_[i]);
      bound += std::abs(static_cast<double>(normal_[i])) *
               static_cast<double>(std::max(std::abs(b[i]), std::abs(c[i])) + 8 * kSub);
    }
    // Below 2⁵² all values are whole numbers that a double represents exactly. Above, doubtful cases are
    // decided in integers.
    doubt_ = bound < 0x1p52 ? -1.0 : bound * 0x1p-48;
  }
  /// Returns n · (corner of the voxel − a point of the plane).
  double at(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::int32_t cell[3] = {x, y, z};
    double value = 0;
    for (int i = 0; i < 3; ++i)
      value += static_cast<double>(normal_[i]) * static_cast<double>(cell[i] * kSub - origin_[i]);
    return value;
  }
  /// Returns the voxels of the tile through which the plane passes; valid at least where `asked` has bits.
  std::uint64_t tile(std::int32_t x, std::int32_t y, std::int32_t z, std::uint64_t asked) const {
    const hn::CappedTag<double, kTile> d;
    const std::size_t lanes = hn::Lanes(d);
    const double corner = at(x, y, z) + low_;
    const auto doubt = hn::Set(d, doubt_), span = hn::Set(d, span_);
    std::uint64_t meets = 0, doubtful = 0;
    for (std::size_t part = 0; part < kTile; part += lanes) {
      const auto along_x = hn::Mul(hn::Load(d, kLaneNumbers + part), hn::Set(d, step_[0]));
      for (std::uint64_t left = asked; left != 0;) {
        const int row = std::countr_zero(left) / kTile;
        left &= ~(std::uint64_t{0xf} << (kTile * row));
        const auto low =
            hn::Add(along_x, hn::Set(d, corner + (row % kTile) * step_[1] + (row / kTile) * step_[2]));
        const auto high = hn::Add(low, span);
        std::uint8_t bits[8];
        const std::size_t shift = static_cast<std::size_t>(kTile * row) + part;
        hn::StoreMaskBits(d, hn::And(hn::Le(low, hn::Zero(d)), hn::Ge(high, hn::Zero(d))), bits);
        meets |= static_cast<std::uint64_t>(bits[0]) << shift;
        if (doubt_ >= 0) {
          hn::StoreMaskBits(d, hn::Le(hn::Min(hn::Abs(low), hn::Abs(high)), doubt), bits);
          doubtful |= static_cast<std::uint64_t>(bits[0]) << shift;
        }
      }
    }
    for (doubtful &= asked; doubtful != 0; doubtful &= doubtful - 1) {
      const int bit = std::countr_zero(doubtful);
      const std::uint64_t one = std::uint64_t{1} << bit;
      meets = passes(x + bit % 4, y + bit / 4 % 4, z + bit / 16) ? meets | one : meets & ~one;
    }
    return meets;
  }
  /// Returns the cells along x that the plane can meet above the rows [y, y+4) × [z, z+4); may return too
  /// many, never too few.
  Range above(std::int32_t y, std::int32_t z, const Range& x) const {
    if (step_[0] == 0) return x;
    const double first = at(x.first, y, z) + low_ - std::min(0.0, step_[0]);  // at the lowest x side
    const double span_rows = span_ - std::abs(step_[0]);
    const double other = kTile - 1;
    const double least = first + other * (std::min(0.0, step_[1]) + std::min(0.0, step_[2]));
    const double most = first + span_rows + other * (std::max(0.0, step_[1]) + std::max(0.0, step_[2]));
    const double a = -least / step_[0], b = -most / step_[0];
    const double low = std::floor(std::min(a, b)) - 2, high = std::ceil(std::max(a, b)) + 2;
    const auto cells = static_cast<double>(x.last - x.first);
    if (!(high >= 0 && low <= cells)) return {0, -1};
    return {x.first + static_cast<std::int32_t>(std::max(0.0, low)),
            x.first + static_cast<std::int32_t>(std::min(cells, high))};
  }

 private:
  bool passes(std::int32_t x, std::int32_t y, std::int32_t z) const {
    __extension__ using Wide = __int128;
    const std::int32_t cell[3] = {x, y, z};
    Wide low = 0, high = 0;
    for (int i = 0; i < 3; ++i) {
      const Wide n = normal_[i], here = n * (cell[i] * kSub - origin_[i]), there = here + n * kSub;
      low += std::min(here, there);
      high += std::max(here, there);
    }
    return low <= 0 && high >= 0;
  }

  SnappedPoint origin_;
  std::int64_t normal_[3];
  double step_[3], low_ = 0, span_ = 0, doubt_ = 0;
};

/// Returns the number of rows of a tile at `at` that a range reaches.
HWY_INLINE int rows_from(std::int32_t at, const Range& range) { return std::min(kTile, range.last - at + 1); }

/// The volume in which voxels are marked.
class Marks {
 public:
  explicit Marks(workspace::BitVolume& volume) : volume_(volume) {
    const std::size_t row = volume.words_per_row(), layer = row * static_cast<std::size_t>(volume.size()[1]);
    for (std::size_t i = 0; i < kTile * kTile; ++i) offsets_[i] = i % kTile * row + i / kTile * layer;
  }
  std::int32_t size(std::size_t axis) const { return volume_.size()[axis]; }
  /// Sets the bits of a tile. The tile begins at a voxel of the volume.
  HWY_INLINE void put(std::uint64_t tile, std::int32_t x, std::int32_t y, std::int32_t z) {
    const int shift = x & 63;
    std::uint64_t* const first = volume_.row(y, z) + (x >> 6);
    for (; tile != 0;) {
      const int row = std::countr_zero(tile) / kTile;
      const std::uint64_t bits = tile >> (kTile * row) & 0xf;
      tile &= ~(std::uint64_t{0xf} << (kTile * row));
      std::uint64_t* const word = first + offsets_[row];
      word[0] |= bits << shift;
      if (shift > 60 && bits >> (64 - shift) != 0) word[1] |= bits >> (64 - shift);
    }
  }
  void set(std::int32_t x, std::int32_t y, std::int32_t z) { volume_.set(x, y, z); }

 private:
  workspace::BitVolume& volume_;
  std::size_t offsets_[kTile * kTile];  // words from a tile's first row to its others
};

/// Marks a triangle that lies within one layer of voxels across `flat`: its projection along that axis
/// decides.
void mark_flat(const std::array<SnappedPoint, 3>& t, const Range* range, int flat, Marks& boundary) {
  const int u = flat == 0 ? 1 : 0, v = flat == 2 ? 1 : 2;
  const Projection projection(t, u, v);
  std::int32_t cell[3] = {range[0].first, range[1].first, range[2].first};
  for (cell[v] = range[v].first; cell[v] <= range[v].last; cell[v] += kTile) {
    for (cell[u] = range[u].first; cell[u] <= range[u].last; cell[u] += kTile) {
      const std::uint64_t squares = projection.tile(cell[u], cell[v], rows_from(cell[v], range[v]));
      // Moves the bits (v, u) into the tile's layer at the first cell of the flat axis.
      const std::uint64_t tile = flat == 2   ? squares
                                 : flat == 1 ? nibble_runs(squares) & 0x000f000f000f000fULL
                                             : nibbles(squares) & 0x1111111111111111ULL;
      boundary.put(tile & within(cell[0], cell[1], cell[2], range), cell[0], cell[1], cell[2]);
    }
  }
}

void mark_steep(const std::array<SnappedPoint, 3>& t, const Range* range, Marks& boundary) {
  const Projection xy(t, 0, 1), yz(t, 1, 2), xz(t, 0, 2);
  const Plane plane(t);
  const bool long_rows = range[0].last - range[0].first > 4 * kTile;
  for (std::int32_t z = range[2].first; z <= range[2].last; z += kTile) {
    for (std::int32_t y = range[1].first; y <= range[1].last; y += kTile) {
      const std::uint32_t m_yz = yz.tile(y, z, rows_from(z, range[2]));
      if (m_yz == 0) continue;
      const Range cells = long_rows ? plane.above(y, z, range[0]) : range[0];
      for (std::int32_t x = cells.first; x <= cells.last; x += kTile) {
        const std::uint64_t m_xy = xy.tile(x, y, rows_from(y, range[1]));
        const std::uint64_t m_xz = xz.tile(x, z, rows_from(z, range[2]));
        const std::uint64_t met =
            m_xy * 0x0001000100010001ULL & nibble_runs(m_xz) & nibbles(m_yz) & within(x, y, z, range);
        if (met != 0) boundary.put(met & plane.tile(x, y, z, met), x, y, z);
      }
    }
  }
}

void mark(const std::array<SnappedPoint, 3>& t, Slab slab, Marks& boundary) {
  Range range[3];
  int wide_axes = 0, flat = 0;
  for (int i = 0; i < 3; ++i) {
    const std::int32_t low = std::min({t[0][i], t[1][i], t[2][i]}),
                       high = std::max({t[0][i], t[1][i], t[2][i]});
    range[i] = {low >> kSubBits, high >> kSubBits};
    if (range[i].first != range[i].last) {
      ++wide_axes;
    } else {
      flat = i;
    }
    range[i].first = std::max(i == 2 ? slab.first : 0, range[i].first);
    range[i].last =
        std::min(i == 2 ? slab.last - 1 : boundary.size(static_cast<std::size_t>(i)) - 1, range[i].last);
    if (range[i].first > range[i].last) return;
  }
  if (wide_axes == 3) return mark_steep(t, range, boundary);
  if (wide_axes == 2) return mark_flat(t, range, flat, boundary);
  // A row of voxels. The triangle is connected, so it passes through each.
  for (std::int32_t z = range[2].first; z <= range[2].last; ++z) {
    for (std::int32_t y = range[1].first; y <= range[1].last; ++y) {
      for (std::int32_t x = range[0].first; x <= range[0].last; ++x) boundary.set(x, y, z);
    }
  }
}

void MarkAll(const SnappedMesh& mesh, Slab z, workspace::BitVolume& boundary,
             std::vector<std::uint32_t>& over) {
  Marks marks(boundary);
  const auto mark_one = [&](const Corners& corners) {
    mark({mesh.points[corners[0]], mesh.points[corners[1]], mesh.points[corners[2]]}, z, marks);
  };
  const auto mark_tile = [&](std::uint64_t tile, std::int32_t at_x, std::int32_t at_y, std::int32_t at_z) {
    marks.put(tile, at_x, at_y, at_z);
  };
  SmallTriangles small(mesh, z, boundary);
  const std::size_t step = SmallTriangles::at_once(), count = mesh.triangles.size();
  std::size_t found = 0;
  const auto mark_some = [&](const Corners* triangles, std::size_t first, std::size_t valid) {
    if (over.size() < found + step) over.resize(2 * found + 64 * step);
    found += small.mark(triangles, static_cast<std::uint32_t>(first), valid, over.data() + found, mark_tile,
                        mark_one);
  };
  std::size_t i = 0;
  for (; i + step <= count; i += step) {
    for (std::size_t next = i + 2 * step; next < std::min(i + 3 * step, count); ++next) {
      for (const std::uint32_t corner : mesh.triangles[next]) hwy::Prefetch(&mesh.points[corner]);
    }
    mark_some(&mesh.triangles[i], i, step);
  }
  if (i < count) {
    Corners rest[SmallTriangles::kMax];
    for (std::size_t lane = 0; lane < step; ++lane)
      rest[lane] = mesh.triangles[std::min(i + lane, count - 1)];
    mark_some(rest, i, count - i);
  }
  over.resize(found);
}

}  // namespace phantom::voxelise::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::voxelise::detail {

HWY_EXPORT(MarkAll);

void mark_triangles(const SnappedMesh& mesh, Slab z, workspace::BitVolume& boundary,
                    std::vector<std::uint32_t>& over) {
  HWY_DYNAMIC_DISPATCH(MarkAll)(mesh, z, boundary, over);
}

}  // namespace phantom::voxelise::detail
#endif
