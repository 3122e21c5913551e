#include <algorithm>
#include <cmath>

#include "common/layers/layers.hpp"
#include "common/voxelise/triangle_tree.hpp"

namespace phantom::layers {
namespace {

/// Orders by distance: order i for limits[i − 1] < d ≤ limits[i].
class Bands {
 public:
  explicit Bands(const workspace::LayerProfile& profile) {
    double until = profile.guard_vox;
    add(until, workspace::kOrderGuard);
    for (std::size_t i = 0; i < profile.thickness_vox.size(); ++i) {
      until += profile.thickness_vox[i];
      add(until, static_cast<std::int8_t>(i + 1));
    }
  }
  double reach() const { return limits_.back(); }
  std::int8_t order(double distance) const {
    const auto place = std::lower_bound(limits_.begin(), limits_.end(), distance);
    return place == limits_.end() ? workspace::kOrderFree
                                  : orders_[static_cast<std::size_t>(place - limits_.begin())];
  }

 private:
  void add(double until, std::int8_t order) {
    limits_.push_back(until);
    orders_.push_back(order);
  }
  std::vector<double> limits_;
  std::vector<std::int8_t> orders_;
};

/// A cube of voxels of the grid; in metres it is as stretched as they are.
struct Cube {
  workspace::Index3 min;
  std::int32_t edge;

  Eigen::Vector3d centre_vox() const {
    return workspace::vector(min) + Eigen::Vector3d::Constant(0.5 * edge);
  }
  workspace::VoxelBox voxels() const { return {min, {edge, edge, edge}}; }
  /// Returns the distance from the cube's centre to the farthest voxel centre in it, in the unit of
  /// `diagonal`, a voxel's.
  double radius(double diagonal) const { return diagonal * 0.5 * (edge - 1); }
};

/// Fills one brick. Between two points, the distance to the surface changes by at most the distance between
/// them. So if the distance of a cube's centre is far enough from every limit between two layers, the whole
/// cube lies in one layer. Other cubes are halved along each axis.
class BrickOfSurface {
 public:
  BrickOfSurface(const voxelise::TriangleTree& tree, const Eigen::Vector3d& stretch, const Bands& bands,
                 const voxelise::SolidVoxels& solid, core::WorkBudget* budget)
      : tree_(tree),
        stretch_(stretch),
        diagonal_(stretch.norm()),
        bands_(bands),
        solid_(solid),
        meter_(budget) {}

  /// Returns null if the surface is too far away.
  std::unique_ptr<std::int8_t[]> operator()(workspace::BrickKey key) {
    orders_.reset();
    const Cube brick{workspace::box_of(key).min, workspace::kBrickEdge};
    const double limit = bands_.reach() + brick.radius(diagonal_) + kRounding;
    const voxelise::NearestPoint nearest = tree_.nearest(centre_of(brick), limit);
    if (nearest.distance_vox <= limit) fill(brick, nearest);
    return std::move(orders_);
  }

 private:
  static constexpr double kRounding =
      1e-6;  // in reference lengths; far above the rounding of double precision
  // Steps of one search for the nearest triangle, and of each triangle that it looks at.
  static constexpr std::uint64_t kSearch = 128, kTriangle = 8;

  void fill(const Cube& cube, const voxelise::NearestPoint& nearest) {
    if (!meter_.spend(kSearch + kTriangle * nearest.looked_at)) return;  // the whole is given up
    const double radius = cube.radius(diagonal_) + kRounding, distance = nearest.distance_vox;
    if (cube.edge == 1) return put(cube, bands_.order(distance));
    const std::int8_t order = bands_.order(std::max(0.0, distance - radius));
    if (order == bands_.order(distance + radius)) return put(cube, order);
    const std::int32_t half = cube.edge / 2;
    for (int part = 0; part < 8; ++part) {
      const Cube eighth{cube.min + half * workspace::Index3{part & 1, part >> 1 & 1, part >> 2}, half};
      if (is_solid(eighth)) continue;  // settle() sets these voxels
      fill(eighth, tree_.nearest_with_guess(centre_of(eighth), nearest.triangle));
    }
  }
  Eigen::Vector3d centre_of(const Cube& cube) const { return cube.centre_vox().cwiseProduct(stretch_); }
  /// Returns whether every voxel of a small cube is interior or boundary; false for larger cubes.
  bool is_solid(const Cube& cube) const {
    if (cube.edge > 4) return false;
    const workspace::VoxelBox voxels = cube.voxels();
    if (!solid_.box.contains(voxels)) return false;
    bool all = true;
    voxels.for_each([&](workspace::Index3 v) {
      const workspace::Index3 in = v - solid_.box.min;
      all = all && (solid_.boundary.get(in) || solid_.inside.get(in));
    });
    return all;
  }

