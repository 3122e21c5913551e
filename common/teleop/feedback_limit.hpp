#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/teleop/bilateral.hpp"

namespace phantom::teleop {

/// One joint of the loop that runs through the network: device, link, slave's position loop and back. Units
/// by type of joint: kg·m², N·m/rad, N·m·s/rad; or kg, N/m, N·s/m.
struct FeedbackLoop {
  double master_inertia = 0.0;  ///< > 0
  double master_period_s = 0.001;
  int master_delay_samples = 1;             ///< from computing a torque to its acting, beyond the hold itself
  double master_filter_s = 0.0;             ///< time constant of the velocity filter, ≥ 0
  double slave_inertia = 0.0;               ///< > 0
  double slave_k_p = 0.0, slave_k_v = 0.0;  ///< of the slave's position loop, ≥ 0
  double slave_period_s = 0.001;
  int slave_delay_samples = 0;
  double slave_filter_s = 0.0;
  double exchange_k_p = 0.0, exchange_k_v = 0.0, force_share = 1.0;  ///< as ExchangeGains
};

/// Greatest 1/A at which the loop of one joint comes to rest by itself, with nobody's hand on the master and
/// friction left out: the gain margin of the delayed, sampled loop by Nyquist. `round_trip_s`: from a
/// master's position to the feedback that answers it. The slave moves freely or is held fast (in contact, or
/// stuck by its own friction): the lesser of both limits. 0: no gain is stable; infinite: every gain is (law
/// a).
///
/// Model: master 1/(m s²) behind hold and command delay; velocities by differences through their filters;
/// slave 1/(M s²) behind its own hold and delay, under K_p(X_m − X_s) + K_v(Ẋ_m − Ẋ_s); F_am by Table 5.1.
/// With F_am = F(s)·X_m/A, the loop m s² + F(s)/A has roots on the imaginary axis where F is real and
/// positive: 1/A = mω²/F there, and the least of these is the limit, provided that F damps (Im F > 0) as ω →
/// 0. Takes some 10⁴ complex products; allocates nothing.
double feedback_limit(BilateralLaw law, const FeedbackLoop& loop, double round_trip_s) noexcept;

/// What of that limit may be used: half of it (6 dB of gain margin), to leave room for what the model leaves
/// out (soft surroundings, poses of other inertia, flexible links, delay that varies).
inline constexpr double kUsableShareOfFeedbackLimit = 0.5;

/// The usable 1/A by law, joint and round trip, tabulated once so that the servo thread may ask.
class FeedbackLimits {
 public:
  /// Knows of no limit: everything may be used.
  FeedbackLimits() = default;
  /// Tabulates: some tens of milliseconds. At most kMaxJoints loops.
  explicit FeedbackLimits(const std::vector<FeedbackLoop>& joints);

  /// Never rises with the round trip; 0 beyond kLongest_s. A round trip that is no number counts as too long.
  /// Real-time safe: yes.
  double usable(BilateralLaw law, std::size_t joint, double round_trip_s) const noexcept;

  static constexpr double kShortest_s = 0.0005, kLongest_s = 0.25;

 private:
  static constexpr std::size_t kNodes = 64;
  static double node_s(std::size_t node) noexcept;

  std::size_t joints_ = 0;
  std::array<std::array<std::array<double, kNodes>, core::kMaxJoints>, kBilateralLaws> usable_{};
};

/// Why 1/A `inverse_a` (the greatest that may come into force, contact's share included) is not stable, with
/// the joint that bears least and what is allowed; empty if every joint bears it. `joints`: those that it is
/// for; `names` of all.
///     "1/A 10 is not stable on j3_shoulder with law sctfb and 4 ms delay; allowed: up to 0.028"
/// `contact_ratio`: 1/A in contact ÷ 1/A out of it, ≥ 1; what is allowed is told out of contact.
std::string why_feedback_is_unstable(const FeedbackLimits& limits, BilateralLaw law,
                                     const core::JointArray& inverse_a, double contact_ratio,
                                     double round_trip_s, const std::vector<std::string>& names);

}  // namespace phantom::teleop
