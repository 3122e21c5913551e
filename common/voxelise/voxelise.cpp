#include "common/voxelise/voxelise.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numeric>
#include <string>

#include "common/core/parallel.hpp"
#include "common/geometry/mesh/mesh_topology.hpp"
#include "common/geometry/mesh/winding_number.hpp"
#include "common/voxelise/repaired_mesh.hpp"
#include "common/voxelise/snapped_mesh.hpp"

namespace phantom::voxelise {
namespace {

using detail::Corners;
using detail::kReach;
using detail::kSub;
using detail::LineSigns;
using detail::Slab;
using detail::SnappedMesh;
using detail::SnappedPoint;

/// Runs work(slab, its number) on slabs of the layers [0, layers), one slab per thread.
template <class Work>
void in_slabs(std::int32_t layers, int threads, const Work& work) {
  const std::int32_t count = std::clamp<std::int32_t>(threads, 1, std::max(1, layers));
  const auto slab = [&](std::int32_t i) {
    return Slab{static_cast<std::int32_t>(std::int64_t{layers} * i / count),
                static_cast<std::int32_t>(std::int64_t{layers} * (i + 1) / count)};
  };
  core::parallel_for(count, static_cast<std::size_t>(count),
                     [&](std::size_t i, std::size_t) { work(slab(static_cast<std::int32_t>(i)), i); });
}

detail::Lattice lattice_of(const workspace::GridSpec& grid, const workspace::VoxelBox& box) {
  const auto sub = static_cast<double>(kSub);
  const Eigen::Vector3d& o = grid.origin_m;
  const Eigen::Vector3d& side = grid.voxel_size_m.sides_m();
  return {
      {o.x(), o.y(), o.z(), 0.0},
      {side.x(), side.y(), side.z(), 1.0},
      {static_cast<double>(box.min.x), static_cast<double>(box.min.y), static_cast<double>(box.min.z), 0.0},
      {sub, sub, sub, 0.0}};
}

void clear(Slab z, workspace::BitVolume& volume) {
  const std::size_t layer = volume.words_per_row() * static_cast<std::size_t>(volume.size()[1]);
  std::fill_n(volume.words().data() + layer * static_cast<std::size_t>(z.first),
              layer * static_cast<std::size_t>(z.last - z.first), 0);
}

/// The triangles that may cross lines of each slab; empty: not known.
using OverSlabs = std::vector<std::vector<std::uint32_t>>;

/// Fills the inside of a closed mesh. Writes all of `inside`.
LineSigns fill_closed(const SnappedMesh& mesh, const OverSlabs& over, int threads,
                      workspace::BitVolume& inside) {
  std::atomic<bool> positive = false, negative = false;
  in_slabs(inside.size()[2], threads, [&](Slab z, std::size_t number) {
    clear(z, inside);
    const LineSigns signs = detail::fill_inside(mesh, over.empty() ? nullptr : &over[number], z, inside);
    if (signs.positive) positive = true;
    if (signs.negative) negative = true;
  });
  return {positive, negative};
}

/// Holds the votes of the lines along the three axes about each voxel.
struct Votes {
  workspace::BitVolume inside[3], unbalanced[3];
};

/// Counts the work of finding where lines along one axis cross triangles, before it is done: it takes memory,
/// too. Returns false if it must not be done.
bool may_cross(int axis, const SnappedMesh& mesh, const workspace::VoxelBox& box, core::WorkBudget* budget) {
  constexpr std::uint64_t kStepsPerLine = 8;
  return budget == nullptr || budget->spend(kStepsPerLine * detail::lines_reached(axis, mesh, box.size));
}

Votes ask_all_axes(const SnappedMesh& mesh, const workspace::VoxelBox& box) {
  const auto& n = box.size;
  Votes votes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    votes.inside[axis] = workspace::BitVolume(n);
    votes.unbalanced[axis] = workspace::BitVolume({n[axis == 0 ? 1 : 0], n[axis == 2 ? 1 : 2], 1});
    detail::fill_inside_along(static_cast<int>(axis), mesh, votes.inside[axis], votes.unbalanced[axis]);
  }
  return votes;
}

/// Decides whether voxels of a row are inside, by the generalised winding number.
class InsideTest {
 public:
  InsideTest(const geometry::WindingTree& tree, const workspace::GridSpec& grid,
             const workspace::VoxelBox& box)
      : tree_(tree), grid_(grid), box_(box) {}

  /// Sets the voxels of [first, last] that are inside; no surface may lie between them. Off the surface the
  /// winding number changes smoothly: between two places where it is clearly on the same side of the
  /// threshold it is not evaluated again.
  void run(std::uint64_t* row, std::int32_t first, std::int32_t last, std::int32_t y, std::int32_t z,
           core::WorkMeter& meter) const {
    double w = at(first, y, z, meter);
    for (std::int32_t from = first; from < last;) {
      const std::int32_t to = std::min(last, from + kStride);
      if (!meter.spend(1)) return;
      const double next = at(to, y, z, meter);
      between(row, from, w, to, next, y, z, meter);
      from = to;
      w = next;
    }
    put(row, last, w);
  }

