#pragma once

// Slow, literal statements of the dilation and surface methods and of the layers inside a body.

#include "common/geometry/point_triangle.hpp"
#include "common/layers/layers.hpp"
#include "common/layers/tests/object_voxels.hpp"
#include "common/voxelise/tests/literal_twins.hpp"

namespace phantom::layers::twin {

/// Whether the thesis's element holds the cell, in words of spec 1.4, apart from the product's own statement.
inline bool element_holds(workspace::ShapingElement element, int m, int i, int j, int k) {
  const double radius = std::sqrt(static_cast<double>(i * i + j * j + k * k));
  if (element == workspace::ShapingElement::kSphere) return radius <= m;
  if (element == workspace::ShapingElement::kSphereContained) return radius <= m + 0.5;
  return true;
}

/// Sets every free voxel under the element, centred on each voxel of order `from`, to `order`.
inline void dilate(ObjectVoxels& ova, std::int8_t from, workspace::ShapingElement element, int m,
                   std::int8_t order) {
  voxelise::twin::for_each(ova.box, [&](workspace::Index3 v) {
    if (ova.at(v) != from) return;
    for (int k = -m; k <= m; ++k) {
      for (int j = -m; j <= m; ++j) {
        for (int i = -m; i <= m; ++i) {
          const workspace::Index3 n{v.x + i, v.y + j, v.z + k};
          const workspace::VoxelBox cell{n, {1, 1, 1}};
          if (!element_holds(element, m, i, j, k) || ova.box.intersection(cell).empty() ||
              ova.at(n) != workspace::kOrderFree)
            continue;
          ova.order[ova.index(n.x - ova.box.min.x, n.y - ova.box.min.y, n.z - ova.box.min.z)] = order;
        }
      }
    }
  });
}

/// The solid alone, in a box.
inline ObjectVoxels solid_orders(const voxelise::SolidVoxels& solid, const workspace::VoxelBox& box) {
  ObjectVoxels ova;
  ova.box = box;
  voxelise::twin::for_each(box, [&](workspace::Index3 v) {
    ova.order.push_back(voxelise::twin::is_boundary(solid, v) ? workspace::kOrderBoundary
                        : voxelise::twin::is_solid(solid, v)  ? workspace::kOrderInterior
                                                              : workspace::kOrderFree);
  });
  return ova;
}

/// Spec 1.4, dilation method, word for word.
inline ObjectVoxels dilation(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile) {
  ObjectVoxels ova = solid_orders(solid, solid.box.grown(profile.reach_vox()));
  if (profile.guard_vox > 0) {
    const auto solids = voxelise::twin::solid_voxels(solid);
    std::size_t i = 0;
    voxelise::twin::for_each(ova.box, [&](workspace::Index3 v) {
      std::int8_t& order = ova.order[i++];
      if (order != workspace::kOrderFree) return;
      for (const workspace::Index3 s : solids) {
        if (std::hypot(v.x - s.x, v.y - s.y, v.z - s.z) <= profile.guard_vox) order = workspace::kOrderGuard;
      }
    });
  }
  std::int8_t from = profile.guard_vox > 0 ? workspace::kOrderGuard : workspace::kOrderBoundary;
  for (std::size_t i = 0; i < profile.thickness_vox.size(); ++i) {
    const auto order = static_cast<std::int8_t>(i + 1);
    dilate(ova, from, profile.element, profile.thickness_vox[i], order);
    from = order;
  }
  return ova;
}

/// Order outside of the solid at a distance, in words of spec 1.4.
inline std::int8_t order_at(const workspace::LayerProfile& profile, double d) {
  if (d <= profile.guard_vox) return workspace::kOrderGuard;
  double until = profile.guard_vox;
  for (std::size_t i = 0; i < profile.thickness_vox.size(); ++i) {
    until += profile.thickness_vox[i];
    if (d <= until) return static_cast<std::int8_t>(i + 1);
  }
  return workspace::kOrderFree;
}

/// Distance in shortest sides of a voxel from a voxel's centre to the nearest of all triangles.
inline double surface_distance(const geometry::TriangleMesh& mesh, const workspace::GridSpec& grid,
                               workspace::Index3 v) {
  const Eigen::Vector3d& sides_m = grid.voxel_size_m.sides_m();
  const Eigen::Vector3d p = Eigen::Vector3d(v.x + 0.5, v.y + 0.5, v.z + 0.5).cwiseProduct(sides_m);
  double least = 1e30;
  for (const auto& t : mesh.triangles) {
    std::array<Eigen::Vector3d, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) corners[i] = mesh.vertices_m[t[i]].cast<double>() - grid.origin_m;
    least = std::min(
        least,
        (geometry::closest_point_on_triangle(p, corners[0], corners[1], corners[2]) - p).squaredNorm());
  }
  return std::sqrt(least) / std::min({sides_m.x(), sides_m.y(), sides_m.z()});
}

/// Order of an interior voxel with layers inside the body.
inline std::int8_t inside_order(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile,
                                workspace::Index3 v, const workspace::VoxelSize& size = 1.0) {
  double d = 1e30;
  const int depth = profile.inside_depth_vox();  // farther ones do not matter
  const workspace::VoxelBox near{{v.x - depth, v.y - depth, v.z - depth},
                                 {2 * depth + 1, 2 * depth + 1, 2 * depth + 1}};
  voxelise::twin::for_each(near.intersection(solid.box), [&](workspace::Index3 n) {
    if (!voxelise::twin::is_solid(solid, n) || voxelise::twin::is_boundary(solid, n))
      d = std::min(d, voxelise::twin::distance_m(v, n, size));
  });
  int until = 0;
  for (std::size_t i = 0; i < profile.inside_thickness_vox.size(); ++i) {
    until += profile.inside_thickness_vox[i];
    if (d <= voxelise::twin::limit_m(until, size)) return static_cast<std::int8_t>(-static_cast<int>(i) - 1);
  }
  return workspace::kOrderInterior;
}

}  // namespace phantom::layers::twin
