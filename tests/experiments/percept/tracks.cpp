#include "tests/experiments/percept/tracks.hpp"

#include <algorithm>
#include <cmath>

#include "tests/experiments/percept/outlines.hpp"
#include "tests/experiments/specimens.hpp"

namespace phantom::experiments {
namespace {

const Eigen::Vector3d kCentre_vox{60.0, 44.0, 40.0};
constexpr double kRadius_vox = 32.0, kHeight_vox = 40.0;

}  // namespace

workspace::GridSpec track_grid(const Eigen::Vector3d& low_vox, const Eigen::Vector3d& high_vox) {
  return layers::grid_over(kTrackVoxel_m * low_vox, kTrackVoxel_m * high_vox, kTrackVoxel_m);
}

geometry::TriangleMesh track_cylinder() {
  return placed(complex_cylinder(kTrackVoxel_m * kRadius_vox, kTrackVoxel_m * kHeight_vox),
                kTrackVoxel_m * kCentre_vox, kTrackTurned_rad);
}

double distance_to_track_cylinder_vox(double x_vox, double y_vox) {
  const Eigen::Matrix2d turned =
      geometry::rotation_from_rpy(0.0, 0.0, kTrackTurned_rad).topLeftCorner<2, 2>();
  const Outline section{complex_section(kRadius_vox)};
  const Eigen::Vector2d p = turned.transpose() * (Eigen::Vector2d(x_vox, y_vox) - kCentre_vox.head<2>());
  const double distance = distance_to(section, p);
  return is_inside(section, p) ? -distance : distance;
}

Walk walk(Probe& probe, double y_vox, double z_vox, double from_vox, double to_vox, double speed_m_per_s,
          int per_voxel) {
  Walk result;
  const auto count = static_cast<int>((to_vox - from_vox) * per_voxel);
  for (int i = 0; i < count; ++i) {
    const double x_vox = from_vox + (i + 0.5) / per_voxel;
    // Across the motion the middle of a voxel: the tracks' coordinates are voxels.
    const Eigen::Vector3d p_m = kTrackVoxel_m * Eigen::Vector3d(x_vox, y_vox + 0.5, z_vox + 0.5);
    const Felt felt = probe.at(p_m, {speed_m_per_s, 0.0, 0.0});
    result.x_vox.push_back(x_vox);
    result.mu_Pa_s_per_m.push_back(felt.mu_Pa_s_per_m);
    result.force_N.push_back(-felt.force_N.x());
  }
  return result;
}

int count_peaks(const std::vector<double>& values) {
  std::vector<double> runs;
  for (const double value : values) {
    if (runs.empty() || std::abs(value - runs.back()) > 1e-3 * std::abs(value)) runs.push_back(value);
  }
  int peaks = 0;
  for (std::size_t i = 1; i + 1 < runs.size(); ++i)
    peaks += runs[i] > runs[i - 1] && runs[i] > runs[i + 1] ? 1 : 0;
  return peaks;
}

}  // namespace phantom::experiments