 private:
  static constexpr std::int32_t kStride = 16;
  static constexpr double kClearPerVoxel =
      0.0125;  // distance from the threshold per voxel between the places: 0.2 for a stride

  double at(std::int32_t x, std::int32_t y, std::int32_t z, core::WorkMeter& meter) const {
    std::uint64_t steps = 0;
    const double w = std::abs(tree_.at(grid_.centre_of(box_.min + workspace::Index3{x, y, z}), &steps));
    meter.spend(steps);  // whoever asks for the next one sees whether there may be one
    return w;
  }
  static void put(std::uint64_t* row, std::int32_t x, double w) {
    if (w > 0.5) row[x >> 6] |= std::uint64_t{1} << (x & 63);
  }
  /// Decides the voxels [from, to).
  void between(std::uint64_t* row, std::int32_t from, double w_from, std::int32_t to, double w_to,
               std::int32_t y, std::int32_t z, core::WorkMeter& meter) const {
    const double low = std::min(w_from, w_to), high = std::max(w_from, w_to);
    const double clear = kClearPerVoxel * (to - from);
    if (to - from == 1 || low > 0.5 + clear || high < 0.5 - clear) {
      for (std::int32_t x = from; x < to; ++x) put(row, x, w_from);
      return;
    }
    const std::int32_t middle = from + (to - from) / 2;
    if (!meter.spend(1)) return;
    const double w = at(middle, y, z, meter);
    between(row, from, w_from, middle, w, y, z, meter);
    between(row, middle, w, to, w_to, y, z, meter);
  }

  const geometry::WindingTree& tree_;
  const workspace::GridSpec& grid_;
  const workspace::VoxelBox& box_;
};

/// Writes the voxels of a row on which the votes agree, and into `disputed` the others.
void count_votes(const Votes& votes, std::int32_t y, std::int32_t z, std::int32_t size_x,
                 std::uint64_t* inside, std::vector<std::uint64_t>& disputed) {
  const auto any = [](const std::uint64_t* bits) { return bits[0] | bits[1] | bits[2]; };
  const auto two = [](const std::uint64_t* b) { return (b[0] & b[1]) | (b[1] & b[2]) | (b[2] & b[0]); };
  const std::uint64_t unbalanced_x = votes.unbalanced[0].get(y, z, 0) ? ~std::uint64_t{0} : 0;
  for (std::size_t i = 0; i < disputed.size(); ++i) {
    const std::uint64_t unbalanced[3] = {unbalanced_x, votes.unbalanced[1].row(z, 0)[i],
                                         votes.unbalanced[2].row(y, 0)[i]};
    std::uint64_t in[3], out[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      in[axis] = votes.inside[axis].row(y, z)[i] & ~unbalanced[axis];
      out[axis] = ~votes.inside[axis].row(y, z)[i] & ~unbalanced[axis];
    }
    const std::int32_t left = size_x - static_cast<std::int32_t>(i * 64);
    const std::uint64_t valid = left >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << left) - 1;
    inside[i] = two(in) & ~any(out) & valid;
    disputed[i] = ~(inside[i] | (two(out) & ~any(in))) & valid;
  }
}

/// Decides all voxels of a layer: by the votes where they agree, otherwise by the winding number. Returns
/// the number of the latter.
std::size_t decide_layer(const Votes& votes, std::int32_t z, const InsideTest& inside_test,
                         core::WorkMeter& meter, SolidVoxels& solid) {
  std::size_t disputed_voxels = 0;
  std::vector<std::uint64_t> disputed(solid.inside.words_per_row());
  const auto is_disputed = [&](std::int32_t x) {
    return (disputed[static_cast<std::size_t>(x >> 6)] >> (x & 63) & 1) != 0;
  };
  for (std::int32_t y = 0; y < solid.box.size[1]; ++y) {
    std::uint64_t* row = solid.inside.row(y, z);
    count_votes(votes, y, z, solid.box.size[0], row, disputed);
    std::size_t left = 0;
    for (const std::uint64_t word : disputed) left += static_cast<std::size_t>(std::popcount(word));
    disputed_voxels += left;
    for (std::int32_t first = 0, last = 0; left > 0; first = last + 1) {
      while (!is_disputed(first)) ++first;
      last = first;
      const auto on_surface = [&](std::int32_t x) { return solid.boundary.get(x, y, z); };
      while (last + 1 < solid.box.size[0] && is_disputed(last + 1) && !on_surface(last) &&
             !on_surface(last + 1))
        ++last;
      inside_test.run(row, first, last, y, z, meter);
      if (!meter.spend(1)) return disputed_voxels;
      left -= static_cast<std::size_t>(last - first + 1);
    }
  }
  return disputed_voxels;
}

