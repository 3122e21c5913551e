#pragma once

// Private to this library: the integer geometry in which voxelisation makes its decisions.

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

/// A point in units of 1/kSub voxel from the box's corner. The fourth element is 0, so that a point fills a
/// vector register.
struct alignas(16) SnappedPoint : std::array<std::int32_t, 4> {};
using Corners = std::array<std::uint32_t, 3>;  // indices of points

struct SnappedMesh {
  std::vector<SnappedPoint> points;
  std::span<const Corners> triangles;
};

/// Defines how vertices are converted to points. The fourth element of each array serves the fourth of a
/// point.
struct Lattice {
  alignas(32) double origin_m[4], voxel_m[4];  ///< of the grid
  alignas(32) double corner[4];                ///< of the box, in voxels
  alignas(32) double scale[4];                 ///< kSub
};
/// Rounds finite vertices to points. Returns false if one is farther away than kReach.
bool snap(std::span<const Eigen::Vector3f> vertices_m, const Lattice& lattice, int threads,
          std::vector<SnappedPoint>& points);

/// Returns how many lines of voxels along one axis, of a box of `size` voxels, the triangles' boxes reach
/// over, summed over all triangles: about the work and the memory of marking them and of fill_inside_along().
std::uint64_t lines_reached(int axis, const SnappedMesh& mesh, const std::array<std::int32_t, 3>& size);

/// The layers [first, last) of a volume.
struct Slab {
  std::int32_t first, last;
};

/// Sets the bits of all voxels of the slab (along z) through which a triangle passes. Triangle and voxel are
/// closed sets; but of the voxels that only touch the upper end of the triangle's box from above, those named
/// by floor() count. Writes into `over` the numbers of the triangles whose box reaches over voxel centres of
/// the slab both along y and along z. No other triangles cross lines along x.
void mark_triangles(const SnappedMesh& mesh, Slab z, workspace::BitVolume& boundary,
                    std::vector<std::uint32_t>& over);

/// Tells which signs of winding numbers occur on the lines along one axis through the voxel centres.
struct LineSigns {
  bool positive = false, negative = false;  ///< whether winding numbers of this sign occur
};

/// Computes the winding number along x at every voxel centre of the slab (along z), and sets `inside` where
/// it is not 0. The mesh must be a closed, oriented surface, so that each line leaves as often as it enters.
/// `over`: the triangles that may cross lines of the slab; null: all.
LineSigns fill_inside(const SnappedMesh& mesh, const std::vector<std::uint32_t>* over, Slab z,
                      workspace::BitVolume& inside);

/// Does the same along x, y or z for any mesh. If the crossings of a line do not add up to 0, its voxels stay
/// 0 and the line is marked in `unbalanced`, which has one bit per line: (y, z) for x, (x, z) for y, (x, y)
/// for z.
void fill_inside_along(int axis, const SnappedMesh& mesh, workspace::BitVolume& inside,
                       workspace::BitVolume& unbalanced);

}  // namespace phantom::voxelise::detail
