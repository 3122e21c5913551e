#include <algorithm>
#include <array>
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
Edge make_edge(const SnappedPoint& from, const SnappedPoint& to, std::size_t u, std::size_t v,
               std::int64_t pu, std::int64_t pv) {
  Edge edge{};
  edge.du = std::int64_t{to[u]} - from[u];
  edge.dv = std::int64_t{to[v]} - from[v];
  edge.value = edge.du * (pv - from[v]) - edge.dv * (pu - from[u]);
  edge.bias = edge.dv > 0 || (edge.dv == 0 && edge.du > 0) ? 0 : -1;
  return edge;
}

/// First voxel whose centre is at or behind the crossing a0 + (e1·a1 + e2·a2) / area (a1, a2 relative to a0).
/// per_area: 1 / area.
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
  std::size_t a, u, v;
};

/// A line passes through a triangle: the first voxel whose centre is not before it, and by how much the
/// winding number changes there.
struct Crossing {
  std::uint32_t line;
  std::int32_t at;
  std::int32_t step;
};

struct Lines {
  std::int32_t size_a, size_u;
  Slab v;
};

/// Adds the triangle's crossings. Those before the box count at its first voxel, those behind it at size_a.
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
  // Seen along the line: counter-clockwise triangles face forwards, the line leaves there.
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
        crossings.push_back({static_cast<std::uint32_t>((j - lines.v.first) * lines.size_u + i),
                             static_cast<std::int32_t>(std::clamp<std::int64_t>(first, 0, lines.size_a)),
                             step});
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

/// What happens along one line: voxel and step, packed so that they sort by voxel.
using Event = std::int64_t;
Event event_of(const Crossing& c) { return (std::int64_t{c.at} << 2) + (c.step + 1); }
std::int32_t at_of(Event e) { return static_cast<std::int32_t>(e >> 2); }
std::int32_t step_of(Event e) { return static_cast<std::int32_t>(e & 3) - 1; }

/// Calls visit(line, events sorted by voxel) for each line that is crossed. `over`: the triangles that may;
/// null: all.
template <class Visit>
void for_each_line(const SnappedMesh& mesh, const std::vector<std::uint32_t>* over, const Axes& axes,
                   const Lines& lines, const Visit& visit) {
  std::vector<Crossing> crossings;
  const auto cross = [&](const Corners& t) {
    cross_triangle(mesh.points[t[0]], &mesh.points[t[1]], &mesh.points[t[2]], axes, lines, crossings);
  };
  if (over != nullptr) {
    constexpr std::size_t kAhead = 12;
    for (std::size_t i = 0; i < over->size(); ++i) {
      if (i + kAhead < over->size()) {
        for (const std::uint32_t corner : mesh.triangles[(*over)[i + kAhead]])
          __builtin_prefetch(&mesh.points[corner]);
      }
      cross(mesh.triangles[(*over)[i]]);
    }
  } else {
    for (const Corners& t : mesh.triangles) cross(t);
  }
  const std::size_t count =
      static_cast<std::size_t>(lines.size_u) * static_cast<std::size_t>(lines.v.last - lines.v.first);
  std::vector<std::uint32_t> start(count + 1, 0);
  for (const Crossing& c : crossings) ++start[c.line + 1];
  for (std::size_t i = 0; i < count; ++i) start[i + 1] += start[i];
  std::vector<Event> events(crossings.size());
  for (const Crossing& c : crossings) events[start[c.line]++] = event_of(c);
  for (std::uint32_t i = 0, from = 0; i < count; from = start[i++]) {
    if (start[i] == from) continue;
    const std::span<Event> here(events.data() + from, start[i] - from);
    if (here.size() == 2) {  // by far the most
      if (here[0] > here[1]) std::swap(here[0], here[1]);
    } else {
      std::sort(here.begin(), here.end());
    }
    visit(i, here);
  }
}

