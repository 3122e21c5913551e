#include "common/voxelise/voxelise_implicit.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "common/core/parallel.hpp"

namespace phantom::voxelise {
namespace {

using geometry::ImplicitSolid;
using geometry::Interval;
using geometry::Region;

constexpr int kPartDepth = 4;
static_assert(kImplicitPart_vox * (1 << kPartDepth) == 1.0);
/// Voxels are tested at a position lower by this much, so that a surface on a border belongs to the upper
/// voxel despite rounding.
constexpr double kShift_vox = 1.0 / 32768.0;
/// Cubes of this edge, in voxels, are distributed to the threads. Two neighbours along x fill words of 64
/// bits.
constexpr std::int32_t kPiece = 32;

class Voxeliser {
 public:
  Voxeliser(const ImplicitSolid& solid, const workspace::GridSpec& grid, SolidVoxels& voxels)
      : solid_(solid), grid_(grid), voxels_(voxels) {
    const workspace::VoxelBox& box = voxels.box;
    corner_m_ = grid.origin_m + grid.voxel_size_m * Eigen::Vector3d(box.min.x, box.min.y, box.min.z);
    shift_m_ = Eigen::Vector3d::Constant(kShift_vox * grid.voxel_size_m);
  }

  /// Marks all voxels. Returns false if options.go_on stopped it.
  bool run(const workspace::WorkOptions& options) {
    std::int32_t size = kPiece;
    while (size < *std::max_element(voxels_.box.size.begin(), voxels_.box.size.end())) size *= 2;
    split({0, 0, 0}, size);
    // Sorted so that neighbours along x follow each other: those that share words go to one thread.
    const auto place = [](workspace::Index3 v) { return std::array{v.z, v.y, v.x}; };
    std::sort(pieces_.begin(), pieces_.end(),
              [&](workspace::Index3 a, workspace::Index3 b) { return place(a) < place(b); });
    std::vector<std::size_t> first;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const bool shares = i > 0 && pieces_[i - 1].z == pieces_[i].z && pieces_[i - 1].y == pieces_[i].y &&
                          pieces_[i - 1].x >> 6 == pieces_[i].x >> 6;
      if (!shares) first.push_back(i);
    }
    first.push_back(pieces_.size());
    std::atomic<bool> stopped = false;
    core::parallel_for(options.threads, first.size() - 1, [&](std::size_t i, std::size_t worker) {
      if (stopped) return;
      if (worker == 0 && options.go_on &&
          !options.go_on(static_cast<double>(i) / static_cast<double>(first.size())))
        stopped = true;
      for (std::size_t piece = first[i]; piece < first[i + 1]; ++piece) visit(solid_, pieces_[piece], kPiece);
    });
    return !stopped;
  }

 private:
  Region region(workspace::Index3 v, std::int32_t size) const {
    const double half_m = 0.5 * size * grid_.voxel_size_m;
    const Eigen::Vector3d centre = corner_m_ + grid_.voxel_size_m * Eigen::Vector3d(v.x, v.y, v.z) +
                                   Eigen::Vector3d::Constant(half_m) - shift_m_;
    return Region::box(centre, Eigen::Vector3d::Constant(half_m));
  }

  bool beyond(workspace::Index3 v) const {
    const auto& limit = voxels_.box.size;
    return v.x >= limit[0] || v.y >= limit[1] || v.z >= limit[2];
  }
  static workspace::Index3 part(workspace::Index3 v, std::int32_t half, int i) {
    return {v.x + (i & 1) * half, v.y + (i >> 1 & 1) * half, v.z + (i >> 2) * half};
  }

  /// Decides large cubes as a whole; cubes of kPiece that may hold the surface become pieces.
  void split(workspace::Index3 v, std::int32_t size) {
    if (beyond(v)) return;
    if (size == kPiece) return pieces_.push_back(v);
    const Interval bounds = solid_.bounds(region(v, size));
    if (bounds.lo > 0.0) return;
    if (bounds.hi < 0.0) return fill(v, size);
    for (int i = 0; i < 8; ++i) split(part(v, size / 2, i), size / 2);
  }

  void visit(const ImplicitSolid& solid, workspace::Index3 v, std::int32_t size) {
    if (beyond(v)) return;
    const Region cube = region(v, size);
    const Interval bounds = solid.bounds(cube);
    if (bounds.lo > 0.0) return;
    if (bounds.hi < 0.0) return fill(v, size);
    if (size == 1) return mark(solid, cube, v);
    // At some sizes, parts of the solid that are far from the cube are left out.
    const geometry::ImplicitPtr fewer = size == kPiece || size == 8 ? solid.within(cube) : nullptr;
    const ImplicitSolid& here = fewer ? *fewer : solid;
    for (int i = 0; i < 8; ++i) visit(here, part(v, size / 2, i), size / 2);
  }

