#include "common/layers/surface_layers.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "common/core/parallel.hpp"
#include "common/layers/triangle_tree.hpp"

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

/// A cube of voxels of the grid.
struct Cube {
  workspace::Index3 min;
  std::int32_t edge;

  Eigen::Vector3d centre_vox() const {
    return Eigen::Vector3d(min.x, min.y, min.z) + Eigen::Vector3d::Constant(0.5 * edge);
  }
  /// Returns the distance from the cube's centre to the farthest voxel centre in it.
  double radius_vox() const { return std::sqrt(3.0) * 0.5 * (edge - 1); }
};

/// Fills one brick. Between two points, the distance to the surface changes by at most the distance between
/// them. So if the distance of a cube's centre is far enough from every limit between two layers, the whole
/// cube lies in one layer. Other cubes are halved along each axis.
class BrickOfSurface {
 public:
  BrickOfSurface(const detail::TriangleTree& tree, const Bands& bands, const voxelise::SolidVoxels& solid)
      : tree_(tree), bands_(bands), solid_(solid) {}

  /// Returns null if the surface is too far away.
  std::unique_ptr<std::int8_t[]> operator()(workspace::BrickKey key) {
    orders_.reset();
    const Cube brick{workspace::box_of(key).min, workspace::kBrickEdge};
    const double limit = bands_.reach() + brick.radius_vox() + kRounding;
    const detail::NearestPoint nearest = tree_.nearest(brick.centre_vox(), limit);
    if (nearest.distance_vox <= limit) fill(brick, nearest);
    return std::move(orders_);
  }

 private:
  static constexpr double kRounding = 1e-6;  // in voxels; far above the rounding of double precision

  void fill(const Cube& cube, const detail::NearestPoint& nearest) {
    const double radius = cube.radius_vox() + kRounding, distance = nearest.distance_vox;
    if (cube.edge == 1) return put(cube, bands_.order(distance));
    const std::int8_t order = bands_.order(std::max(0.0, distance - radius));
    if (order == bands_.order(distance + radius)) return put(cube, order);
    const std::int32_t half = cube.edge / 2;
    for (int part = 0; part < 8; ++part) {
      const Cube eighth{{cube.min.x + (part & 1) * half, cube.min.y + (part >> 1 & 1) * half,
                         cube.min.z + (part >> 2) * half},
                        half};
      if (is_solid(eighth)) continue;  // settle() sets these voxels
      fill(eighth, tree_.nearest_with_guess(eighth.centre_vox(), nearest.triangle));
    }
  }
  /// Returns whether every voxel of a small cube is interior or boundary; false for larger cubes.
  bool is_solid(const Cube& cube) const {
    if (cube.edge > 4) return false;
    const workspace::VoxelBox& box = solid_.box;
    const workspace::Index3 low{cube.min.x - box.min.x, cube.min.y - box.min.y, cube.min.z - box.min.z};
    if (low.x < 0 || low.y < 0 || low.z < 0 || low.x + cube.edge > box.size[0] ||
        low.y + cube.edge > box.size[1] || low.z + cube.edge > box.size[2]) {
      return false;
    }
    for (std::int32_t z = low.z; z < low.z + cube.edge; ++z) {
      for (std::int32_t y = low.y; y < low.y + cube.edge; ++y) {
        for (std::int32_t x = low.x; x < low.x + cube.edge; ++x) {
          if (!solid_.boundary.get(x, y, z) && !solid_.inside.get(x, y, z)) return false;
        }
      }
    }
    return true;
  }
  void put(const Cube& cube, std::int8_t order) {
    if (order == workspace::kOrderFree) return;
    if (!orders_) orders_ = std::make_unique<std::int8_t[]>(workspace::kBrickVoxels);
    for (std::int32_t z = cube.min.z; z < cube.min.z + cube.edge; ++z) {
      for (std::int32_t y = cube.min.y; y < cube.min.y + cube.edge; ++y) {
        for (std::int32_t x = cube.min.x; x < cube.min.x + cube.edge; ++x) {
          orders_[workspace::brick_offset(static_cast<std::uint32_t>(x & 31),
                                          static_cast<std::uint32_t>(y & 31),
                                          static_cast<std::uint32_t>(z & 31))] = order;
        }
      }
    }
  }

