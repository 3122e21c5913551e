#include "common/voxelise/line_crossings.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/voxelise/line_crossings.cpp"
#include <hwy/foreach_target.h>  // once per instruction set
// (keep this order)
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "common/voxelise/corner_lanes-inl.hpp"
#include "common/voxelise/cross_few-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace phantom::voxelise::detail::HWY_NAMESPACE {

/// Writes the crossings of triangles that reach over few lines, and the corners of all other triangles into
/// `others`.
void CrossFew(const SnappedMesh& mesh, const std::vector<std::uint32_t>* over, const Axes& axes,
              const Lines& lines, workspace::LargeVector<Crossing>& crossings, std::vector<Corners>& others) {
  FewLines few(mesh, axes, lines);
  const std::size_t step = FewLines::at_once(),
                    count = over != nullptr ? over->size() : mesh.triangles.size();
  const auto number = [over](std::size_t i) { return over != nullptr ? (*over)[i] : i; };
  std::size_t found = 0;
  for (std::size_t first = 0; first < count; first += step) {
    for (std::size_t i = first + step; i < std::min(first + 2 * step, count); ++i) {
      for (const std::uint32_t corner : mesh.triangles[number(i)]) hwy::Prefetch(&mesh.points[corner]);
    }
    if (crossings.size() < found + FewLines::kMaxCrossings)
      crossings.resize(2 * found + 64 * FewLines::kMaxCrossings);
    const Crossing* const end =
        few.cross([&](std::size_t lane) { return number(std::min(first + lane, count - 1)); },
                  std::min(step, count - first), crossings.data() + found,
                  [&](const Corners& triangle) { others.push_back(triangle); });
    found = static_cast<std::size_t>(end - crossings.data());
  }
  crossings.resize(found);
}

}  // namespace phantom::voxelise::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::voxelise::detail {

HWY_EXPORT(CrossFew);

