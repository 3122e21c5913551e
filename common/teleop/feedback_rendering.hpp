#pragma once

#include <array>
#include <cstddef>

#include "common/core/joints.hpp"
#include "common/teleop/bilateral.hpp"
#include "common/teleop/passivity_guard.hpp"
#include "common/teleop/ramp.hpp"

namespace phantom::teleop {

/// "Take the 1/A that belongs to the law."
inline constexpr double kLawsOwnGain = -1.0;

struct FeedbackParameters {
  std::size_t joint_count = 0;
  BilateralLaw law = BilateralLaw::kSctfb;         ///< at the start
  std::array<double, kBilateralLaws> inverse_a{};  ///< 1/A by law, ≥ 0
  ExchangeGains exchange;                          ///< of laws d and e
  core::JointArray torque_cap_Nm{};
  double ramp_up_s = 0.3, ramp_down_s = 0.1;
  double contact_gain_ratio = 1.0;  ///< 1/A in contact ÷ 1/A out of it, ≥ 1 (thesis 5.4.7, item 4)
  double contact_rise_s = 0.05, contact_fall_s = 0.3;
  PassivityParameters passivity;
};

struct FeedbackInputs {
  BilateralLaw law = BilateralLaw::kSctfb;  ///< wished for
  double inverse_a = kLawsOwnGain;          ///< 1/A wished for
  bool coupled = false;
  bool contact = false;         ///< the arm touches something, or the phantom says that it does
  bool force_measured = false;  ///< F_e is there
  JointMotion master, slave;
  SlaveEffort effort;
};

struct RenderedFeedback {
  core::JointArray torque_Nm{};
  BilateralLaw law = BilateralLaw::kSctfb;  ///< in force
  double inverse_a = 0.0;                   ///< in force, contact included
  bool passivity_limited = false;           ///< the passivity guard damps
  bool force_missing = false;               ///< the law in force needs F_e, which the slave does not measure
};

/// Renders the slave's feedback on the master. Laws, gains and contact change while it runs and nothing
/// jumps: a change of law fades the old one out before the new one fades in, gains move at a bounded rate,
/// and whatever comes the torque stays within its cap. What fades out after uncoupling is the last torque
/// felt while coupled: a slave that stops or holds may step its own. Sources: thesis Table 5.1,
/// eq. 5.20, 5.4.7.
class FeedbackRenderer {
 public:
  explicit FeedbackRenderer(const FeedbackParameters& parameters);

  /// Real-time safe: yes.
  RenderedFeedback step(const FeedbackInputs& in, double dt_s) noexcept;

 private:
  double follow_gain(const FeedbackInputs& in, double dt_s) noexcept;

  FeedbackParameters parameters_;
  Ramp authority_, contact_;
  PassivityGuard passivity_;
  BilateralLaw law_;
  double inverse_a_;
  core::JointArray coupled_Nm_{};  // before authority, of the last coupled step
};

}  // namespace phantom::teleop
