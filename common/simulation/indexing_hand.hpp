#pragma once

#include "common/geometry/pose.hpp"
#include "common/robot/kinematics/jacobian.hpp"

namespace phantom::simulation {

struct IndexingHandParameters {
  double reach_m = 0.1,
         reach_rad = 0.8;  ///< how far from the middle a hand goes before it brings its handle back
  double stiffness_N_per_m = 300.0, damping_N_s_per_m = 30.0, force_N = 15.0;  ///< with which it does so
  double stiffness_Nm_per_rad = 3.0, damping_Nm_s_per_rad = 0.3, moment_N_m = 1.0;
};

/// What a person does with a handle whose workspace is smaller than the task: near its edge she lets the
/// clutch out, brings the handle back to the middle, lets the clutch in and goes on. Deterministic. Real-time
/// safe: yes.
class IndexingHand {
 public:
  explicit IndexingHand(const IndexingHandParameters& parameters) : parameters_(parameters) {}

  /// Returns the hand's wrench on a handle at `pose` that moves with `twist`, in the device's axes. `task`:
  /// what the hand wants to do while the clutch is in.
  robot::Spatial step(const geometry::Pose& pose, const robot::Spatial& twist,
                      const robot::Spatial& task) noexcept;
  bool clutch() const noexcept { return clutch_; }  ///< in

 private:
  IndexingHandParameters parameters_;
  bool clutch_ = true;
};

}  // namespace phantom::simulation
