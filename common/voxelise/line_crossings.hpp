#pragma once

// Private to this library: finds where triangles cross the lines through voxel centres along one axis.

#include <cstdint>
#include <vector>

#include "common/voxelise/snapped_mesh.hpp"

namespace phantom::voxelise::detail {

/// The lines run along axis a; u and v are the next axes in cyclic order.
struct Axes {
  std::size_t a, u, v;
};

/// The lines to look at, and their length in voxels.
struct Lines {
  std::int32_t size_a, size_u;
  Slab v;
};

/// A crossing of a line and a triangle: the first voxel whose centre is not before it, and the change of the
/// winding number there. Crossings before the box count at its first voxel, those behind it at size_a.
struct Crossing {
  std::int32_t event;  ///< voxel and change in one number, which sorts by voxel
  std::uint32_t line;  ///< number of the line, u running faster than v

  static constexpr std::int32_t event_of(std::int32_t at, std::int32_t step) { return at * 4 + step + 1; }
  static constexpr std::int32_t at(std::int32_t event) { return event >> 2; }
  static constexpr std::int32_t step(std::int32_t event) { return (event & 3) - 1; }
};
static_assert(kReach / kSub <= INT32_MAX / 16, "a box ends within reach on both sides");

/// Returns all crossings, in no particular order. A line through a shared edge crosses exactly one of the two
/// adjacent triangles, as if every line were shifted by (−ε, ε²) in (u, v). `over`: the triangles that may
/// cross; null: all.
workspace::LargeVector<Crossing> cross_lines(const SnappedMesh& mesh, const std::vector<std::uint32_t>* over,
                                             const Axes& axes, const Lines& lines);

/// Returns the first voxel whose centre is at or behind the crossing a0 + (e1·a1 + e2·a2) / area (a1, a2
/// relative to a0), without rounding.
std::int64_t first_behind_exactly(std::int64_t a0, std::int64_t a1, std::int64_t a2, std::int64_t e1,
                                  std::int64_t e2, std::int64_t area);

}  // namespace phantom::voxelise::detail
