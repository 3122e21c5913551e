#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/teleop/coupling/bilateral.hpp"

namespace phantom::teleop {

/// Parameters of one joint's loop through the network: from the device over the link to the slave's position
/// loop and back. Units of a revolute joint: kg·m², N·m/rad, N·m·s/rad; of a prismatic joint: kg, N/m, N·s/m.
struct FeedbackLoop {
  double master_inertia = 0.0;  ///< > 0
  double master_period_s = 0.001;
  int master_delay_samples = 1;             ///< from computing a torque to its effect, beyond the hold itself
  double master_filter_s = 0.0;             ///< time constant of the velocity filter, ≥ 0
  double slave_inertia = 0.0;               ///< > 0
  double slave_k_p = 0.0, slave_k_v = 0.0;  ///< gains of the slave's position loop, ≥ 0
  double slave_period_s = 0.001;
  int slave_delay_samples = 0;
  double slave_filter_s = 0.0;
  double force_lag_s = 0.0;  ///< time constant with which F_e follows the force on the slave, ≥ 0
  double exchange_k_p = 0.0, exchange_k_v = 0.0, force_share = 1.0;  ///< as in ExchangeGains
};

/// Returns the greatest 1/A at which the loop of one joint is stable without a hand on the master and without
/// friction: the gain margin of the delayed, sampled loop by Nyquist. `round_trip_s` is the time from a
/// master's position to the feedback that answers it. The limit is the lesser of two: for a slave that moves
/// freely and for one that is held fast (in contact, or stuck by its own friction). Returns 0 if no gain is
/// stable, infinity if every gain is stable (law a).
///
/// Model: master 1/(m s²) behind hold and command delay; velocities by differences through their filters;
/// slave 1/(M s²) behind its own hold and delay, under K_p(X_m − X_s) + K_v(Ẋ_m − Ẋ_s); F_am by Table 5.1.
/// With F_am = F(s)·X_m/A, the loop m s² + F(s)/A has roots on the imaginary axis where F is real and
/// positive. There 1/A = mω²/F. The least of these values is the limit, provided that F damps (Im F > 0) as ω
/// → 0. Needs some 10⁴ complex products; allocates no memory.
double feedback_limit(BilateralLaw law, const FeedbackLoop& loop, double round_trip_s) noexcept;

/// Usable share of that limit. The other half (6 dB of gain margin) is a margin for what the model leaves out
/// (soft surroundings, poses of other inertia, flexible links, varying delay).
inline constexpr double kUsableShareOfFeedbackLimit = 0.5;

/// Table of the usable 1/A by law, joint and round trip, computed once so that the servo thread may read it.
class FeedbackLimits {
 public:
  /// Creates a table without limits: every 1/A is usable.
  FeedbackLimits() = default;
  /// Computes the table of at most kMaxJoints loops, which takes some tens of milliseconds.
  explicit FeedbackLimits(const std::vector<FeedbackLoop>& joints);

  /// Returns the usable 1/A. It never rises with the round trip and is 0 beyond kMax_s. A round trip of
  /// NaN counts as too long. Real-time safe: yes.
  double usable(BilateralLaw law, std::size_t joint, double round_trip_s) const noexcept;

  static constexpr double kMin_s = 0.0005, kMax_s = 0.25;

 private:
  static constexpr std::size_t kNodes = 64;
  static double node_s(std::size_t node) noexcept;

  std::size_t joints_ = 0;
  std::array<std::array<std::array<double, kNodes>, core::kMaxJoints>, kBilateralLaws> usable_{};
};

/// Returns why 1/A `inverse_a` is not stable, with the joint that has the lowest limit and the limit itself;
/// returns an empty string if every joint is stable. `names`: of the joints to check.
///     "1/A 10 is not stable on j3_shoulder with law sctfb and 4 ms delay; allowed: up to 0.028"
/// `contact_ratio`: 1/A in contact ÷ 1/A out of contact, ≥ 1. `inverse_a` and the reported limit are those
/// out of contact.
std::string why_feedback_is_unstable(const FeedbackLimits& limits, BilateralLaw law,
                                     const core::JointArray& inverse_a, double contact_ratio,
                                     double round_trip_s, const std::vector<std::string>& names);

}  // namespace phantom::teleop
