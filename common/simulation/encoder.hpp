#pragma once

#include <cmath>
#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::simulation {

/// Simulates joint encoders: positions in whole counts, and velocities from their differences through a
/// first-order filter.
class Encoders {
 public:
  /// `resolution`: rad or m per count, > 0. `filter_s`: time constant of the velocity filter, ≥ 0 (0:
  /// unfiltered difference).
  Encoders(std::size_t joint_count, const core::JointArray& resolution, double filter_s)
      : count_(joint_count), resolution_(resolution), filter_s_(filter_s) {}

  /// Samples the true positions. The first sample gives velocity zero. Real-time safe: yes.
  void sample(const core::JointArray& true_q, double dt_s) noexcept {
    for (std::size_t j = 0; j < count_; ++j) {
      const double q = std::round(true_q[j] / resolution_[j]) * resolution_[j];
      if (started_ && dt_s > 0.0)
        velocity_[j] += dt_s / (dt_s + filter_s_) * ((q - position_[j]) / dt_s - velocity_[j]);
      position_[j] = q;
    }
    started_ = true;
  }
  const core::JointArray& position() const noexcept { return position_; }
  const core::JointArray& velocity() const noexcept { return velocity_; }

 private:
  std::size_t count_;
  core::JointArray resolution_;
  double filter_s_;
  core::JointArray position_{}, velocity_{};
  bool started_ = false;
};

}  // namespace phantom::simulation
