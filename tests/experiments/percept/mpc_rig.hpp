#pragma once

#include <vector>

#include "common/percept/mpc.hpp"
#include "tests/experiments/rig.hpp"

namespace phantom::experiments::mpc {

/// The thesis's first set-up (3.1.4–3.1.6): a plate behind the layers of a multiple pass cylinder, and a
/// point robot that a controller moves towards it.

inline constexpr double kVoxel_m = 0.005;
inline const workspace::VoxelSize kCubes(kVoxel_m),
    kLong(Eigen::Vector3d(2.0 * kVoxel_m, kVoxel_m, kVoxel_m));
inline constexpr double kApproach_m = 0.10;  ///< "in experiments, x = 10 cm"
inline constexpr double kRate_Hz = 100.0;    ///< at which the thesis's controller updates

/// Pipes of the same size whose gaps are so many voxels wide, from the plate outwards.
percept::MpcDesign design(const std::vector<int>& gaps_vox);

/// The plate's face is at x = 0; its fluid reaches to negative x.
workspace::Workspace plate(const percept::MpcDesign& design, const workspace::VoxelSize& size,
                           const Settings& settings);

struct Coding {
  const char* table;
  const char* name;
  std::vector<int> gaps_vox;  ///< from the plate outwards; all reach 0.1 m
};
/// Those of the thesis: k = 2, k = 1, and 2 far out and 1 near the plate.
const std::vector<Coding>& codings();

struct Motion {
  const char* name;
  double start_m_per_s, end_m_per_s;  ///< over the approach, at constant acceleration
};

/// One approach, by tick. `force_N`: the response parameter RP, or what is rendered of it.
struct Approach {
  std::vector<double> time_s, travel_m, speed_m_per_s, force_N;
};
Approach approach(const workspace::Workspace& workspace, const Motion& motion, const Settings& settings);

/// Ticks at which γ = F/v steps while the travel is within [from, to).
std::vector<std::size_t> steps_in(const Approach& approach, double from_m, double to_m);
/// How often it steps there, per second; not a number for fewer than two steps.
double steps_per_s(const Approach& approach, double from_m, double to_m);
double greatest(const std::vector<double>& values);

}  // namespace phantom::experiments::mpc