  void put(const Cube& cube, std::int8_t order) {
    if (order == workspace::kOrderFree) return;
    if (!orders_) orders_ = std::make_unique<std::int8_t[]>(workspace::kBrickVoxels);
    cube.voxels().for_each([&](workspace::Index3 v) { orders_[workspace::brick_offset(v)] = order; });
  }

  const voxelise::TriangleTree& tree_;
  Eigen::Vector3d stretch_;  // of the voxels' sides; so all distances are in reference lengths
  double diagonal_;          // of a voxel
  const Bands& bands_;
  const voxelise::SolidVoxels& solid_;
  core::WorkMeter meter_;
  std::unique_ptr<std::int8_t[]> orders_;
};

/// Overwrites the orders of the solid's voxels and of voxels beyond the part.
void settle(const voxelise::SolidVoxels& solid, const workspace::VoxelBox& part, workspace::BrickKey key,
            std::unique_ptr<std::int8_t[]>& orders) {
  bool any = false;
  workspace::box_of(key).for_each([&](workspace::Index3 v) {
    const bool in_box = solid.box.contains(v), wanted = part.contains(v);
    const bool boundary = in_box && solid.boundary.get(v - solid.box.min);
    const bool inside = in_box && solid.inside.get(v - solid.box.min);
    if (!orders && !(wanted && (boundary || inside))) return;
    if (!orders) orders = std::make_unique<std::int8_t[]>(workspace::kBrickVoxels);
    std::int8_t& order = orders[workspace::brick_offset(v)];
    if (boundary || inside) order = boundary ? workspace::kOrderBoundary : workspace::kOrderInterior;
    if (!wanted) order = workspace::kOrderFree;
    any = any || order != workspace::kOrderFree;
  });
  if (!any) orders.reset();
}

bool all_interior(const std::int8_t* orders) {
  return std::all_of(orders, orders + workspace::kBrickVoxels,
                     [](std::int8_t order) { return order == workspace::kOrderInterior; });
}

}  // namespace

workspace::ObjectBricks surface_bricks(const geometry::TriangleMesh& mesh_W,
                                       const voxelise::SolidVoxels& solid,
                                       const workspace::LayerProfile& profile,
                                       const workspace::GridSpec& grid, const workspace::VoxelBox& part,
                                       const workspace::WorkOptions& options) {
  const workspace::VoxelBox reached =
      solid.box.empty() ? workspace::VoxelBox{} : solid.box.grown(profile.reach_vox()).intersection(part);
  if (reached.empty()) return {};
  const workspace::VoxelBox bricks = workspace::bricks_of(reached);
  const auto ny = static_cast<std::size_t>(bricks.size[1]), nz = static_cast<std::size_t>(bricks.size[2]);
  const voxelise::TriangleTree tree(mesh_W, grid);
  const Bands bands(profile);
  std::vector<std::vector<workspace::ObjectBricks::Part>> parts(ny * nz);
  const bool whole = workspace::parallel_for(options, ny * nz, [&](std::size_t row, std::size_t) {
    BrickOfSurface brick(tree, grid.voxel_size_m.stretch(), bands, solid, options.budget);
    const auto y = static_cast<std::int32_t>(row % ny), z = static_cast<std::int32_t>(row / ny);
    for (std::int32_t x = 0; x < bricks.size[0]; ++x) {
      const workspace::BrickKey key{bricks.min + workspace::Index3{x, y, z}};
      auto orders = brick(key);
      settle(solid, part, key, orders);
      if (!orders) continue;
      if (all_interior(orders.get())) orders.reset();  // all such bricks share one block of memory
      parts[row].push_back({key, std::move(orders)});
    }
  });
  if (!whole) return {};
  std::vector<workspace::ObjectBricks::Part> all;
  for (auto& row : parts) std::move(row.begin(), row.end(), std::back_inserter(all));
  return workspace::ObjectBricks(std::move(all));
}

}  // namespace phantom::layers