namespace {

/// An edge function: > 0 at lines to the left of the edge.
struct Edge {
  std::int64_t du, dv, value,
      bias;  // value at the current line; bias −1 if a line exactly on the edge belongs to the other triangle
};

constexpr std::int64_t kHalf = kSub / 2;

std::int64_t floor_div_sub(std::int64_t a) { return a >> kSubBits; }

Edge make_edge(const SnappedPoint& from, const SnappedPoint& to, std::size_t u, std::size_t v,
               std::int64_t pu, std::int64_t pv) {
  Edge edge{};
  edge.du = std::int64_t{to[u]} - from[u];
  edge.dv = std::int64_t{to[v]} - from[v];
  edge.value = edge.du * (pv - from[v]) - edge.dv * (pu - from[u]);
  edge.bias = edge.dv > 0 || (edge.dv == 0 && edge.du > 0) ? 0 : -1;
  return edge;
}

/// Returns the same as first_behind_exactly(), which is called only where doubles might be wrong. per_area: 1
/// / area.
std::int64_t first_behind(std::int64_t a0, std::int64_t a1, std::int64_t a2, std::int64_t e1, std::int64_t e2,
                          std::int64_t area, double per_area) {
  const double crossing = static_cast<double>(a0) +
                          (static_cast<double>(e1) * per_area) * static_cast<double>(a1) +
                          (static_cast<double>(e2) * per_area) * static_cast<double>(a2);
  const double voxels = (crossing - kHalf) / kSub;
  const auto below = static_cast<std::int64_t>(voxels) - (voxels < 0 ? 1 : 0);  // floor, or one less
  const double above_it = voxels - static_cast<double>(below);                  // 0…2
  if (above_it > 1e-6 && above_it < 1.0 - 1e-6) return below + 1;
  if (above_it > 1.0 + 1e-6 && above_it < 2.0 - 1e-6) return below + 2;
  return first_behind_exactly(a0, a1, a2, e1, e2, area);
}

/// Adds the triangle's crossings, at most one per line over which it reaches.
void cross_triangle(const SnappedPoint& p0, const SnappedPoint* p1, const SnappedPoint* p2, const Axes& axes,
                    const Lines& lines, std::vector<Crossing>& crossings) {
  const auto [a, u, v] = axes;
  const auto range = [&](std::size_t axis, std::int64_t low_line, std::int64_t high_line, std::int64_t& first,
                         std::int64_t& last) {
    const auto [low, high] = std::minmax({p0[axis], (*p1)[axis], (*p2)[axis]});
    first = std::max(low_line, floor_div_sub(low - kHalf + kSub - 1));
    last = std::min(high_line, floor_div_sub(high - kHalf));
    return first <= last;
  };
  std::int64_t u_first, u_last, v_first, v_last;
  if (!range(v, lines.v.first, lines.v.last - 1, v_first, v_last)) return;
  if (!range(u, 0, lines.size_u - 1, u_first, u_last)) return;
  std::int64_t area = (std::int64_t{(*p1)[u]} - p0[u]) * (std::int64_t{(*p2)[v]} - p0[v]) -
                      (std::int64_t{(*p2)[u]} - p0[u]) * (std::int64_t{(*p1)[v]} - p0[v]);
  if (area == 0) return;
  // Triangles that are counter-clockwise seen along the line face forwards: the line leaves the solid there.
  const std::int32_t step = area > 0 ? -1 : 1;
  if (area < 0) {
    std::swap(p1, p2);
    area = -area;
  }
  const double per_area = 1.0 / static_cast<double>(area);
  const std::int64_t pu = u_first * kSub + kHalf, pv = v_first * kSub + kHalf;
  Edge e0 = make_edge(*p1, *p2, u, v, pu, pv);  // opposite p0
  Edge e1 = make_edge(*p2, p0, u, v, pu, pv);
  Edge e2 = make_edge(p0, *p1, u, v, pu, pv);
  const std::int64_t a0 = p0[a], a1 = (*p1)[a] - a0, a2 = (*p2)[a] - a0;
  for (std::int64_t j = v_first; j <= v_last; ++j) {
    std::int64_t w0 = e0.value + e0.bias, w1 = e1.value + e1.bias, w2 = e2.value + e2.bias;
    for (std::int64_t i = u_first; i <= u_last; ++i) {
      if ((w0 | w1 | w2) >= 0) {
        const std::int64_t first = first_behind(a0, a1, a2, w1 - e1.bias, w2 - e2.bias, area, per_area);
        const auto at = static_cast<std::int32_t>(std::clamp<std::int64_t>(first, 0, lines.size_a));
        crossings.push_back({Crossing::event_of(at, step),
                             static_cast<std::uint32_t>((j - lines.v.first) * lines.size_u + i)});
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

std::int64_t first_behind_exactly(std::int64_t a0, std::int64_t a1, std::int64_t a2, std::int64_t e1,
                                  std::int64_t e2, std::int64_t area) {
  __extension__ using Wide = __int128;
  const Wide numerator =
      static_cast<Wide>(a0 - kHalf) * area + static_cast<Wide>(e1) * a1 + static_cast<Wide>(e2) * a2;
  const Wide denominator = static_cast<Wide>(area) * kSub;
  Wide quotient = numerator / denominator;
  if (quotient * denominator < numerator) ++quotient;
  return static_cast<std::int64_t>(quotient);
}

workspace::LargeVector<Crossing> cross_lines(const SnappedMesh& mesh, const std::vector<std::uint32_t>* over,
                                             const Axes& axes, const Lines& lines) {
  workspace::LargeVector<Crossing> crossings;
  std::vector<Corners> others;
  HWY_DYNAMIC_DISPATCH(CrossFew)(mesh, over, axes, lines, crossings, others);
  std::vector<Crossing> of_others;
  for (const Corners& t : others)
    cross_triangle(mesh.points[t[0]], &mesh.points[t[1]], &mesh.points[t[2]], axes, lines, of_others);
  crossings.insert(crossings.end(), of_others.begin(), of_others.end());
  return crossings;
}

}  // namespace phantom::voxelise::detail
#endif
