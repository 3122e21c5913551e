#pragma once

#include <cmath>
#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::simulation {

/// Joint encoders: positions in whole counts, velocities from their differences through a first-order filter.
class Encoders {
 public:
  /// `resolution`: rad or m per count, > 0. `filter_s`: time constant of the velocity filter, ≥ 0 (0: bare
  /// difference).
  Encoders(std::size_t joint_count, const core::JointArray& resolution, double filter_s)
      : count_(joint_count), resolution_(resolution), filter_s_(filter_s) {}

  /// Reads true positions at a new sample; the first call gives velocity zero. Real-time safe: yes.
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
