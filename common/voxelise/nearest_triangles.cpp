#include "common/voxelise/nearest_triangles.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/point_triangle.hpp"

namespace phantom::voxelise::detail {
namespace {

constexpr float kDiagonal = 1.75F;  // slightly above √3, the diagonal of a voxel
constexpr float kLarge_vox = 4.0F;
constexpr float kBucketsPerVoxel = 4.0F;
constexpr std::size_t kAskEvery = 8192;  // voxels: takes some milliseconds

}  // namespace

NearestTriangles::NearestTriangles(const std::vector<Eigen::Vector3f>& vertices_vox,
                                   const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                   const workspace::VoxelBox& region, float reach_vox,
                                   const std::function<bool()>& keep_going)
    : vertices_(vertices_vox),
      triangles_(triangles),
      reach_(reach_vox),
      origin_{region.min.x & ~7, region.min.y & ~7, region.min.z & ~7},
      first_{region.min.x - origin_.x, region.min.y - origin_.y, region.min.z - origin_.z},
      end_{first_.x + region.size[0], first_.y + region.size[1], first_.z + region.size[2]},
      cubes_x_(static_cast<std::size_t>(end_.x + 7) / 8),
      cubes_y_(static_cast<std::size_t>(end_.y + 7) / 8),
      directory_(cubes_x_ * cubes_y_ * (static_cast<std::size_t>(end_.z + 7) / 8), nullptr),
      buckets_(static_cast<std::size_t>((reach_vox + kDiagonal) * kBucketsPerVoxel) + 2) {
  large_.reserve(triangles.size());
  for (const auto& t : triangles) {
    const Eigen::Vector3f &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
    large_.push_back(std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}) > kLarge_vox ? 1 : 0);
  }
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    if (!goes_on(keep_going, seed(i))) return;
  }
  for (; bucket_ < buckets_.size(); ++bucket_) {
    for (std::size_t i = 0; i < buckets_[bucket_].size(); ++i) {  // grows while it is processed
      const Entry entry = buckets_[bucket_][i];
      hand_on(entry);
      if (!goes_on(keep_going, 1)) return;
    }
    std::vector<Entry>().swap(buckets_[bucket_]);
  }
}

bool NearestTriangles::goes_on(const std::function<bool()>& keep_going, std::size_t work) {
  unasked_ += work;
  if (unasked_ < kAskEvery) return true;
  unasked_ = 0;
  whole_ = !keep_going || keep_going();
  return whole_;
}

std::size_t NearestTriangles::bucket_of(float distance) const {
  return std::min(buckets_.size() - 1, static_cast<std::size_t>(distance * kBucketsPerVoxel));
}

NearestTriangles::Cell& NearestTriangles::cell(const Entry& e) {
  Cube*& cube = directory_[cube_index(e.x, e.y, e.z)];
  if (cube == nullptr) cube = &cubes_.emplace_back();
  return (*cube)[in_cube(e.x, e.y, e.z)];
}

bool NearestTriangles::knows_cube(workspace::Index3 corner) const {
  const std::int32_t x = corner.x - origin_.x, y = corner.y - origin_.y, z = corner.z - origin_.z;
  if (x < 0 || y < 0 || z < 0 || x >= end_.x || y >= end_.y || z >= end_.z) return false;
  return directory_[cube_index(x, y, z)] != nullptr;
}

float NearestTriangles::distance_vox(workspace::Index3 v) const {
  if (!knows_cube({v.x & ~7, v.y & ~7, v.z & ~7})) return std::numeric_limits<float>::infinity();
  const std::int32_t x = v.x - origin_.x, y = v.y - origin_.y, z = v.z - origin_.z;
  return (*directory_[cube_index(x, y, z)])[in_cube(x, y, z)].distance;
}

void NearestTriangles::offer(const Entry& entry, Cell& cell, std::int32_t triangle) {
  const auto& t = triangles_[static_cast<std::size_t>(triangle)];
  const Eigen::Vector3f p = centre(entry);
  const Eigen::Vector3f nearest =
      geometry::closest_point_on_triangle(p, vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]);
  take(entry, cell, {(nearest - p).norm(), triangle, nearest, true, false});
}

