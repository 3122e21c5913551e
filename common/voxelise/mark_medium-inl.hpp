// Private to mark_triangles.cpp, which includes it after corner_lanes-inl.hpp, once for each instruction set
// (it has no guard): tests of triangles against tiles of 4 × 4 × 4 voxels, prepared for one vector of
// triangles.

#include <hwy/highway.h>

#include <cstddef>

#include "common/voxelise/snapped_mesh.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::voxelise::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kTile = 4;

struct Range {
  std::int32_t first, last;
};

/// Expands each of 16 bits to a nibble.
HWY_INLINE std::uint64_t nibbles(std::uint64_t bits) {
  bits = (bits | bits << 24) & 0x000000ff000000ffULL;
  bits = (bits | bits << 12) & 0x000f000f000f000fULL;
  bits = (bits | bits << 6) & 0x0303030303030303ULL;
  bits = (bits | bits << 3) & 0x1111111111111111ULL;
  return bits * 0xf;
}

/// Repeats each of 4 nibbles four times.
HWY_INLINE std::uint64_t nibble_runs(std::uint64_t bits) {
  bits = (bits | bits << 24) & 0x000000ff000000ffULL;
  bits = (bits | bits << 12) & 0x000f000f000f000fULL;
  return bits * 0x1111;
}

/// Returns the voxels of a tile that lie within the ranges.
HWY_INLINE std::uint64_t within(std::int32_t x, std::int32_t y, std::int32_t z, const Range* range) {
  const auto ones = [](std::int32_t count) { return (1U << std::min(count, kTile)) - 1U; };
  const std::uint64_t in_row = ones(range[0].last - x + 1);
  const std::uint64_t rows = ones(range[1].last - y + 1);  // of one layer
  const std::uint64_t layers = ones(range[2].last - z + 1);
  return (in_row * 0x1111111111111111ULL) & (nibbles(rows) & 0xffff) * 0x0001000100010001ULL &
         nibble_runs(nibbles(layers) & 0xffff);
}

