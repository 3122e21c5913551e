#pragma once

#include <optional>

#include "common/runtime/cell/cell.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"
#include "tests/experiments/experiment.hpp"

namespace phantom::experiments {

/// The thesis's first test arm before a bar (cells/bar): one link of 57 cm swings about the joint theta.
inline constexpr std::size_t kTheta = 1;  // index of the joint
inline constexpr double kLink_m = 0.57;
inline constexpr double kSkinRadius_m = 0.03;  // of the link, for the area that a sensor stands for
inline constexpr double kContact_deg = 40.0;   // where the link lies on the bar

constexpr double rad(double degrees) { return degrees * 3.14159265358979323846 / 180.0; }
constexpr double degrees(double angle_rad) { return angle_rad * 180.0 / 3.14159265358979323846; }

/// The cell, its profile sabotaged as the settings say.
runtime::CellConfig bar_cell(const Settings& settings);

/// The same as files for the executables, cell.yaml and arm.yaml in `folder`, with the skin of the link under
/// test alone: 60 sensors along it. Returns the cell's file.
std::filesystem::path write_bar_cell(const std::filesystem::path& folder, const Settings& settings);

/// What a shipped executable said, called with `line`, its own words without its folder. Throws
/// std::runtime_error unless it ended with `exit_code`.
std::string said_by(const std::string& line, const Settings& settings, int exit_code = 0);

/// The phantom of the arm, with nothing but `count` sensors at equal steps along the link (eqs. 5.2–5.4).
phantom_sensing::PhantomModel axis_phantom(const runtime::CellConfig& cell, int count,
                                           robot::Normalisation normalisation,
                                           const std::optional<robot::ClusterSpec>& cluster = std::nullopt);

/// Distance in metres from the link's axis, `r_m` from the joint, to the bar, or from a point `across_m` off
/// the axis in the plane of the swing (towards greater theta); negative inside. By geometry, not by voxels.
double bar_distance_m(double r_m, double theta_rad, double across_m = 0.0);

/// μ at a distance from the bar in fluid without voxels, by the profile's layers.
double ideal_mu(const workspace::LayerProfile& profile, double voxel_size_m, double distance_m);

/// Drag coefficient of theta, N·m·s/rad, of a skin without gaps in fluid without voxels: ∫ μ(distance) r² 2πR
/// dr along the link, by the profile's layers from the surface outwards. What all voxels and sensors
/// approximate; never sabotaged.
double ideal_coefficient(const workspace::LayerProfile& profile, double voxel_size_m, double theta_rad);

/// Torque that opposes theta while it swings, at each angle: N·m, or Pa·m where the skin is normalised by a
/// count.
std::vector<double> swing(const phantom_sensing::PhantomModel& model, const workspace::Workspace& workspace,
                          const std::vector<double>& angles_deg, double speed_rad_s);

}  // namespace phantom::experiments
