#pragma once

#include <vector>

#include "tests/experiments/rig.hpp"

namespace phantom::experiments {

/// The space in which the thesis draws its tracks (figures 4.33, 4.34, 4.40, 6.7): coordinates in voxels of 5
/// mm from W's origin.
inline constexpr double kTrackVoxel_m = 0.005;

/// Voxels from `low` to `high`, in voxels.
workspace::GridSpec track_grid(const Eigen::Vector3d& low_vox, const Eigen::Vector3d& high_vox);

/// The complex cylinder that the tracks pass: axis along z at (60, 44), radius 32 over its lobes, z from 20
/// to 60, turned a little, so that its two lobes towards y = 20 are at different distances from that track.
/// Frame: W.
geometry::TriangleMesh track_cylinder();
/// Headings from its axis, about z from x: to a lobe, and to the middle of a bay.
inline constexpr double kTrackTurned_rad = 0.05, kTrackLobe_rad = 1.5707963267948966 + kTrackTurned_rad,
                        kTrackBay_rad = kTrackLobe_rad - 1.0471975511965976;
/// Distance of (x, y), in voxels, from its outline at half height; negative inside.
double distance_to_track_cylinder_vox(double x_vox, double y_vox);

/// A straight walk of a point robot along x.
struct Walk {
  std::vector<double> x_vox, mu_Pa_s_per_m, force_N;  ///< force against the motion
};
/// From x = `from_vox` to `to_vox` at height z and lateral y, `per_voxel` samples a voxel, none on a border.
Walk walk(Probe& probe, double y_vox, double z_vox, double from_vox, double to_vox, double speed_m_per_s,
          int per_voxel = 4);

/// Values that are greater than those before and after them, each run of equal values counted once; ends do
/// not count.
int count_peaks(const std::vector<double>& values);

}  // namespace phantom::experiments
