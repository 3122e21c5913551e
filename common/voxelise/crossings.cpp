#include <algorithm>
#include <array>

#include "common/voxelise/line_crossings.hpp"

namespace phantom::voxelise::detail {
namespace {

using Event = std::int32_t;  // see Crossing::event

/// Calls visit(u, v, events sorted by voxel) for each line that is crossed. `over`: the triangles that may
/// cross; null: all.
template <class Visit>
void for_each_line(const SnappedMesh& mesh, const std::vector<std::uint32_t>* over, const Axes& axes,
                   const Lines& lines, const Visit& visit) {
  const workspace::LargeVector<Crossing> crossings = cross_lines(mesh, over, axes, lines);
  const std::size_t count =
      static_cast<std::size_t>(lines.size_u) * static_cast<std::size_t>(lines.v.last - lines.v.first);
  std::vector<std::uint32_t> start(count + 1, 0);
  for (const Crossing& c : crossings) ++start[c.line + 1];
  for (std::size_t i = 0; i < count; ++i) start[i + 1] += start[i];
  workspace::LargeVector<Event> events(crossings.size());
  for (const Crossing& c : crossings) events[start[c.line]++] = c.event;
  std::uint32_t from = 0;
  const std::uint32_t* end = start.data();
  for (std::int32_t v = lines.v.first; v < lines.v.last; ++v) {
    for (std::int32_t u = 0; u < lines.size_u; ++u, from = *end++) {
      if (*end == from) continue;
      const std::span<Event> here(events.data() + from, *end - from);
      if (here.size() == 2) {  // by far the most frequent case
        if (here[0] > here[1]) std::swap(here[0], here[1]);
      } else {
        std::sort(here.begin(), here.end());
      }
      visit(u, v, here);
    }
  }
}

/// Calls visit(first, last) for each run of voxels [first, last) whose winding number is not 0.
template <class Visit>
LineSigns for_each_run(std::span<const Event> events, std::int32_t size, const Visit& visit) {
  LineSigns signs;
  std::int32_t winding = 0, since = 0;
  for (std::size_t i = 0; i < events.size();) {
    const std::int32_t at = Crossing::at(events[i]), before = winding;
    for (; i < events.size() && Crossing::at(events[i]) == at; ++i) winding += Crossing::step(events[i]);
    if (at >= size) {  // behind the box: a run that lasts until here is inside up to the box's end
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

/// Replaces each bit by the parity of the bits up to it along y or z, for 64 lines at once.
void accumulate(int axis, workspace::BitVolume& volume) {
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
                      workspace::BitVolume& inside) {
  const Lines lines{inside.size()[0], inside.size()[1], z};
  LineSigns all;
  for_each_line(
      mesh, over, {0, 1, 2}, lines, [&](std::int32_t u, std::int32_t v, std::span<const Event> events) {
        const LineSigns signs =
            for_each_run(events, lines.size_a,
                         [&](std::int32_t first, std::int32_t last) { inside.set_run(u, v, first, last); });
        all.positive |= signs.positive;
        all.negative |= signs.negative;
      });
  return all;
}

void fill_inside_along(int axis, const SnappedMesh& mesh, workspace::BitVolume& inside,
                       workspace::BitVolume& unbalanced) {
  const auto a = static_cast<std::size_t>(axis), u = (a + 1) % 3, v = (a + 2) % 3;
  const auto& size = inside.size();
  const Lines lines{size[a], size[u], {0, size[v]}};
  for_each_line(mesh, nullptr, {a, u, v}, lines,
                [&](std::int32_t at_u, std::int32_t at_v, std::span<const Event> events) {
                  std::int32_t voxel[3] = {};
                  voxel[u] = at_u;
                  voxel[v] = at_v;
                  std::int32_t sum = 0;
                  for (const Event event : events) sum += Crossing::step(event);
                  if (sum != 0) {
                    unbalanced.set(voxel[axis == 0 ? 1 : 0], voxel[axis == 2 ? 1 : 2], 0);
                    return;
                  }
                  for_each_run(events, lines.size_a, [&](std::int32_t first, std::int32_t last) {
                    if (axis == 0) return inside.set_run(voxel[1], voxel[2], first, last);
                    for (const std::int32_t end : {first, last}) {
                      voxel[a] = end;
                      if (end < lines.size_a) inside.flip(voxel[0], voxel[1], voxel[2]);
                    }
                  });
                });
  if (axis != 0) accumulate(axis, inside);
}

}  // namespace phantom::voxelise::detail
