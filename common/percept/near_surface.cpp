#include "common/percept/near_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace phantom::percept {
namespace {

bool is_body(std::int8_t order) noexcept {
  return order >= workspace::kOrderBoundary || order < workspace::kOrderFree;
}
bool is_body_or_guard(std::int8_t order) noexcept {
  return is_body(order) || order == workspace::kOrderGuard;
}

/// The cube of voxels around a place, as far as a radius reaches.
struct Around {
  workspace::Index3 centre;
  Eigen::Vector3d from_origin_m, sides_m;
  double radius_m;
  std::array<int, 3> reach{};

  Around(const workspace::GridSpec& grid, const Eigen::Vector3d& position_m, double wanted_m) noexcept
      : centre(grid.index_of(position_m)),
        from_origin_m(position_m - grid.origin_m),
        sides_m(grid.voxel_size_m.sides_m()),
        radius_m(std::clamp(wanted_m, 0.0, kMaxNearVoxels * sides_m.minCoeff())) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      reach[axis] = static_cast<int>(std::ceil(radius_m / sides_m[static_cast<Eigen::Index>(axis)]));
  }
  /// The way from the place to the nearest point of a voxel.
  Eigen::Vector3d way_m(workspace::Index3 voxel) const noexcept {
    const Eigen::Vector3d lower = workspace::vector(voxel).cwiseProduct(sides_m);
    return from_origin_m.cwiseMax(lower).cwiseMin(lower + sides_m) - from_origin_m;
  }
};

/// Calls visit(i) for 0, −1, 1, −2, … `reach`.
template <class Visit>
void outwards(int reach, const Visit& visit) noexcept {
  for (int k = 0; k <= 2 * reach; ++k) visit(k % 2 == 1 ? -(k + 1) / 2 : k / 2);
}

/// Finds the nearest voxel with an order for which `is` holds. What lies farther along one axis than the
/// nearest so far is not looked up.
template <class Is>
NearVoxel nearest(const workspace::Workspace& workspace, const Eigen::Vector3d& position_m, double radius_m,
                  const Is& is) noexcept {
  NearVoxel found;
  if (!position_m.allFinite()) return found;
  const Around around(workspace.grid(), position_m, radius_m);
  double least_m = std::numeric_limits<double>::infinity();
  const auto is_farther = [&](int steps, Eigen::Index axis) {
    return std::max(0, std::abs(steps) - 1) * around.sides_m[axis] >= least_m;
  };
  outwards(around.reach[2], [&](int z) {
    if (is_farther(z, 2)) return;
    outwards(around.reach[1], [&](int y) {
      if (is_farther(y, 1)) return;
      outwards(around.reach[0], [&](int x) {
        if (is_farther(x, 0)) return;
        const workspace::Index3 voxel = around.centre + workspace::Index3{x, y, z};
        if (!is(workspace.order(voxel))) return;
        const Eigen::Vector3d way_m = around.way_m(voxel);
        const double distance_m = way_m.norm();
        if (distance_m > around.radius_m || distance_m >= least_m) return;
        least_m = distance_m;
        found = {true, distance_m, way_m, workspace.object(voxel)};
      });
    });
  });
  return found;
}

}  // namespace

NearVoxel near_surface(const workspace::Workspace& workspace, const Eigen::Vector3d& position_m,
                       double radius_m) noexcept {
  return nearest(workspace, position_m, radius_m, is_body_or_guard);
}

NearVoxel near_free(const workspace::Workspace& workspace, const Eigen::Vector3d& position_m,
                    double radius_m) noexcept {
  return nearest(workspace, position_m, radius_m, [](std::int8_t order) { return !is_body(order); });
}

}  // namespace phantom::percept
