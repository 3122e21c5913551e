#pragma once

#include <array>
#include <cstddef>

#include "common/core/joints.hpp"
#include "common/teleop/coupling/bilateral.hpp"
#include "common/teleop/coupling/ramp.hpp"
#include "common/teleop/guards/passivity_guard.hpp"
#include "common/teleop/rendering/feedback_limit.hpp"

namespace phantom::teleop {

/// Requests the 1/A that is configured for the law in force.
inline constexpr double kLawsOwnGain = -1.0;

/// Returns an array with the same value for every joint.
inline core::JointArray everywhere(double value) noexcept {
  core::JointArray values{};
  values.fill(value);
  return values;
}

struct FeedbackParameters {
  std::size_t joint_count = 0;
  BilateralLaw law = BilateralLaw::kSctfb;                   ///< at the start
  std::array<core::JointArray, kBilateralLaws> inverse_a{};  ///< 1/A by law and joint, ≥ 0
  FeedbackLimits limits;                                     ///< stable values of 1/A
  double expected_round_trip_s = 0.004;                      ///< until a round trip is measured
  ExchangeGains exchange;                                    ///< for laws d and e
  core::JointArray torque_cap_Nm{};
  double ramp_up_s = 0.3, ramp_down_s = 0.1;
  double contact_gain_ratio = 1.0;  ///< 1/A in contact ÷ 1/A out of it, ≥ 1 (thesis 5.4.7, item 4)
  double contact_rise_s = 0.05, contact_fall_s = 0.3;
  PassivityParameters passivity;
};

struct FeedbackInputs {
  BilateralLaw law = BilateralLaw::kSctfb;                ///< requested law
  core::JointArray inverse_a = everywhere(kLawsOwnGain);  ///< requested 1/A, by joint
  bool coupled = false;
  bool contact = false;         ///< the arm touches something, or the phantom reports contact
  bool force_measured = false;  ///< F_e is available
  double round_trip_s = 0.0;    ///< from a master's position to the slave's answer in use; 0: unknown yet
  double limit_share = 1.0;  ///< of the device's damping limits, what its loop's present length leaves, 0…1
  JointMotion master, slave;
  SlaveEffort effort;
  core::JointArray reaction_Nm{};  ///< of soft bodies, at the master's position (reaction_rendering.hpp)
};

struct RenderedFeedback {
  core::JointArray torque_Nm{};
  BilateralLaw law = BilateralLaw::kSctfb;  ///< in force
  core::JointArray inverse_a{};             ///< in force, contact included
  double round_trip_s = 0.0;                ///< delay in force: measured and smoothed
  bool limited = false;                     ///< 1/A of a joint is reduced to the stable value for that delay
  bool passivity_limited = false;           ///< the passivity guard adds damping
  bool torque_limited = false;              ///< a joint's torque is at its cap
  bool force_missing = false;               ///< the law in force needs F_e, which the slave does not measure
};

/// Renders the slave's feedback on the master. Laws, gains and contact may change during operation without a
/// jump of the torque. A change of law fades the old law out before the new one fades in; gains move at a
/// bounded rate. The torque stays within its cap for any input, the passivity guard's damping included. 1/A
/// of each joint is limited to the stable value for the law and the delay in force. After uncoupling, the
/// last torque of the coupled state fades out, because a slave that stops or holds may change its torque
/// abruptly. The reaction of soft bodies is added before the cap, and so counts for the passivity guard.
/// Sources: thesis Table 5.1, eq. 5.20, 5.4.7.
class FeedbackRenderer {
 public:
  explicit FeedbackRenderer(const FeedbackParameters& parameters);

  /// Real-time safe: yes.
  RenderedFeedback step(const FeedbackInputs& in, double dt_s) noexcept;
  /// Records the feedback torque that the device received in the end, so that the passivity guard's energy
  /// balance is correct. Real-time safe: yes.
  void note_rendered(const core::JointArray& torque_Nm) noexcept { passivity_.note_rendered(torque_Nm); }
  /// Records that the device rendered only `share`, 0…1, of it. Real-time safe: yes.
  void note_share(double share) noexcept { passivity_.note_share(share); }

  /// Time constants with which the delay in force follows a longer and a shorter round trip.
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
  core::JointArray coupled_Nm_{};  // of the last coupled step, before the factor `authority_`
};

}  // namespace phantom::teleop