  void mark(const ImplicitSolid& solid, const Region& cube, workspace::Index3 v) {
    if (solid.value(cube.centre_m + shift_m_) < 0.0) voxels_.inside.set(v.x, v.y, v.z);
    if (corners_differ(solid, cube) || may_hold_surface(solid, cube, kPartDepth))
      voxels_.boundary.set(v.x, v.y, v.z);
  }

  /// Proves cheaply that the surface passes: the voxel has points on both sides.
  static bool corners_differ(const ImplicitSolid& solid, const Region& cube) {
    const bool inside = solid.value(cube.centre_m) < 0.0;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d sign((i & 1) * 2 - 1, (i >> 1 & 1) * 2 - 1, (i >> 2) * 2 - 1);
      if ((solid.value(cube.centre_m + cube.half_m.cwiseProduct(sign)) < 0.0) != inside) return true;
    }
    return false;
  }

  static bool may_hold_surface(const ImplicitSolid& solid, const Region& part, int depth) {
    const Interval bounds = solid.bounds(part);
    if (bounds.lo > 0.0 || bounds.hi < 0.0) return false;
    if (depth == 0) return true;
    const Eigen::Vector3d half = 0.5 * part.half_m;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d sign((i & 1) * 2 - 1, (i >> 1 & 1) * 2 - 1, (i >> 2) * 2 - 1);
      if (may_hold_surface(solid, Region::box(part.centre_m + half.cwiseProduct(sign), half), depth - 1))
        return true;
    }
    return false;
  }

  void fill(workspace::Index3 v, std::int32_t size) {
    const auto& limit = voxels_.box.size;
    const std::int32_t end_x = std::min(v.x + size, limit[0]);
    const std::int32_t end_y = std::min(v.y + size, limit[1]), end_z = std::min(v.z + size, limit[2]);
    for (std::int32_t z = v.z; z < end_z; ++z) {
      for (std::int32_t y = v.y; y < end_y; ++y) fill_row(voxels_.inside.row(y, z), v.x, end_x);
    }
  }

  /// Sets the bits [from, end) of a row, a word at a time.
  static void fill_row(std::uint64_t* row, std::int32_t from, std::int32_t end) {
    for (std::int32_t x = from; x < end; x = (x | 63) + 1) {
      const std::int32_t last = std::min(end, (x | 63) + 1) - x;  // bits in this word
      const std::uint64_t ones = last == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << last) - 1;
      row[x >> 6] |= ones << (x & 63);
    }
  }

  const ImplicitSolid& solid_;
  const workspace::GridSpec& grid_;
  SolidVoxels& voxels_;
  Eigen::Vector3d corner_m_, shift_m_;
  std::vector<workspace::Index3> pieces_;
};

}  // namespace

workspace::VoxelBox voxel_bounds(const ImplicitSolid& solid_W, const workspace::GridSpec& grid) {
  const geometry::Box box = solid_W.bounding_box();
  if (box.empty()) return {};
  const workspace::Index3 first = grid.index_of(box.min_m), last = grid.index_of(box.max_m);
  // One more voxel on each side, for a surface on a border.
  return {{first.x - 1, first.y - 1, first.z - 1},
          {last.x - first.x + 3, last.y - first.y + 3, last.z - first.z + 3}};
}

core::Expected<SolidVoxels> voxelise(const ImplicitSolid& solid_W, const workspace::GridSpec& grid,
                                     const workspace::VoxelBox& clip, const workspace::WorkOptions& options) {
  SolidVoxels solid;
  const geometry::Box box = solid_W.bounding_box();
  if (box.empty()) return solid;
  const double farthest_m = std::max(box.min_m.cwiseAbs().maxCoeff(), box.max_m.cwiseAbs().maxCoeff());
  if (!(farthest_m < std::min(1e6, 1e9 * grid.voxel_size_m))) {
    return core::Status(core::ErrorCode::kResourceExhausted,
                        "reaches " + std::to_string(farthest_m) + " m from the origin; is its scale right?");
  }
  solid.box = voxel_bounds(solid_W, grid).intersection(clip);
  if (solid.box.empty()) return solid;
  solid.boundary = workspace::BitVolume(solid.box.size);
  solid.inside = workspace::BitVolume(solid.box.size);
  if (!Voxeliser(solid_W, grid, solid).run(options))
    return core::Status(core::ErrorCode::kUnavailable, "voxelising was stopped");
  return solid;
}

}  // namespace phantom::voxelise
