#include "common/voxelise/voxelise_implicit.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

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
  Voxeliser(const ImplicitSolid& solid, const workspace::GridSpec& grid, core::WorkBudget* budget,
            SolidVoxels& voxels)
      : solid_(solid), grid_(grid), budget_(budget), voxels_(voxels) {
    const workspace::VoxelBox& box = voxels.box;
    corner_m_ = grid.corner_of(box.min);
    shift_m_ = kShift_vox * grid.voxel_size_m.sides_m();
  }

  /// Marks all voxels. Returns false if options.go_on or the budget stopped it.
  bool run(const workspace::WorkOptions& options) {
    std::int32_t size = kPiece;
    while (size < *std::max_element(voxels_.box.size.begin(), voxels_.box.size.end())) size *= 2;
    {
      core::WorkMeter meter(budget_);
      split({0, 0, 0}, size, meter);
    }
    // Sorted so that neighbours along x follow each other: those that share words go to one thread.
    std::sort(pieces_.begin(), pieces_.end(), [](workspace::Index3 a, workspace::Index3 b) {
      return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x);
    });
    std::vector<std::size_t> first;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const bool shares = i > 0 && pieces_[i - 1].z == pieces_[i].z && pieces_[i - 1].y == pieces_[i].y &&
                          pieces_[i - 1].x >> 6 == pieces_[i].x >> 6;
      if (!shares) first.push_back(i);
    }
    first.push_back(pieces_.size());
    return workspace::parallel_for(options, first.size() - 1, [&](std::size_t i, std::size_t) {
      core::WorkMeter meter(budget_);
      for (std::size_t piece = first[i]; piece < first[i + 1]; ++piece)
        visit(solid_, pieces_[piece], kPiece, meter);
    });
  }

 private:
  Region region(workspace::Index3 v, std::int32_t size) const {
    const Eigen::Vector3d& sides_m = grid_.voxel_size_m.sides_m();
    const Eigen::Vector3d half_m = 0.5 * size * sides_m;
    return Region::box(corner_m_ + sides_m.cwiseProduct(workspace::vector(v)) + half_m - shift_m_, half_m);
  }

  bool beyond(workspace::Index3 v) const { return !workspace::VoxelBox{{}, voxels_.box.size}.contains(v); }
  static workspace::Index3 part(workspace::Index3 v, std::int32_t half, int i) {
    return v + half * workspace::Index3{i & 1, i >> 1 & 1, i >> 2};
  }

  /// Decides large cubes as a whole; cubes of kPiece that may hold the surface become pieces.
  void split(workspace::Index3 v, std::int32_t size, core::WorkMeter& meter) {
    if (beyond(v) || !meter.spend(solid_.steps())) return;
    if (size == kPiece) return pieces_.push_back(v);
    const Interval bounds = solid_.bounds(region(v, size));
    if (bounds.lo > 0.0) return;
    if (bounds.hi < 0.0) return fill(v, size);
    for (int i = 0; i < 8; ++i) split(part(v, size / 2, i), size / 2, meter);
  }

  void visit(const ImplicitSolid& solid, workspace::Index3 v, std::int32_t size, core::WorkMeter& meter) {
    if (beyond(v) || !meter.spend(solid.steps())) return;
    const Region cube = region(v, size);
    const Interval bounds = solid.bounds(cube);
    if (bounds.lo > 0.0) return;
    if (bounds.hi < 0.0) return fill(v, size);
    if (size == 1) return mark(solid, cube, v, meter);
    // At some sizes, parts of the solid that are far from the cube are left out.
    const bool simplifies = size == kPiece || size == 8;
    if (simplifies && !meter.spend(2 * solid.steps())) return;
    const geometry::ImplicitPtr fewer = simplifies ? solid.within(cube) : nullptr;
    const ImplicitSolid& here = fewer ? *fewer : solid;
    for (int i = 0; i < 8; ++i) visit(here, part(v, size / 2, i), size / 2, meter);
  }

  void mark(const ImplicitSolid& solid, const Region& cube, workspace::Index3 v, core::WorkMeter& meter) {
    if (!meter.spend(10 * solid.steps())) return;
    if (solid.value(cube.centre_m + shift_m_) < 0.0) voxels_.inside.set(v.x, v.y, v.z);
    if (corners_differ(solid, cube) || may_hold_surface(solid, cube, kPartDepth, meter))
      voxels_.boundary.set(v.x, v.y, v.z);
  }

  static Eigen::Vector3d corner(int i) {
    return {(i & 1) * 2.0 - 1, (i >> 1 & 1) * 2.0 - 1, (i >> 2) * 2.0 - 1};
  }

  /// Proves cheaply that the surface passes: the voxel has points on both sides.
  static bool corners_differ(const ImplicitSolid& solid, const Region& cube) {
    const bool inside = solid.value(cube.centre_m) < 0.0;
    for (int i = 0; i < 8; ++i) {
      if ((solid.value(cube.centre_m + cube.half_m.cwiseProduct(corner(i))) < 0.0) != inside) return true;
    }
    return false;
  }

  static bool may_hold_surface(const ImplicitSolid& solid, const Region& part, int depth,
                               core::WorkMeter& meter) {
    if (!meter.spend(solid.steps())) return false;
    const Interval bounds = solid.bounds(part);
    if (bounds.lo > 0.0 || bounds.hi < 0.0) return false;
    if (depth == 0) return true;
    const Eigen::Vector3d half = 0.5 * part.half_m;
    for (int i = 0; i < 8; ++i) {
      const Region smaller = Region::box(part.centre_m + half.cwiseProduct(corner(i)), half);
      if (may_hold_surface(solid, smaller, depth - 1, meter)) return true;
    }
    return false;
  }

  void fill(workspace::Index3 v, std::int32_t size) {
    const workspace::VoxelBox part =
        workspace::VoxelBox{v, {size, size, size}}.intersection({{}, voxels_.box.size});
    for (std::int32_t z = v.z; z < part.end().z; ++z) {
      for (std::int32_t y = v.y; y < part.end().y; ++y) voxels_.inside.set_run(y, z, v.x, part.end().x);
    }
  }

  const ImplicitSolid& solid_;
  const workspace::GridSpec& grid_;
  core::WorkBudget* budget_;
  SolidVoxels& voxels_;
  Eigen::Vector3d corner_m_, shift_m_;
  std::vector<workspace::Index3> pieces_;
};

}  // namespace

