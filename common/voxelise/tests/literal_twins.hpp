#pragma once

// Slow, literal statements of what the fast algorithms must give.

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"
#include "common/layers/layers.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::voxelise::twin {

inline bool get(const SolidVoxels& solid, const workspace::BitVolume& bits, workspace::Index3 v) {
  const std::int32_t x = v.x - solid.box.min.x, y = v.y - solid.box.min.y, z = v.z - solid.box.min.z;
  return x >= 0 && y >= 0 && z >= 0 && x < solid.box.size[0] && y < solid.box.size[1] &&
         z < solid.box.size[2] && bits.get(x, y, z);
}
inline bool is_boundary(const SolidVoxels& solid, workspace::Index3 v) {
  return get(solid, solid.boundary, v);
}
inline bool is_inside(const SolidVoxels& solid, workspace::Index3 v) { return get(solid, solid.inside, v); }
inline bool is_solid(const SolidVoxels& solid, workspace::Index3 v) {
  return is_boundary(solid, v) || get(solid, solid.inside, v);
}

template <class Do>
void for_each(const workspace::VoxelBox& box, Do action) {
  for (std::int32_t z = box.min.z; z < box.min.z + box.size[2]; ++z) {
    for (std::int32_t y = box.min.y; y < box.min.y + box.size[1]; ++y) {
      for (std::int32_t x = box.min.x; x < box.min.x + box.size[0]; ++x) action(workspace::Index3{x, y, z});
    }
  }
}

inline std::vector<workspace::Index3> solid_voxels(const SolidVoxels& solid) {
  std::vector<workspace::Index3> all;
  for_each(solid.box, [&](workspace::Index3 v) {
    if (is_solid(solid, v)) all.push_back(v);
  });
  return all;
}

/// A limit between layers in metres, with reserve for rounding: where it passes through voxels' centres,
/// those are within it.
inline double limit_m(int thickness_vox, const workspace::VoxelSize& size) {
  const Eigen::Vector3d& sides_m = size.sides_m();
  return thickness_vox * std::min({sides_m.x(), sides_m.y(), sides_m.z()}) * (1.0 + 5e-10);
}

inline double distance_m(workspace::Index3 a, workspace::Index3 b, const workspace::VoxelSize& size) {
  return std::hypot((a.x - b.x) * size[0], (a.y - b.y) * size[1], (a.z - b.z) * size[2]);
}

/// Spec 1.4, distance method, word for word, in metres: layers are as thick as so many shortest sides.
inline std::int8_t order(const SolidVoxels& solid, const std::vector<workspace::Index3>& solids,
                         const workspace::LayerProfile& profile, workspace::Index3 v,
                         const workspace::VoxelSize& size = 1.0) {
  if (is_boundary(solid, v)) return workspace::kOrderBoundary;
  if (is_solid(solid, v)) return workspace::kOrderInterior;
  double d = 1e30;
  for (const workspace::Index3 s : solids) d = std::min(d, distance_m(v, s, size));
  int until = profile.guard_vox;
  if (d <= limit_m(until, size)) return workspace::kOrderGuard;
  for (std::size_t i = 0; i < profile.thickness_vox.size(); ++i) {
    until += profile.thickness_vox[i];
    if (d <= limit_m(until, size)) return static_cast<std::int8_t>(i + 1);
  }
  return workspace::kOrderFree;
}

/// Whether the triangle meets the voxel [low − slack, low + sides + slack]: clipped against its six faces,
/// something is left.
inline bool meets_voxel(const std::array<Eigen::Vector3d, 3>& triangle, const Eigen::Vector3d& low,
                        const workspace::VoxelSize& size, double slack) {
  std::vector<Eigen::Vector3d> polygon(triangle.begin(), triangle.end());
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      const double limit = side < 0 ? low[axis] - slack : low[axis] + size.sides_m()[axis] + slack;
      std::vector<Eigen::Vector3d> kept;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Eigen::Vector3d &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        const double dp = side * (p[axis] - limit), dq = side * (q[axis] - limit);
        if (dp <= 0) kept.push_back(p);
        if ((dp < 0 && dq > 0) || (dp > 0 && dq < 0)) kept.push_back(p + dp / (dp - dq) * (q - p));
      }
      polygon = std::move(kept);
      if (polygon.empty()) return false;
    }
  }
  return true;
}

/// Voxels that a path of face neighbours reaches from outside of the box without stepping on the boundary.
inline std::vector<bool> reached_from_outside(const SolidVoxels& solid, const workspace::VoxelBox& box) {
  std::vector<bool> reached(box.voxel_count(), false);
  const auto at = [&](workspace::Index3 v) {
    return (static_cast<std::size_t>(v.z - box.min.z) * static_cast<std::size_t>(box.size[1]) +
            static_cast<std::size_t>(v.y - box.min.y)) *
               static_cast<std::size_t>(box.size[0]) +
           static_cast<std::size_t>(v.x - box.min.x);
  };
  std::vector<workspace::Index3> open{box.min};  // the box must be wider than the body
  reached[at(box.min)] = true;
  while (!open.empty()) {
    const workspace::Index3 v = open.back();
    open.pop_back();
    for (const workspace::Index3 n : {workspace::Index3{v.x + 1, v.y, v.z},
                                      {v.x - 1, v.y, v.z},
                                      {v.x, v.y + 1, v.z},
                                      {v.x, v.y - 1, v.z},
                                      {v.x, v.y, v.z + 1},
                                      {v.x, v.y, v.z - 1}}) {
      const bool in_box = n.x >= box.min.x && n.y >= box.min.y && n.z >= box.min.z &&
                          n.x < box.min.x + box.size[0] && n.y < box.min.y + box.size[1] &&
                          n.z < box.min.z + box.size[2];
      if (!in_box || reached[at(n)] || is_boundary(solid, n)) continue;
      reached[at(n)] = true;
      open.push_back(n);
    }
  }
  return reached;
}

}  // namespace phantom::voxelise::twin
