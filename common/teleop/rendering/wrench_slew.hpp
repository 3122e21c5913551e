#pragma once

#include "common/robot/kinematics/jacobian.hpp"

namespace phantom::teleop {

using robot::Spatial;

struct WrenchSlewParameters {
  double force_cap_N = 0.0, moment_cap_N_m = 0.0;               ///< of the device, ≥ 0
  double force_rate_N_per_s = 1.0, moment_rate_Nm_per_s = 1.0;  ///< greatest rate of change, > 0
};

/// Last stage before the motors of a Cartesian device: bounds the wrench and its rate of change.
///
/// For any input, NaN and infinity included, at every step:
/// 1. Force and moment stay within the caps. One factor scales both, so that drag keeps opposing the motion.
/// 2. The wrench gives the hand no more power than the wanted one does: F·V ≤ max(0, F_wanted·V), the wanted
/// one
///    within the caps. Where the bounded rate alone would leave drag that pushes, because the hand has turned
///    round within a few milliseconds, the wrench falls at once to what does not. A wrench that falls does
///    not push.
/// 3. Apart from that fall, force and moment change by at most rate·dt.
/// A wanted wrench with a number that is none counts as zero. Real-time safe: yes.
class WrenchSlew {
 public:
  explicit WrenchSlew(const WrenchSlewParameters& parameters) : parameters_(parameters) {}

  /// `twist`: of the hand, in the same frame and at the same point as the wrench.
  const Spatial& step(const Spatial& wanted, const Spatial& twist, double dt_s) noexcept;
  const Spatial& wrench() const noexcept { return now_; }

 private:
  WrenchSlewParameters parameters_;
  Spatial now_ = Spatial::Zero();
};

}  // namespace phantom::teleop