// Coordinates of the squares of a tile's side, at bit 4 v + u.
alignas(64) constexpr double kSquareU[16] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
alignas(64) constexpr double kSquareV[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

/// Tests medium triangles, in coordinates below 2¹⁷ from the corner of their first voxel. All values are
/// whole numbers below 2⁵³, which a double represents exactly. The thirteen separating directions are those
/// of larger triangles (mark_triangles.cpp).
class MediumTriangles {
 public:
  /// Prepares the tests of `count` triangles, a multiple of the vector length; at[corner][axis][triangle].
  void prepare(const CornerLanes& at, std::size_t count) {
    const hn::Rebind<std::int32_t, decltype(kDoubles)> ints;
    for (std::size_t i = 0; i < count; i += hn::Lanes(kDoubles)) {
      Doubles p[3][3], edge[3][3], normal[3];
      for (std::size_t corner = 0; corner < 3; ++corner) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          p[corner][axis] = hn::PromoteTo(kDoubles, hn::Load(ints, at[corner][axis] + i));
      }
      for (std::size_t corner = 0; corner < 3; ++corner) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          edge[corner][axis] = hn::Sub(p[(corner + 1) % 3][axis], p[corner][axis]);
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
        normal[axis] = hn::Sub(hn::Mul(edge[0][j], edge[1][k]), hn::Mul(edge[0][k], edge[1][j]));
      }
      prepare_plane(p[0], normal, i);
      prepare_projection(projections_[0], 0, 1, normal[2], p, edge, i);
      prepare_projection(projections_[1], 1, 2, normal[0], p, edge, i);
      prepare_projection(projections_[2], 0, 2, hn::Neg(normal[1]), p, edge, i);
    }
  }

  /// Returns the squares of a tile's side, which begins at the square (u, v), that the triangle's projection
  /// (its projection) on the plane xy, yz or xz meets.
  HWY_INLINE std::uint32_t squares(std::size_t plane, std::size_t triangle, std::int32_t at_u,
                                   std::int32_t at_v) const {
    const auto first_u = hn::Set(kRow, static_cast<double>(at_u)),
               first_v = hn::Set(kRow, static_cast<double>(at_v));
    const Projection& projection = projections_[plane];
    std::uint32_t outside = 0;
    for (std::size_t part = 0; part < 16; part += hn::Lanes(kRow)) {
      const auto u = hn::Add(hn::Load(kRow, kSquareU + part), first_u),
                 v = hn::Add(hn::Load(kRow, kSquareV + part), first_v);
      const auto value = [&](std::size_t i) HWY_ATTR {
        const Edge& e = projection.edges[i];
        return hn::MulAdd(
            u, hn::Set(kRow, e.step_u[triangle]),
            hn::MulAdd(v, hn::Set(kRow, e.step_v[triangle]), hn::Set(kRow, e.at_origin[triangle])));
      };
      const auto least = hn::Min(value(0), hn::Min(value(1), value(2)));
      outside |= bits_of(hn::Lt(least, hn::Zero(kRow))) << part;
    }
    return ~outside & 0xffff;
  }

  /// Returns the voxels of the tile, which begins at the voxel (x, y, z), through which the triangle's plane
  /// passes: bit 16 dz + 4 dy + dx.
  HWY_INLINE std::uint64_t passed(std::size_t triangle, std::int32_t x, std::int32_t y,
                                  std::int32_t z) const {
    const auto step_x = hn::Set(kRow, step_[0][triangle]), step_y = hn::Set(kRow, step_[1][triangle]),
               step_z = hn::Set(kRow, step_[2][triangle]);
    const auto first = hn::Set(kRow, low_[triangle] + x * step_[0][triangle] + y * step_[1][triangle] +
                                         z * step_[2][triangle]),
               span = hn::Set(kRow, span_[triangle]);
    const auto zero = hn::Zero(kRow);
    std::uint64_t meets = 0;
    for (std::size_t part = 0; part < 16; part += hn::Lanes(kRow)) {
      auto low = hn::MulAdd(hn::Load(kRow, kSquareU + part), step_x,
                            hn::MulAdd(hn::Load(kRow, kSquareV + part), step_y, first));
      for (std::size_t dz = 0; dz < 4; ++dz) {
        const auto both = hn::And(hn::Le(low, zero), hn::Ge(hn::Add(low, span), zero));
        meets |= std::uint64_t{bits_of(both)} << (16 * dz + part);
        low = hn::Add(low, step_z);
      }
    }
    return meets;
  }

 private:
  static constexpr hn::ScalableTag<double> kDoubles{};
  static constexpr hn::CappedTag<double, 8> kRow{};  // its masks fit in a byte
  using Doubles = hn::Vec<decltype(kDoubles)>;
  struct Edge {
    alignas(64) double step_u[kMaxLanes], step_v[kMaxLanes], at_origin[kMaxLanes];
  };
  struct Projection {
    Edge edges[3];
  };

  template <class Mask>
  static HWY_INLINE std::uint32_t bits_of(const Mask& mask) {
    std::uint8_t bits[8];
    hn::StoreMaskBits(kRow, mask, bits);
    return bits[0];
  }

  HWY_INLINE void prepare_plane(const Doubles origin[3], const Doubles normal[3], std::size_t i) {
    const auto zero = hn::Zero(kDoubles), whole = hn::Set(kDoubles, static_cast<double>(kSub));
    auto low = zero, span = zero;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto step = hn::Mul(normal[axis], whole);
      low = hn::Add(hn::Sub(low, hn::Mul(normal[axis], origin[axis])), hn::Min(zero, step));
      span = hn::Add(span, hn::Abs(step));
      hn::Store(step, kDoubles, step_[axis] + i);
    }
    hn::Store(low, kDoubles, low_ + i);
    hn::Store(span, kDoubles, span_ + i);
  }

  /// Prepares the edge tests of a projection. `area`: negative if the projection lies on the right of its
  /// edges, which are reversed then. A projection without area is a segment whose edges run both ways.
  HWY_INLINE void prepare_projection(Projection& projection, std::size_t u, std::size_t v,
                                     const Doubles& area, const Doubles p[3][3], const Doubles edge[3][3],
                                     std::size_t i) {
    const auto zero = hn::Zero(kDoubles), whole = hn::Set(kDoubles, static_cast<double>(kSub));
    const auto turned = hn::Lt(area, zero);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto du = hn::IfThenElse(turned, hn::Neg(edge[k][u]), edge[k][u]),
                 dv = hn::IfThenElse(turned, hn::Neg(edge[k][v]), edge[k][v]);
      const auto step_u = hn::Neg(hn::Mul(dv, whole)), step_v = hn::Mul(du, whole);
      const auto from = hn::Sub(hn::Mul(dv, p[k][u]), hn::Mul(du, p[k][v]));
      hn::Store(step_u, kDoubles, projection.edges[k].step_u + i);
      hn::Store(step_v, kDoubles, projection.edges[k].step_v + i);
      // The value at the square's corner that lies farthest to the left of the edge.
      hn::Store(hn::Add(from, hn::Add(hn::Max(zero, step_u), hn::Max(zero, step_v))), kDoubles,
                projection.edges[k].at_origin + i);
    }
  }

  Projection projections_[3];
  alignas(64) double step_[3][kMaxLanes], low_[kMaxLanes], span_[kMaxLanes];
};

}  // namespace phantom::voxelise::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
