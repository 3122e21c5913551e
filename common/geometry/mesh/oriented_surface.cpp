#include <cstdint>
#include <numeric>
#include <span>

#include "common/geometry/mesh/mesh_topology.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/geometry/mesh/oriented_surface.cpp"
#include <hwy/foreach_target.h>  // once per instruction set
// (keep this order)
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::geometry::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<std::uint64_t> kNames;
constexpr hn::Rebind<std::uint32_t, decltype(kNames)> kCorners;
using Names = hn::Vec<decltype(kNames)>;
using CornersOf = hn::Vec<decltype(kCorners)>;

/// Returns an edge's random weight, which does not depend on its direction.
HWY_INLINE Names weight(Names low, Names high) {
  auto h = hn::Add(hn::Or(hn::ShiftLeft<32>(low), high), hn::Set(kNames, 1));
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<31>(h)), hn::Set(kNames, 0x9e3779b97f4a7c15ULL));
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<29>(h)), hn::Set(kNames, 0xd6e8feb86659fd93ULL));
  return hn::Xor(h, hn::ShiftRight<32>(h));
}

/// Sums the weights of all edges. Edges that run from the higher to the lower vertex count negative.
std::uint64_t SumOfWeights(std::span<const Triangle> triangles) {
  auto sum = hn::Zero(kNames);
  const auto add = [&](CornersOf from, CornersOf to) HWY_ATTR {
    const auto a = hn::PromoteTo(kNames, from), b = hn::PromoteTo(kNames, to);
    const auto w = weight(hn::Min(a, b), hn::Max(a, b));
    sum = hn::Add(sum, hn::IfThenElse(hn::Lt(a, b), w, hn::Sub(hn::Zero(kNames), w)));
  };
  const std::size_t lanes = hn::Lanes(kCorners), whole = triangles.size() / lanes * lanes;
  CornersOf a, b, c;
  for (std::size_t i = 0; i < whole; i += lanes) {
    hn::LoadInterleaved3(kCorners, triangles[i].data(), a, b, c);
    add(a, b);
    add(b, c);
    add(c, a);
  }
  // Summed lane by lane, because only unsigned sums may wrap.
  alignas(64) std::uint64_t lane[hn::MaxLanes(kNames)];
  hn::Store(sum, kNames, lane);
  std::uint64_t all = std::accumulate(lane, lane + hn::Lanes(kNames), std::uint64_t{0});
  sum = hn::Zero(kNames);
  for (std::size_t i = whole; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      sum = hn::Zero(kNames);
      add(hn::Set(kCorners, t[k]), hn::Set(kCorners, t[k == 2 ? 0 : k + 1]));
      all += hn::GetLane(sum);
    }
  }
  return all;
}

}  // namespace phantom::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::geometry {

HWY_EXPORT(SumOfWeights);

bool is_oriented_surface(std::span<const Triangle> triangles) {
  return HWY_DYNAMIC_DISPATCH(SumOfWeights)(triangles) == 0;
}

}  // namespace phantom::geometry
#endif
