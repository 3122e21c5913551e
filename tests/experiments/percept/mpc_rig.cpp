#include "tests/experiments/percept/mpc_rig.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/implicit/primitives.hpp"

namespace phantom::experiments::mpc {

percept::MpcDesign design(const std::vector<int>& gaps_vox) {
  percept::MpcDesign design{.cylinder_diameter_m = 0.02, .fluid_viscosity_Pa_s = 0.4};
  for (const int gap_vox : gaps_vox) {
    design.pipes.push_back({.diameter_m = 0.004, .length_m = 0.05, .gap_m = gap_vox * kVoxel_m});
  }
  return design;
}

workspace::Workspace plate(const percept::MpcDesign& design, const workspace::VoxelSize& size,
                           const Settings& settings) {
  const auto layers = must(percept::mpc_layers(design, size.reference_m(), percept::MpcTransition::kStepped));
  workspace::LayerProfile profile;
  profile.thickness_vox = layers.thickness_vox;
  profile.mu_Pa_s_per_m.assign(layers.gamma_N_s_per_m.begin(), layers.gamma_N_s_per_m.end());
  profile.mu_skin_Pa_s_per_m = 2.0F * profile.mu_Pa_s_per_m.front();
  const geometry::Pose X_WB{Eigen::Matrix3d::Identity(), {0.5 * kVoxel_m, 0.0, 0.0}};
  layers::Body body{.name = "plate",
                    .mesh_W = geometry::make_box({kVoxel_m, 0.2, 0.2}).transformed(X_WB),
                    .profile = profile};
  return activate({body}, layers::grid_over({-0.15, -0.05, -0.05}, {0.02, 0.05, 0.05}, size), settings);
}

const std::vector<Coding>& codings() {
  static const std::vector<Coding> all{
      {"regular_k2", "regular gap, k = 2", std::vector<int>(10, 2)},
      {"regular_k1", "regular gap, k = 1", std::vector<int>(20, 1)},
      {"unequal", "unequal gap: k = 2, then 1", {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2}}};
  return all;
}

Approach approach(const workspace::Workspace& workspace, const Motion& motion, const Settings& settings) {
  constexpr double kStart_m = 1.3e-4;  // of the first tick: no tick falls on the border of two voxels
  Probe probe(workspace, settings);
  Approach result;
  const double v0 = motion.start_m_per_s, v1 = motion.end_m_per_s;
  const double duration_s = 2.0 * kApproach_m / (v0 + v1), acceleration = (v1 - v0) / duration_s;
  const auto ticks = static_cast<int>(duration_s * kRate_Hz);
  for (int tick = 0; tick <= ticks; ++tick) {
    const double t_s = tick / kRate_Hz, v = v0 + acceleration * t_s;
    const double travel_m = kStart_m + 0.5 * (v0 + v) * t_s;
    if (travel_m >= kApproach_m - 1e-9)
      break;  // the plate itself is data only: the thesis takes the real one away
    result.time_s.push_back(t_s);
    result.travel_m.push_back(travel_m);
    result.speed_m_per_s.push_back(v);
    result.force_N.push_back(-probe.at({travel_m - kApproach_m, 0.0, 0.0}, {v, 0.0, 0.0}).force_N.x());
  }
  return result;
}

std::vector<std::size_t> steps_in(const Approach& approach, double from_m, double to_m) {
  std::vector<std::size_t> steps;
  for (std::size_t i = 1; i < approach.force_N.size(); ++i) {
    if (approach.travel_m[i] < from_m || approach.travel_m[i] >= to_m) continue;
    const double before = approach.force_N[i - 1] / approach.speed_m_per_s[i - 1];
    const double now = approach.force_N[i] / approach.speed_m_per_s[i];
    if (std::abs(now - before) > 0.01 * now) steps.push_back(i);
  }
  return steps;
}

double steps_per_s(const Approach& approach, double from_m, double to_m) {
  const auto steps = steps_in(approach, from_m, to_m);
  if (steps.size() < 2) return std::nan("");
  return static_cast<double>(steps.size() - 1) /
         (approach.time_s[steps.back()] - approach.time_s[steps.front()]);
}

double greatest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

}  // namespace phantom::experiments::mpc
