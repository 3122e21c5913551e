#include "common/voxel/nearest_triangles.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/point_triangle.hpp"

namespace phantom::voxel::detail {
namespace {

constexpr float kDiagonal = 1.75F;  // √3, a voxel's

}  // namespace

NearestTriangles::NearestTriangles(const std::vector<Eigen::Vector3f>& vertices_vox,
                                   const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                   float reach_vox)
    : vertices_(vertices_vox),
      triangles_(triangles),
      reach_(reach_vox),
      buckets_(static_cast<std::size_t>((reach_vox + kDiagonal) * kBucketsPerVoxel) + 2) {
  large_.reserve(triangles.size());
  for (const auto& t : triangles) {
    const Eigen::Vector3f &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
    large_.push_back(std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}) > kDiagonal ? 1 : 0);
  }
}

void NearestTriangles::offer(const Entry& entry, Cell& cell, std::int32_t triangle) {
  const auto& t = triangles_[static_cast<std::size_t>(triangle)];
  const Eigen::Vector3f p = centre(entry);
  const Eigen::Vector3f nearest =
      geometry::closest_point_on_triangle(p.cast<double>(), vertices_[t[0]].cast<double>(),
                                          vertices_[t[1]].cast<double>(), vertices_[t[2]].cast<double>())
          .cast<float>();
  take(entry, cell, {(nearest - p).norm(), triangle, nearest, true, false});
}

void NearestTriangles::take(const Entry& entry, Cell& cell, const Cell& better) {
  if (better.distance >= cell.distance) return;
  cell = better;
  if (better.distance <= reach_) buckets_[std::max(bucket_, bucket_of(better.distance))].push_back(entry);
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
      (b - a).cross(c - a).normalized();  // zero for a triangle without area: nothing is skipped
  for (std::int32_t z = first[2]; z <= last[2]; ++z) {
    for (std::int32_t y = first[1]; y <= last[1]; ++y) {
      for (std::int32_t x = first[0]; x <= last[0]; ++x) {
        const Entry entry{static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                          static_cast<std::int16_t>(z)};
        if (std::abs(normal.dot(centre(entry) - a)) > kDiagonal) continue;
        offer(entry, cells_[at(x, y, z)], static_cast<std::int32_t>(triangle));
      }
    }
  }
}

void NearestTriangles::hand_on(const Entry& entry) {
  Cell& mine = cells_[at(entry.x, entry.y, entry.z)];
  if (mine.handed_on) return;
  if (!mine.exact) {
    mine.distance =
        std::nextafter(mine.distance, reach_ * 2);  // so that the same place, exactly, counts as better
    mine.exact = true;
    offer(entry, mine, mine.triangle);
  }
  mine.handed_on = true;
  const Cell cell = mine;
  const Eigen::Vector3f away = centre(entry) - cell.nearest;
  const bool large = large_[static_cast<std::size_t>(cell.triangle)] != 0;
  for (std::int16_t dz = -1; dz <= 1; ++dz) {
    for (std::int16_t dy = -1; dy <= 1; ++dy) {
      for (std::int16_t dx = -1; dx <= 1; ++dx) {
        const Eigen::Vector3f step(dx, dy, dz);
        if (step.dot(away) <= 0) continue;  // the front moves outwards (and the middle is the voxel itself)
        const Entry next{static_cast<std::int16_t>(entry.x + dx), static_cast<std::int16_t>(entry.y + dy),
                         static_cast<std::int16_t>(entry.z + dz)};
        Cell& neighbour = cells_[at(next.x, next.y, next.z)];
        if (neighbour.triangle == cell.triangle || neighbour.distance < 0) continue;
        const float distance2 = (away + step).squaredNorm();  // to our nearest point: an upper bound
        const float known2 = neighbour.distance * neighbour.distance;
        if (large) {
          // Projections onto a convex set: the triangle's own nearest point to the neighbour is at best
          // nearer than ours by the square of the step.
          if (distance2 - step.squaredNorm() < known2) offer(next, neighbour, cell.triangle);
        } else if (distance2 < known2) {
          // A small triangle gains less: the exact distance can wait until the front gets there.
          take(next, neighbour, {std::sqrt(distance2), cell.triangle, cell.nearest, false, false});
        }
      }
    }
  }
}

void NearestTriangles::clear() {
  stride_x_ = static_cast<std::size_t>(box_.size[0]) + 2;
  stride_y_ = static_cast<std::size_t>(box_.size[1]) + 2;
  const Cell rim{-1.0F, -1, Eigen::Vector3f::Zero(), true, false};
  const Cell unknown{std::numeric_limits<float>::infinity(), -1, Eigen::Vector3f::Zero(), true, false};
  cells_.assign(stride_x_ * stride_y_ * (static_cast<std::size_t>(box_.size[2]) + 2), rim);
  for (std::int32_t z = 0; z < box_.size[2]; ++z) {
    for (std::int32_t y = 0; y < box_.size[1]; ++y) {
      std::fill_n(cells_.begin() + static_cast<std::ptrdiff_t>(at(0, y, z)), box_.size[0], unknown);
    }
  }
  for (auto& bucket : buckets_) bucket.clear();
}

void NearestTriangles::compute(const VoxelBox& box, std::span<const std::uint32_t> list) {
  box_ = box;
  clear();
  bucket_ = 0;
  for (const std::uint32_t triangle : list) seed(triangle);
  for (; bucket_ < buckets_.size(); ++bucket_) {
    for (std::size_t i = 0; i < buckets_[bucket_].size(); ++i) {  // grows while it is worked on
      const Entry entry = buckets_[bucket_][i];
      hand_on(entry);
    }
  }
}

}  // namespace phantom::voxel::detail
