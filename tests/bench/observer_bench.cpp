// What the external torques cost the servo in a cycle: the row of rows/observer.json.

#include <benchmark/benchmark.h>

#include <cmath>

#include "common/teleop/guards/momentum_observer.hpp"

namespace phantom::bench {
namespace {

robot::SerialArm shipped_arm() {
  return robot::SerialArm::from_urdf(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/arm/suspended_arm.urdf",
                                     "tool", {})
      .value();
}

core::JointArray pose(int step) {
  core::JointArray q{};
  for (std::size_t j = 0; j < 7; ++j) q[j] = 0.3 * std::sin(1e-3 * step + static_cast<double>(j));
  return q;
}

/// The servo computes these in any case.
void poses(benchmark::State& state) {
  const robot::SerialArm arm = shipped_arm();
  robot::LinkPoses X_WL;
  int step = 0;
  for (auto _ : state) {
    arm.link_poses(pose(++step), X_WL);
    benchmark::DoNotOptimize(X_WL);
  }
}

void observer(benchmark::State& state) {
  const robot::SerialArm arm = shipped_arm();
  teleop::MomentumObserverParameters parameters{.weight = true};
  for (auto* values : {&parameters.threshold_Nm, &parameters.slow_rad_s, &parameters.inertia_kg_m2})
    values->fill(1.0);
  teleop::MomentumObserver observed(arm, parameters);
  robot::LinkPoses X_WL;
  teleop::DriveMotion motion{.usable = true};
  int step = 0;
  for (auto _ : state) {
    arm.link_poses(motion.velocity = pose(++step), X_WL);
    benchmark::DoNotOptimize(observed.step(X_WL, motion, 0.002));
  }
}

const bool registered = [] {
  benchmark::RegisterBenchmark("poses/7", poses);
  benchmark::RegisterBenchmark("observer/7", observer);
  return true;
}();

}  // namespace
}  // namespace phantom::bench
