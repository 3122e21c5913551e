#pragma once

// Private to this library: the integer geometry that voxelisation decides on.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/workspace/voxel_box.hpp"

namespace phantom::voxelise::detail {

inline constexpr int kSubBits = 14;                  // 1/16384 voxel: 0.3 µm at 5 mm
inline constexpr std::int64_t kSub = 1 << kSubBits;  // one voxel
inline constexpr std::int64_t kReach =
    1LL << (14 + kSubBits);  // farthest coordinate: products of differences fit 63 bits

/// In 1/kSub voxel from the box's corner; the fourth is 0, so that a point fills a vector.
struct alignas(16) SnappedPoint : std::array<std::int32_t, 4> {};
using Corners = std::array<std::uint32_t, 3>;  // indices of points

struct SnappedMesh {
  std::vector<SnappedPoint> points;
  std::span<const Corners> triangles;
};

/// How vertices become points; the fourth of each serves the fourth of a point.
struct Lattice {
  alignas(32) double origin_m[4], voxel_m[4];  ///< of the grid
  alignas(32) double corner[4];                ///< of the box, in voxels
  alignas(32) double scale[4];                 ///< kSub
};
/// Rounds vertices, which are finite, to points; false if one is farther away than kReach.
bool snap(std::span<const Eigen::Vector3f> vertices_m, const Lattice& lattice, int threads,
          std::vector<SnappedPoint>& points);

/// Layers [first, last) of a volume.
struct Slab {
  std::int32_t first, last;
};

/// Sets the bits of all voxels of the slab (along z) that a triangle passes through: triangle and voxel are
/// closed sets, but the voxels that only touch the upper end of the triangle's box from above are those that
/// floor() names. Writes into `over` those triangles, by number, whose box reaches over voxels' centres of
/// the slab both along y and along z: no others cross lines along x.
void mark_triangles(const SnappedMesh& mesh, Slab z, workspace::BitVolume& boundary,
                    std::vector<std::uint32_t>& over);

/// How a mesh crosses the lines along one axis through the voxel centres.
struct LineSigns {
  bool positive = false, negative = false;  ///< winding numbers of either sign occur
};

/// Winding number along x at every voxel centre of the slab (along z); sets `inside` where it is not 0. The
/// mesh must be a closed, oriented surface: what enters leaves. `over`: the triangles that may cross lines of
/// the slab; null: all.
LineSigns fill_inside(const SnappedMesh& mesh, const std::vector<std::uint32_t>* over, Slab z,
                      workspace::BitVolume& inside);

/// The same along x, y or z for any mesh. A line whose crossings do not add up to 0 says nothing: it is set
/// in `silent`, which has one bit per line: (y, z) for x, (x, z) for y, (x, y) for z, and its voxels stay 0.
void fill_inside_along(int axis, const SnappedMesh& mesh, workspace::BitVolume& inside,
                       workspace::BitVolume& silent);

}  // namespace phantom::voxelise::detail
