#include "common/voxelise/distance_field.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::voxelise {

std::size_t DistanceField::cube_index(std::int32_t x, std::int32_t y, std::int32_t z) const noexcept {
  return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size_cubes_[1]) +
          static_cast<std::size_t>(y)) *
             static_cast<std::size_t>(size_cubes_[0]) +
         static_cast<std::size_t>(x);
}

namespace {

std::size_t offset_in_cube(workspace::Index3 v) noexcept {
  return static_cast<std::size_t>((v.z & 7) << 6 | (v.y & 7) << 3 | (v.x & 7));
}

}  // namespace

double DistanceField::sample_m(workspace::Index3 v) const noexcept {
  v.x = std::clamp(v.x, 0, grid_.size_vox[0] - 1);
  v.y = std::clamp(v.y, 0, grid_.size_vox[1] - 1);
  v.z = std::clamp(v.z, 0, grid_.size_vox[2] - 1);
  const std::int32_t cube = directory_[cube_index(v.x >> 3, v.y >> 3, v.z >> 3)];
  if (cube == kFar) return outside_m_;
  if (cube == kDeep) return -inside_m_;
  return quantum_m_ * samples_[static_cast<std::size_t>(cube) * kCubeVoxels + offset_in_cube(v)];
}

namespace {

/// The first of the eight samples around a point, and the point's position between them.
struct Neighbourhood {
  workspace::Index3 base;
  Eigen::Vector3d t;
};

bool locate(const workspace::GridSpec& grid, const Eigen::Vector3d& p_W_m, Neighbourhood& out) noexcept {
  const Eigen::Vector3d voxels = (p_W_m - grid.origin_m) / grid.voxel_size_m;
  for (int i = 0; i < 3; ++i) {
    if (!(voxels[i] >= 0 && voxels[i] < grid.size_vox[static_cast<std::size_t>(i)])) return false;
  }
  const Eigen::Vector3d q = voxels.array() - 0.5;
  out.base = {static_cast<std::int32_t>(std::floor(q.x())), static_cast<std::int32_t>(std::floor(q.y())),
              static_cast<std::int32_t>(std::floor(q.z()))};
  out.t = q - Eigen::Vector3d(out.base.x, out.base.y, out.base.z);
  return true;
}

}  // namespace

double DistanceField::distance_m(const Eigen::Vector3d& p_W_m) const noexcept {
  Neighbourhood n;
  if (!locate(grid_, p_W_m, n)) return outside_m_;
  double sum = 0.0;
  for (std::int32_t corner = 0; corner < 8; ++corner) {
    const std::int32_t i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    const double weight = (i != 0 ? n.t.x() : 1 - n.t.x()) * (j != 0 ? n.t.y() : 1 - n.t.y()) *
                          (k != 0 ? n.t.z() : 1 - n.t.z());
    sum += weight * sample_m({n.base.x + i, n.base.y + j, n.base.z + k});
  }
  return sum;
}

Eigen::Vector3d DistanceField::gradient(const Eigen::Vector3d& p_W_m) const noexcept {
  Neighbourhood n;
  if (!locate(grid_, p_W_m, n)) return Eigen::Vector3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::int32_t corner = 0; corner < 8; ++corner) {
    const std::int32_t i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    const double sample = sample_m({n.base.x + i, n.base.y + j, n.base.z + k});
    const double wx = i != 0 ? n.t.x() : 1 - n.t.x(), wy = j != 0 ? n.t.y() : 1 - n.t.y(),
                 wz = k != 0 ? n.t.z() : 1 - n.t.z();
    sum += sample * Eigen::Vector3d((i != 0 ? 1 : -1) * wy * wz, (j != 0 ? 1 : -1) * wx * wz,
                                    (k != 0 ? 1 : -1) * wx * wy);
  }
  return sum / grid_.voxel_size_m;
}

std::uint16_t DistanceField::object(const Eigen::Vector3d& p_W_m) const noexcept {
  Neighbourhood n;
  if (!locate(grid_, p_W_m, n)) return 0;
  const workspace::Index3 v = grid_.index_of(p_W_m);
  if (!grid_.contains(v)) return 0;
  const std::int32_t cube = directory_[cube_index(v.x >> 3, v.y >> 3, v.z >> 3)];
  return cube < 0 ? std::uint16_t{0}
                  : objects_[static_cast<std::size_t>(cube) * kCubeVoxels + offset_in_cube(v)];
}

std::size_t DistanceField::bytes() const noexcept {
  return directory_.size() * sizeof(directory_[0]) +
         samples_.size() * (sizeof(samples_[0]) + sizeof(objects_[0]));
}

}  // namespace phantom::voxelise