/// Calls visit(first, last) for each run of voxels [first, last) with a winding number that is not 0.
template <class Visit>
LineSigns for_each_run(std::span<const Event> events, std::int32_t size, const Visit& visit) {
  LineSigns signs;
  std::int32_t winding = 0, since = 0;
  for (std::size_t i = 0; i < events.size();) {
    const std::int32_t at = at_of(events[i]), before = winding;
    for (; i < events.size() && at_of(events[i]) == at; ++i) winding += step_of(events[i]);
    if (at >= size) {  // behind the box: what lasts until there is inside up to the box's end
      winding = before;
      break;
    }
    signs.positive |= winding > 0;
    signs.negative |= winding < 0;
    if (before == 0 && winding != 0) since = at;
    if (before != 0 && winding == 0) visit(since, at);
  }
  if (winding != 0) visit(since, size);
  return signs;
}

void set_run(std::uint64_t* row, std::int32_t first, std::int32_t last) {
  const std::int32_t from = first >> 6, to = (last - 1) >> 6;
  const std::uint64_t head = ~std::uint64_t{0} << (first & 63),
                      tail = ~std::uint64_t{0} >> (63 - ((last - 1) & 63));
  if (from == to) {
    row[from] |= head & tail;
    return;
  }
  row[from] |= head;
  std::fill(row + from + 1, row + to, ~std::uint64_t{0});
  row[to] |= tail;
}

/// Each bit becomes the parity of the bits up to it along y or z, 64 lines at once.
void accumulate(int axis, BitVolume& volume) {
  for (std::int32_t z = axis == 2 ? 1 : 0; z < volume.size()[2]; ++z) {
    for (std::int32_t y = axis == 1 ? 1 : 0; y < volume.size()[1]; ++y) {
      std::uint64_t* row = volume.row(y, z);
      const std::uint64_t* before = axis == 1 ? volume.row(y - 1, z) : volume.row(y, z - 1);
      for (std::size_t i = 0; i < volume.words_per_row(); ++i) row[i] ^= before[i];
    }
  }
}

}  // namespace

LineSigns fill_inside(const SnappedMesh& mesh, const std::vector<std::uint32_t>* over, Slab z,
                      BitVolume& inside) {
  const Lines lines{inside.size()[0], inside.size()[1], z};
  LineSigns all;
  for_each_line(mesh, over, {0, 1, 2}, lines, [&](std::size_t line, std::span<const Event> events) {
    const auto index = static_cast<std::int32_t>(line);
    std::uint64_t* row = inside.row(index % lines.size_u, z.first + index / lines.size_u);
    const LineSigns signs = for_each_run(
        events, lines.size_a, [&](std::int32_t first, std::int32_t last) { set_run(row, first, last); });
    all.positive |= signs.positive;
    all.negative |= signs.negative;
  });
  return all;
}

void fill_inside_along(int axis, const SnappedMesh& mesh, BitVolume& inside, BitVolume& silent) {
  const auto a = static_cast<std::size_t>(axis), u = (a + 1) % 3, v = (a + 2) % 3;
  const auto& size = inside.size();
  const Lines lines{size[a], size[u], {0, size[v]}};
  for_each_line(mesh, nullptr, {a, u, v}, lines, [&](std::size_t line, std::span<const Event> events) {
    std::int32_t voxel[3] = {};
    voxel[u] = static_cast<std::int32_t>(line) % lines.size_u;
    voxel[v] = static_cast<std::int32_t>(line) / lines.size_u;
    std::int32_t sum = 0;
    for (const Event event : events) sum += step_of(event);
    if (sum != 0) {
      silent.set(voxel[axis == 0 ? 1 : 0], voxel[axis == 2 ? 1 : 2], 0);
      return;
    }
    for_each_run(events, lines.size_a, [&](std::int32_t first, std::int32_t last) {
      if (axis == 0) return set_run(inside.row(voxel[1], voxel[2]), first, last);
      for (const std::int32_t end : {first, last}) {
        voxel[a] = end;
        if (end < lines.size_a) inside.flip(voxel[0], voxel[1], voxel[2]);
      }
    });
  });
  if (axis != 0) accumulate(axis, inside);
}

}  // namespace phantom::voxel::detail
