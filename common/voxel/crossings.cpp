#include <algorithm>
#include <cmath>

#include "common/voxel/snapped_mesh.hpp"

namespace phantom::voxel::detail {
namespace {

/// Value of the edge function at a line: > 0 to the left of the edge.
struct Edge {
  std::int64_t du, dv, value,
      bias;  // value at the current line; bias −1 if a line right on the edge is not ours
};

constexpr std::int64_t kHalf = kSub / 2;

std::int64_t floor_div_sub(std::int64_t a) { return a >> kSubBits; }

/// Lines through a shared edge belong to exactly one of the two triangles beside it: as if every line were
/// shifted by (−ε, ε²) in (u, v).
Edge make_edge(const SnappedPoint& from, const SnappedPoint& to, int u, int v, std::int64_t pu,
               std::int64_t pv) {
  Edge edge{};
  edge.du = to[u] - from[u];
  edge.dv = to[v] - from[v];
  edge.value = edge.du * (pv - from[v]) - edge.dv * (pu - from[u]);
  edge.bias = edge.dv > 0 || (edge.dv == 0 && edge.du > 0) ? 0 : -1;
  return edge;
}

/// First voxel whose centre is at or behind the crossing a0 + (e1·a1 + e2·a2) / area (a1, a2 relative to a0).
std::int64_t first_behind(std::int64_t a0, std::int64_t a1, std::int64_t a2, std::int64_t e1, std::int64_t e2,
                          std::int64_t area) {
  const double crossing = static_cast<double>(a0) +
                          (static_cast<double>(e1) / static_cast<double>(area)) * static_cast<double>(a1) +
                          (static_cast<double>(e2) / static_cast<double>(area)) * static_cast<double>(a2);
  const double voxels = (crossing - kHalf) / kSub;
  const double up = std::ceil(voxels);
  const double nearest = std::nearbyint(voxels);
  if (std::abs(voxels - nearest) > 1e-6) return static_cast<std::int64_t>(up);
  // Right at a centre: decide without rounding.
  __extension__ using Wide = __int128;
  const Wide numerator =
      static_cast<Wide>(a0 - kHalf) * area + static_cast<Wide>(e1) * a1 + static_cast<Wide>(e2) * a2;
  const Wide denominator = static_cast<Wide>(area) * kSub;
  Wide quotient = numerator / denominator;
  if (quotient * denominator < numerator) ++quotient;
  return static_cast<std::int64_t>(quotient);
}

struct Axes {
  int a, u, v;
};

void toggle(BitVolume& toggles, int axis, std::int64_t a, std::int64_t u, std::int64_t v) {
  const auto i = static_cast<std::int32_t>(a), j = static_cast<std::int32_t>(u),
             k = static_cast<std::int32_t>(v);
  if (axis == 0) toggles.flip(i, j, k);
  if (axis == 1) toggles.flip(k, i, j);
  if (axis == 2) toggles.flip(j, k, i);
}

void toggle_triangle(const SnappedTriangle& triangle, const Axes& axes, BitVolume& toggles,
                     BitVolume& parity) {
  const auto [a, u, v] = axes;
  const SnappedPoint& p0 = triangle[0];
  const SnappedPoint* p1 = &triangle[1];
  const SnappedPoint* p2 = &triangle[2];
  std::int64_t area = ((*p1)[u] - p0[u]) * ((*p2)[v] - p0[v]) - ((*p2)[u] - p0[u]) * ((*p1)[v] - p0[v]);
  if (area == 0) return;
  if (area < 0) {
    std::swap(p1, p2);
    area = -area;
  }
  const auto range = [&](int axis, std::int64_t& first, std::int64_t& last) {
    const auto [low, high] = std::minmax({p0[axis], (*p1)[axis], (*p2)[axis]});
    first = std::max<std::int64_t>(0, floor_div_sub(low - kHalf + kSub - 1));
    last = std::min<std::int64_t>(toggles.size()[static_cast<std::size_t>(axis)] - 1,
                                  floor_div_sub(high - kHalf));
  };
  std::int64_t u_first, u_last, v_first, v_last;
  range(u, u_first, u_last);
  range(v, v_first, v_last);
  if (u_first > u_last || v_first > v_last) return;

  const std::int64_t pu = u_first * kSub + kHalf, pv = v_first * kSub + kHalf;
  Edge e0 = make_edge(*p1, *p2, u, v, pu, pv);  // opposite p0
  Edge e1 = make_edge(*p2, p0, u, v, pu, pv);
  Edge e2 = make_edge(p0, *p1, u, v, pu, pv);
  const std::int64_t a0 = p0[a], a1 = (*p1)[a] - a0, a2 = (*p2)[a] - a0;
  const std::int64_t size_a = toggles.size()[static_cast<std::size_t>(a)];
  for (std::int64_t j = v_first; j <= v_last; ++j) {
    std::int64_t w0 = e0.value, w1 = e1.value, w2 = e2.value;
    for (std::int64_t i = u_first; i <= u_last; ++i) {
      if (w0 + e0.bias >= 0 && w1 + e1.bias >= 0 && w2 + e2.bias >= 0) {
        const std::int64_t first = std::max<std::int64_t>(0, first_behind(a0, a1, a2, w1, w2, area));
        if (first < size_a) toggle(toggles, a, first, i, j);
        parity.flip(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j), 0);
      }
      w0 -= e0.dv * kSub;
      w1 -= e1.dv * kSub;
      w2 -= e2.dv * kSub;
    }
    e0.value += e0.du * kSub;
    e1.value += e1.du * kSub;
    e2.value += e2.du * kSub;
  }
}

}  // namespace

void toggle_crossings(const std::vector<SnappedTriangle>& triangles, int axis, BitVolume& toggles,
                      BitVolume& parity) {
  const Axes axes{axis, (axis + 1) % 3, (axis + 2) % 3};
  for (const SnappedTriangle& triangle : triangles) toggle_triangle(triangle, axes, toggles, parity);
}

}  // namespace phantom::voxel::detail