/// Decides all rows, which may take long. Returns false if options.go_on or the budget ended it.
bool decide_all(const Votes& votes, const InsideTest& inside_test, const workspace::WorkOptions& options,
                SolidVoxels& solid) {
  std::atomic<std::size_t> disputed = 0;
  const bool whole = workspace::parallel_for(
      options, static_cast<std::size_t>(solid.box.size[2]), [&](std::size_t layer, std::size_t) {
        core::WorkMeter meter(options.budget);
        disputed += decide_layer(votes, static_cast<std::int32_t>(layer), inside_test, meter, solid);
      });
  solid.report.disputed_voxels = disputed;
  return whole;
}

/// Repairs a mesh that is not a closed, consistently oriented surface, and fills its inside. Returns false if
/// options.go_on or the budget ended it.
bool fill_repaired(const geometry::TriangleMesh& mesh_W, const SnappedMesh& snapped,
                   const workspace::GridSpec& grid, const workspace::WorkOptions& options,
                   SolidVoxels& solid) {
  detail::RepairedMesh repaired = detail::repair(snapped);
  const SnappedMesh mesh{snapped.points, repaired.triangles};
  solid.report.closed = repaired.closed;
  if (repaired.closed) {
    const LineSigns signs = fill_closed(mesh, {}, options.threads, solid.inside);
    if (signs.positive && signs.negative && detail::turn_outer_shells(mesh_W, repaired))
      fill_closed({snapped.points, repaired.triangles}, {}, options.threads, solid.inside);
  } else {
    if (!may_cross(1, mesh, solid.box, options.budget) || !may_cross(2, mesh, solid.box, options.budget))
      return false;
    const Votes votes = ask_all_axes(mesh, solid.box);
    const geometry::WindingTree tree({mesh_W.vertices_m, repaired.triangles});
    if (!decide_all(votes, InsideTest(tree, grid, solid.box), options, solid)) return false;
  }
  solid.report.degenerate_triangles = repaired.degenerate;
  solid.report.duplicate_triangles = repaired.duplicates;
  solid.report.turned_triangles = repaired.turned;
  return true;
}

}  // namespace

workspace::BitVolume SolidVoxels::interior() const {
  workspace::BitVolume interior = inside;
  for (std::size_t i = 0; i < interior.words().size(); ++i) interior.words()[i] &= ~boundary.words()[i];
  return interior;
}

workspace::VoxelBox voxel_bounds(const geometry::BoundingBox& bounds_W, const workspace::GridSpec& grid) {
  if (bounds_W.empty()) return {};
  // One more voxel on each side, because snapping may move a vertex across a border.
  return workspace::VoxelBox::between(
             grid.index_of(bounds_W.min_m.cast<double>()),
             grid.index_of(bounds_W.max_m.cast<double>()) + workspace::Index3{1, 1, 1})
      .grown(1);
}

core::Expected<SolidVoxels> voxelise(const geometry::TriangleMesh& mesh_W, const workspace::GridSpec& grid,
                                     const workspace::VoxelBox& clip, const workspace::WorkOptions& options) {
  SolidVoxels solid;
  solid.report.triangles = mesh_W.triangles.size();
  const core::Status too_far(core::ErrorCode::kResourceExhausted,
                             "mesh reaches farther than " + std::to_string(kReach / kSub) +
                                 " voxels from the workspace; is its scale right?");
  const geometry::BoundingBox bounds = mesh_W.bounding_box();
  if (!bounds.finite)
    return core::Status(core::ErrorCode::kInvalidArgument,
                        "mesh has a coordinate that is not a finite number");
  if (bounds.empty()) return solid;
  const double farthest_m = std::max(-bounds.min_m.minCoeff(), bounds.max_m.maxCoeff());
  if (!(farthest_m < std::min(1e6, 1e9 * grid.voxel_size_m.reference_m())))
    return too_far;  // voxel indices are 32-bit integers
  solid.box = voxel_bounds(bounds, grid).intersection(clip);
  if (solid.box.empty()) return solid;
  SnappedMesh mesh{{}, mesh_W.triangles};
  if (!detail::snap(mesh_W.vertices_m, lattice_of(grid, solid.box), options.threads, mesh.points))
    return too_far;
  if (!may_cross(0, mesh, solid.box, options.budget)) return workspace::ended_early(options, "voxelising");

  solid.boundary = workspace::BitVolume::unwritten(solid.box.size);
  OverSlabs over(static_cast<std::size_t>(std::max(1, options.threads)));
  in_slabs(solid.box.size[2], options.threads, [&](Slab z, std::size_t number) {
    clear(z, solid.boundary);
    detail::mark_triangles(mesh, z, solid.boundary, over[number]);
  });
  solid.inside = workspace::BitVolume::unwritten(solid.box.size);
  bool repaired = true;
  if (geometry::is_oriented_surface(mesh_W.triangles)) {
    const LineSigns signs = fill_closed(mesh, over, options.threads, solid.inside);
    // If both signs occur, some shell may face the wrong way. If none occurs, each triangle may be present
    // twice, in both orientations.
    repaired = signs.positive == signs.negative;
  }
  if (repaired && !fill_repaired(mesh_W, mesh, grid, options, solid))
    return workspace::ended_early(options, "voxelising");
  return solid;
}

}  // namespace phantom::voxelise
