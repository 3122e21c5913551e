// Private to this library: loads the corners of several triangles into vectors, one triangle per lane. A
// source includes it once for each instruction set, so it has no guard.

#include <hwy/highway.h>

#include <cstddef>
#include <vector>

#include "common/voxelise/snapped_mesh.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::voxelise::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<std::int32_t> kInts;

/// Greatest number of triangles per vector, for array sizes; the actual number is Lanes(kInts).
constexpr std::size_t kMaxLanes = hn::MaxLanes(kInts);
using CornerLanes = std::int32_t[3][3][kMaxLanes];  // [corner][axis], each one aligned vector

/// Loads the corners of triangle(0), triangle(1), …
template <class TriangleAt>
HWY_INLINE void load_corners(const std::vector<SnappedPoint>& points, const TriangleAt& triangle,
                             CornerLanes& at) {
  const hn::FixedTag<std::int32_t, 4> point;
  const hn::Repartition<std::int64_t, decltype(point)> pairs;
  for (std::size_t lane = 0; lane < hn::Lanes(kInts); lane += 4) {
    const Corners four[4] = {triangle(lane), triangle(lane + 1), triangle(lane + 2), triangle(lane + 3)};
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto load = [&](std::size_t i)
                            HWY_ATTR { return hn::Load(point, points[four[i][corner]].data()); };
      const auto a = load(0), b = load(1), c = load(2), d = load(3);
      const auto low_ab = hn::BitCast(pairs, hn::InterleaveLower(point, a, b)),
                 low_cd = hn::BitCast(pairs, hn::InterleaveLower(point, c, d)),
                 high_ab = hn::BitCast(pairs, hn::InterleaveUpper(point, a, b)),
                 high_cd = hn::BitCast(pairs, hn::InterleaveUpper(point, c, d));
      hn::Store(hn::BitCast(point, hn::InterleaveLower(pairs, low_ab, low_cd)), point, at[corner][0] + lane);
      hn::Store(hn::BitCast(point, hn::InterleaveUpper(pairs, low_ab, low_cd)), point, at[corner][1] + lane);
      hn::Store(hn::BitCast(point, hn::InterleaveLower(pairs, high_ab, high_cd)), point,
                at[corner][2] + lane);
    }
  }
}

}  // namespace phantom::voxelise::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
