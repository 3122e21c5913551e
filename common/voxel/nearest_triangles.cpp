#include "common/voxel/nearest_triangles.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/point_triangle.hpp"

namespace phantom::voxel::detail {
namespace {

struct Step {
  std::int32_t x, y, z;
};

/// The 13 neighbours that a raster sweep has passed already.
constexpr std::array<Step, 13> kPassed = {{{-1, -1, -1},
                                           {0, -1, -1},
                                           {1, -1, -1},
                                           {-1, 0, -1},
                                           {0, 0, -1},
                                           {1, 0, -1},
                                           {-1, 1, -1},
                                           {0, 1, -1},
                                           {1, 1, -1},
                                           {-1, -1, 0},
                                           {0, -1, 0},
                                           {1, -1, 0},
                                           {-1, 0, 0}}};

}  // namespace

NearestTriangles::NearestTriangles(const std::vector<Eigen::Vector3f>& vertices_vox,
                                   const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                   float reach_vox)
    : vertices_(vertices_vox), triangles_(triangles), reach2_(reach_vox * reach_vox) {
  extent_.reserve(triangles.size());
  for (const auto& t : triangles) {
    const Eigen::Vector3f &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
    extent_.push_back(std::min(1.75F, std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()})));
  }
}

void NearestTriangles::offer(Cell& cell, const Eigen::Vector3f& p, std::int32_t triangle) {
  const auto& t = triangles_[static_cast<std::size_t>(triangle)];
  const Eigen::Vector3f nearest =
      geometry::closest_point_on_triangle(p.cast<double>(), vertices_[t[0]].cast<double>(),
                                          vertices_[t[1]].cast<double>(), vertices_[t[2]].cast<double>())
          .cast<float>();
  const float distance2 = (nearest - p).squaredNorm();
  if (distance2 < cell.distance2) cell = {distance2, triangle, nearest};
}

void NearestTriangles::seed(std::uint32_t triangle) {
  const auto& t = triangles_[triangle];
  const Eigen::Vector3f &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
  const Eigen::Vector3f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const std::int32_t origin[3] = {box_.min.x, box_.min.y, box_.min.z};
  std::int32_t first[3], last[3];
  for (int i = 0; i < 3; ++i) {
    first[i] = std::max(0, static_cast<std::int32_t>(std::floor(low[i])) - 1 - origin[i]);
    last[i] = std::min(box_.size[static_cast<std::size_t>(i)] - 1,
                       static_cast<std::int32_t>(std::floor(high[i])) + 1 - origin[i]);
  }
  const Eigen::Vector3f normal =
      (b - a).cross(c - a).normalized();  // zero for a triangle without area: nothing skipped
  for (std::int32_t z = first[2]; z <= last[2]; ++z) {
    for (std::int32_t y = first[1]; y <= last[1]; ++y) {
      for (std::int32_t x = first[0]; x <= last[0]; ++x) {
        const Eigen::Vector3f p = centre(x, y, z);
        if (std::abs(normal.dot(p - a)) > 1.75F) continue;  // √3: a voxel's diagonal
        offer(cells_[at(x, y, z)], p, static_cast<std::int32_t>(triangle));
      }
    }
  }
}

void NearestTriangles::sweep(int direction) {
  const auto& size = box_.size;
  for (std::int32_t k = 0; k < size[2]; ++k) {
    const std::int32_t z = direction > 0 ? k : size[2] - 1 - k;
    for (std::int32_t j = 0; j < size[1]; ++j) {
      const std::int32_t y = direction > 0 ? j : size[1] - 1 - j;
      for (std::int32_t i = 0; i < size[0]; ++i) {
        const std::int32_t x = direction > 0 ? i : size[0] - 1 - i;
        Cell& cell = cells_[at(x, y, z)];
        const Eigen::Vector3f p = centre(x, y, z);
        std::int32_t tried = -1;
        for (const Step& step : kPassed) {
          const std::int32_t nx = x + direction * step.x, ny = y + direction * step.y,
                             nz = z + direction * step.z;
          if (nx < 0 || ny < 0 || nz < 0 || nx >= size[0] || ny >= size[1] || nz >= size[2]) continue;
          const Cell& neighbour = cells_[at(nx, ny, nz)];
          const std::int32_t triangle = neighbour.triangle;
          if (triangle < 0 || triangle == cell.triangle || triangle == tried || neighbour.distance2 > reach2_)
            continue;
          // From here the triangle is at best its own extent, or the step, nearer than the neighbour's
          // nearest point.
          const float at_best =
              std::sqrt((neighbour.nearest - p).squaredNorm()) - extent_[static_cast<std::size_t>(triangle)];
          if (at_best > 0 && at_best * at_best >= cell.distance2) continue;
          tried = triangle;
          offer(cell, p, triangle);
        }
      }
    }
  }
}

void NearestTriangles::compute(const VoxelBox& box, std::span<const std::uint32_t> list) {
  box_ = box;
  cells_.assign(box.voxel_count(), {std::numeric_limits<float>::infinity(), -1, Eigen::Vector3f::Zero()});
  for (const std::uint32_t triangle : list) seed(triangle);
  for (const int direction : {1, -1, 1, -1}) sweep(direction);
}

float NearestTriangles::distance_vox(Index3 v) const {
  return std::sqrt(cells_[at(v.x - box_.min.x, v.y - box_.min.y, v.z - box_.min.z)].distance2);
}

}  // namespace phantom::voxel::detail