void NearestTriangles::take(const Entry& entry, Cell& cell, const Cell& better) {
  if (better.distance >= cell.distance) return;
  cell = better;
  if (better.distance <= reach_) buckets_[std::max(bucket_, bucket_of(better.distance))].push_back(entry);
}

// Computes the exact distances near a triangle. Returns how many voxels were looked at.
std::size_t NearestTriangles::seed(std::uint32_t triangle) {
  const auto& t = triangles_[triangle];
  const Eigen::Vector3f &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
  const Eigen::Vector3f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const std::int32_t origin[3] = {origin_.x, origin_.y, origin_.z};
  const std::int32_t least[3] = {first_.x, first_.y, first_.z}, most[3] = {end_.x, end_.y, end_.z};
  std::int32_t from[3], to[3];
  for (int i = 0; i < 3; ++i) {
    from[i] = std::max(least[i], static_cast<std::int32_t>(std::floor(low[i])) - 1 - origin[i]);
    to[i] = std::min(most[i] - 1, static_cast<std::int32_t>(std::floor(high[i])) + 1 - origin[i]);
  }
  const Eigen::Vector3f normal =
      (b - a).cross(c - a).normalized();  // zero for a triangle without area: nothing is skipped
  for (std::int32_t z = from[2]; z <= to[2]; ++z) {
    for (std::int32_t y = from[1]; y <= to[1]; ++y) {
      for (std::int32_t x = from[0]; x <= to[0]; ++x) {
        const Entry entry{static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                          static_cast<std::int16_t>(z)};
        if (std::abs(normal.dot(centre(entry) - a)) > kDiagonal) continue;
        offer(entry, cell(entry), static_cast<std::int32_t>(triangle));
      }
    }
  }
  std::size_t looked_at = 1;
  for (int i = 0; i < 3; ++i) looked_at *= static_cast<std::size_t>(std::max(0, to[i] - from[i] + 1));
  return looked_at;
}

void NearestTriangles::hand_on(const Entry& entry) {
  Cell& mine = cell(entry);
  if (mine.handed_on) return;
  if (!mine.exact) {
    mine.distance = std::nextafter(mine.distance, 2 * reach_);  // an equal exact distance counts as better
    mine.exact = true;
    offer(entry, mine, mine.triangle);
  }
  mine.handed_on = true;
  const Cell from = mine;
  const Eigen::Vector3f away = centre(entry) - from.nearest;
  const bool large = large_[static_cast<std::size_t>(from.triangle)] != 0;
  const float reach2 = reach_ * reach_;
  for (std::int16_t dz = -1; dz <= 1; ++dz) {
    for (std::int16_t dy = -1; dy <= 1; ++dy) {
      for (std::int16_t dx = -1; dx <= 1; ++dx) {
        const Eigen::Vector3f step(dx, dy, dz);
        if (step.dot(away) <= 0) continue;  // the front moves outwards only; also skips the voxel itself
        const Entry next{static_cast<std::int16_t>(entry.x + dx), static_cast<std::int16_t>(entry.y + dy),
                         static_cast<std::int16_t>(entry.z + dz)};
        if (!in_region(next)) continue;
        const float distance2 = (away + step).squaredNorm();  // to this voxel's nearest point: an upper bound
        // The exact distance is smaller by at most the square of the step (see below): still out of reach.
        if (distance2 - step.squaredNorm() > reach2) continue;
        Cell& neighbour = cell(next);
        if (neighbour.triangle == from.triangle && neighbour.exact) continue;
        const float known2 = neighbour.distance * neighbour.distance;
        if (large) {
          // By projection onto a convex set: the triangle's point nearest to the neighbour is nearer than
          // this upper bound by at most the square of the step (in squared distance).
          if (distance2 - step.squaredNorm() < known2) offer(next, neighbour, from.triangle);
        } else if (distance2 < known2) {
          // For a small triangle the difference is smaller: the exact distance is computed when the front
          // arrives.
          take(next, neighbour, {std::sqrt(distance2), from.triangle, from.nearest, false, false});
        }
      }
    }
  }
}

}  // namespace phantom::voxelise::detail
