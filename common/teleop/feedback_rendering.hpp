#pragma once

#include <array>
#include <cstddef>

#include "common/core/joints.hpp"
#include "common/teleop/bilateral.hpp"
#include "common/teleop/feedback_limit.hpp"
#include "common/teleop/passivity_guard.hpp"
#include "common/teleop/ramp.hpp"

namespace phantom::teleop {

/// "Take the 1/A that belongs to the law."
inline constexpr double kLawsOwnGain = -1.0;

/// The same value for every joint.
inline core::JointArray everywhere(double value) noexcept {
  core::JointArray values{};
  values.fill(value);
  return values;
}

struct FeedbackParameters {
  std::size_t joint_count = 0;
  BilateralLaw law = BilateralLaw::kSctfb;                   ///< at the start
  std::array<core::JointArray, kBilateralLaws> inverse_a{};  ///< 1/A by law and joint, ≥ 0
  FeedbackLimits limits;                                     ///< what of it is stable
  double expected_round_trip_s = 0.004;                      ///< until one is measured
  ExchangeGains exchange;                                    ///< of laws d and e
  core::JointArray torque_cap_Nm{};
  double ramp_up_s = 0.3, ramp_down_s = 0.1;
  double contact_gain_ratio = 1.0;  ///< 1/A in contact ÷ 1/A out of it, ≥ 1 (thesis 5.4.7, item 4)
  double contact_rise_s = 0.05, contact_fall_s = 0.3;
  PassivityParameters passivity;
};

struct FeedbackInputs {
  BilateralLaw law = BilateralLaw::kSctfb;                ///< asked for
  core::JointArray inverse_a = everywhere(kLawsOwnGain);  ///< 1/A asked for, by joint
  bool coupled = false;
  bool contact = false;         ///< the arm touches something, or the phantom says that it does
  bool force_measured = false;  ///< F_e is there
  double round_trip_s = 0.0;    ///< from a master's position to the slave's answer in use; 0: not known yet
  JointMotion master, slave;
  SlaveEffort effort;
};

struct RenderedFeedback {
  core::JointArray torque_Nm{};
  BilateralLaw law = BilateralLaw::kSctfb;  ///< in force
  core::JointArray inverse_a{};             ///< in force, contact included
  double round_trip_s = 0.0;                ///< delay in force: measured, smoothed
  bool limited = false;                     ///< 1/A of a joint is held at what is stable with that delay
  bool passivity_limited = false;           ///< the passivity guard damps
  bool force_missing = false;               ///< the law in force needs F_e, which the slave does not measure
};

/// Renders the slave's feedback on the master. Laws, gains and contact change while it runs and nothing
/// jumps: a change of law fades the old one out before the new one fades in, gains move at a bounded rate,
/// and whatever comes the torque stays within its cap, the passivity guard's damping included. 1/A is held
/// joint by joint at what is stable with the law and the delay in force. What fades out after uncoupling is
/// the last torque felt while coupled: a slave that stops or holds may step its own. Sources: thesis
/// Table 5.1, eq. 5.20, 5.4.7.
class FeedbackRenderer {
 public:
  explicit FeedbackRenderer(const FeedbackParameters& parameters);

  /// Real-time safe: yes.
  RenderedFeedback step(const FeedbackInputs& in, double dt_s) noexcept;
  /// What the device got of it in the end, so that the passivity guard's balance is true. Real-time safe:
  /// yes.
  void note_rendered(const core::JointArray& torque_Nm) noexcept { passivity_.note_rendered(torque_Nm); }

  /// Time constants by which the delay in force follows a longer and a shorter round trip.
  static constexpr double kDelayRise_s = 0.1, kDelayFall_s = 1.0;

 private:
  void follow_gain(const FeedbackInputs& in, double dt_s, RenderedFeedback& out) noexcept;
  void follow_delay(double measured_s, double dt_s) noexcept;

  FeedbackParameters parameters_;
  Ramp authority_, contact_;
  PassivityGuard passivity_;
  BilateralLaw law_;
  core::JointArray inverse_a_;
  double round_trip_s_;
  core::JointArray coupled_Nm_{};  // before authority, of the last coupled step
};

}  // namespace phantom::teleop