  const detail::TriangleTree& tree_;
  const Bands& bands_;
  const voxelise::SolidVoxels& solid_;
  std::unique_ptr<std::int8_t[]> orders_;
};

bool contains(const workspace::VoxelBox& box, workspace::Index3 v) {
  return v.x >= box.min.x && v.y >= box.min.y && v.z >= box.min.z && v.x < box.min.x + box.size[0] &&
         v.y < box.min.y + box.size[1] && v.z < box.min.z + box.size[2];
}

/// Overwrites the orders of the solid's voxels and of voxels beyond the part.
void settle(const voxelise::SolidVoxels& solid, const workspace::VoxelBox& part, workspace::BrickKey key,
            std::unique_ptr<std::int8_t[]>& orders) {
  bool any = false;
  for (std::uint32_t z = 0; z < 32; ++z) {
    for (std::uint32_t y = 0; y < 32; ++y) {
      for (std::uint32_t x = 0; x < 32; ++x) {
        const workspace::Index3 v{key.x * workspace::kBrickEdge + static_cast<std::int32_t>(x),
                                  key.y * workspace::kBrickEdge + static_cast<std::int32_t>(y),
                                  key.z * workspace::kBrickEdge + static_cast<std::int32_t>(z)};
        const std::int32_t in_x = v.x - solid.box.min.x, in_y = v.y - solid.box.min.y,
                           in_z = v.z - solid.box.min.z;
        const bool in_box = contains(solid.box, v);
        const bool boundary = in_box && solid.boundary.get(in_x, in_y, in_z);
        const bool inside = in_box && solid.inside.get(in_x, in_y, in_z);
        const bool wanted = contains(part, v);
        if (!orders && !(wanted && (boundary || inside))) continue;
        if (!orders) orders = std::make_unique<std::int8_t[]>(workspace::kBrickVoxels);
        std::int8_t& order = orders[workspace::brick_offset(x, y, z)];
        if (boundary || inside) order = boundary ? workspace::kOrderBoundary : workspace::kOrderInterior;
        if (!wanted) order = workspace::kOrderFree;
        any = any || order != workspace::kOrderFree;
      }
    }
  }
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
  const workspace::BrickKey first{reached.min.x >> 5, reached.min.y >> 5, reached.min.z >> 5};
  const auto count = [](std::int32_t min, std::int32_t size) {
    return static_cast<std::size_t>(((min + size - 1) >> 5) - (min >> 5) + 1);
  };
  const std::size_t nx = count(reached.min.x, reached.size[0]), ny = count(reached.min.y, reached.size[1]),
                    nz = count(reached.min.z, reached.size[2]);
  const detail::TriangleTree tree(mesh_W, grid);
  const Bands bands(profile);
  std::vector<std::vector<workspace::ObjectBricks::Part>> parts(ny * nz);
  std::atomic<bool> stopped = false;
  std::atomic<std::size_t> done = 0;
  core::parallel_for(options.threads, ny * nz, [&](std::size_t row, std::size_t worker) {
    if (stopped) return;
    BrickOfSurface brick(tree, bands, solid);
    for (std::size_t x = 0; x < nx; ++x) {
      const workspace::BrickKey key{first.x + static_cast<std::int32_t>(x),
                                    first.y + static_cast<std::int32_t>(row % ny),
                                    first.z + static_cast<std::int32_t>(row / ny)};
      auto orders = brick(key);
      settle(solid, part, key, orders);
      if (!orders) continue;
      if (all_interior(orders.get())) orders.reset();  // all such bricks share one block of memory
      parts[row].push_back({key, std::move(orders)});
    }
    const std::size_t now = ++done;
    if (!options.go_on || worker != 0) return;
    if (!options.go_on(static_cast<double>(now) / static_cast<double>(ny * nz))) stopped = true;
  });
  if (stopped) return {};
  std::vector<workspace::ObjectBricks::Part> all;
  for (auto& row : parts) std::move(row.begin(), row.end(), std::back_inserter(all));
  return workspace::ObjectBricks(std::move(all));
}

}  // namespace phantom::layers
