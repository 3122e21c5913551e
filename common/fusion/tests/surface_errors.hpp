#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

#include "common/fusion/camera_scene.hpp"
#include "common/fusion/fusion.hpp"

namespace phantom::fusion::scenes {

/// How far the surface that was fused is from the true one, at each edge between two voxels that it crosses.
class SurfaceErrors {
 public:
  /// Takes the voxels of `box` that were measured ten times at least; none at the grid's far sides.
  SurfaceErrors(const Fusion& fusion, const CameraScene& truth, const workspace::VoxelBox& box) {
    const workspace::GridSpec& grid = fusion.grid();
    box.for_each([&](workspace::Index3 v) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        workspace::Index3 next = v;
        ++next[axis];
        if (fusion.weight(v) < 10 || fusion.weight(next) < 10) continue;
        const double d = fusion.distance_vox(v), e = fusion.distance_vox(next);
        if ((d > 0.0) == (e > 0.0) || std::abs(d) > 2.0 || std::abs(e) > 2.0) continue;
        Eigen::Vector3d p = grid.centre_of(v);
        p[static_cast<Eigen::Index>(axis)] += d / (d - e) * grid.voxel_size_m.reference_m();
        errors_m_.push_back(truth.distance_m(p, 0.1));
      }
    });
    std::ranges::sort(errors_m_);
  }

  std::size_t count() const { return errors_m_.size(); }
  double mean_m() const {
    return std::accumulate(errors_m_.begin(), errors_m_.end(), 0.0) / static_cast<double>(count());
  }
  /// The error that `percent` of them do not exceed.
  double percentile_m(std::size_t percent) const {
    return errors_m_[std::min(count() - 1, count() * percent / 100)];
  }

 private:
  std::vector<double> errors_m_;
};

}  // namespace phantom::fusion::scenes
