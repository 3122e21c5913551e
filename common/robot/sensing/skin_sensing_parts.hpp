#pragma once

// What the sources of SkinSensing share.

#include "common/robot/sensing/skin_sensing.hpp"

namespace phantom::robot {

/// A link farther from the grid's origin than this feels nothing. The kernel's integers can hold that many
/// voxels.
constexpr double kFarthest_vox = 1e9;

/// Also returns false for a pose that is not finite.
inline bool is_near(const geometry::Pose& X_WL, const workspace::GridSpec& grid) noexcept {
  return X_WL.rotation.allFinite() &&
         (X_WL.translation_m - grid.origin_m).norm() < kFarthest_vox * grid.voxel_size_m.reference_m();
}

struct SkinSensing::Totals {
  kernel::Moments moments{};
  kernel::GradientSums slopes{};
  std::size_t active = 0, muted = 0;

  /// Adds what the kernel adds for one sensor of effective viscosity `mu` and gradient `g` per reference
  /// length, at `p_L_m` in the link's frame and `r` reference lengths from the link's origin in W axes.
  void add(double weight, double mu, const Eigen::Vector3d& p_L_m) noexcept {
    const double m = weight * mu, x = p_L_m.x(), y = p_L_m.y(), z = p_L_m.z();
    const double terms[10] = {1.0, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z};
    for (std::size_t k = 0; k < 10; ++k) moments.sum[k] += m * terms[k];
    ++active;
  }
  void add_slope(double weight, double mu, const Eigen::Vector3d& g, const Eigen::Vector3d& r) noexcept {
    const Eigen::Vector3d turn = r.cross(g);
    for (Eigen::Index k = 0; k < 3; ++k) {
      slopes.sum[k] += weight * g[k];
      slopes.sum[k + 3] += weight * turn[k];
    }
    slopes.sum[6] += weight * g.squaredNorm() / mu;
  }
  void add(const Totals& other) noexcept {
    for (std::size_t k = 0; k < 10; ++k) moments.sum[k] += other.moments.sum[k];
    for (std::size_t k = 0; k < 7; ++k) slopes.sum[k] += other.slopes.sum[k];
    active += other.active;
    muted += other.muted;
  }
};

/// Sensors of one link that one thread takes: point sensors by packed index, or cluster sensors by index in
/// the layout.
struct alignas(64) SkinSensing::Part {
  std::size_t link, first, end;
  bool clusters;
  Totals totals;
};

}  // namespace phantom::robot