workspace::VoxelBox voxel_bounds(const ImplicitSolid& solid_W, const workspace::GridSpec& grid) {
  const geometry::Box box = solid_W.bounding_box();
  if (box.empty()) return {};
  // One more voxel on each side, for a surface on a border.
  return workspace::VoxelBox::between(grid.index_of(box.min_m),
                                      grid.index_of(box.max_m) + workspace::Index3{1, 1, 1})
      .grown(1);
}

core::Expected<SolidVoxels> voxelise(const ImplicitSolid& solid_W, const workspace::GridSpec& grid,
                                     const workspace::VoxelBox& clip, const workspace::WorkOptions& options) {
  SolidVoxels solid;
  const geometry::Box box = solid_W.bounding_box();
  if (box.empty()) return solid;
  const double farthest_m = std::max(box.min_m.cwiseAbs().maxCoeff(), box.max_m.cwiseAbs().maxCoeff());
  if (!(farthest_m < std::min(1e6, 1e9 * grid.voxel_size_m.reference_m()))) {
    return core::Status(core::ErrorCode::kResourceExhausted,
                        "reaches " + std::to_string(farthest_m) + " m from the origin; is its scale right?");
  }
  solid.box = voxel_bounds(solid_W, grid).intersection(clip);
  if (solid.box.empty()) return solid;
  solid.boundary = workspace::BitVolume(solid.box.size);
  solid.inside = workspace::BitVolume(solid.box.size);
  if (!Voxeliser(solid_W, grid, options.budget, solid).run(options))
    return workspace::ended_early(options, "voxelising");
  return solid;
}

}  // namespace phantom::voxelise
