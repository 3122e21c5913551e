#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/core/joints.hpp"

namespace phantom::simulation {

/// Kind of the simulated operator.
enum class OperatorKind {
  kMinimumJerk,  ///< a person: minimum-jerk reference; a compliant hand of limited force that slows under
                 ///< load
  kConstantVelocity,  ///< the thesis's rig (5.3, 5.6): a stiff servo that keeps its speed against any load
};

/// Progress of a reach at phase 0…1: the share of the path covered, and its derivative by the phase.
struct Progress {
  double share = 0.0;
  double rate = 0.0;
};

/// Returns the progress of a minimum-jerk motion: s = 10φ³ − 15φ⁴ + 6φ⁵ (Flash and Hogan 1985). The phase is
/// clamped to 0…1. Real-time safe: yes.
Progress minimum_jerk(double phase) noexcept;
/// Returns the progress at constant speed, with linear acceleration and deceleration over the first and last
/// `ramp_share` of the phase, 0 < ramp_share ≤ 0.5. The phase is clamped to 0…1. Real-time safe: yes.
Progress constant_velocity(double phase, double ramp_share) noexcept;

inline constexpr double kMaxReaction_s = 0.5;

/// How a person heeds what she hears or sees: from a warning of `heed_from` on she slows down, in proportion,
/// to `creep_pace` at `creep_from`. So she goes on, slowly, however near the object is.
struct Attention {
  double heed_from = 1.0;         ///< warning, 0…1; 1: she heeds none
  double creep_from = 1.0;        ///< warning, ≥ heed_from
  double creep_pace = 0.15;       ///< share of her own pace, 0…1
  double reaction_delay_s = 0.2;  ///< from the warning to its first effect on the pace, 0…kMaxReaction_s
};

struct OperatorParameters {
  std::size_t joint_count = 0;
  OperatorKind kind = OperatorKind::kMinimumJerk;
  core::JointArray stiffness{};  ///< of the hand or servo, N·m/rad or N/m
  core::JointArray damping{};    ///< N·m·s/rad or N·s/m
  core::JointArray max_force{};  ///< greatest force of the hand or servo, N·m or N
  // Parameters of a person (minimum jerk):
  double yield_share = 0.25;  ///< share of max_force at which the operator begins to slow down, 0…1
  double stop_share =
      1.0;  ///< share at which the operator waits, above yield_share; a cautious operator stops early
  double yield_bandwidth_Hz = 5;     ///< of the pace's fall with the load (voluntary motion: 5–10 Hz)
  double recovery_bandwidth_Hz = 5;  ///< of the pace's rise afterwards
  double reaction_delay_s = 0.0;     ///< from a load to its first effect on the pace, 0…kMaxReaction_s
  Attention hearing, sight;          ///< of the tone; of the view that a threatening hit opens
  core::JointArray tremor_rms{};     ///< RMS value of the reference's tremor, rad or m
  double tremor_Hz = 10.0;           ///< centre of the tremor's band (physiological tremor: 8–12 Hz)
  std::uint32_t seed = 1;            ///< seed of the tremor's phases
  // Parameter of the thesis's servo (constant velocity):
  double velocity_ramp_share = 0.1;  ///< share of the reach for acceleration, and the same for deceleration
};

/// A value as it was some time ago, at most kMaxReaction_s at 1 kHz. Real-time safe: yes.
class DelayedValue {
 public:
  /// Takes the value of this tick; returns that of `delay_s` before.
  double step(double value, double delay_s, double dt_s) noexcept;

 private:
  std::array<float, 1024> values_{};
  std::size_t newest_ = 0;
};

/// Simulates the hand on the master: a spring and damper of limited force that pull the device along a
/// reference.
///
/// Minimum jerk: the reference's phase advances at a pace that falls from 1 to 0 as the hand's load u = max_j
/// |τ|/max, delayed by reaction_delay_s, rises from yield_share to stop_share. So an operator who feels drag
/// moves more slowly. A hand at its limit waits, so that no lag builds up that would be released later.
/// A person who hears the tone or sees the view that a threat opens (notice()) slows down likewise, each
/// after its own reaction time; the slowest pace counts. Tremor is added to the reference: for each joint
/// three sines around tremor_Hz with seeded phases.
///
/// Constant velocity: the pace is always 1, and only the force is limited; MLT is then the torque that keeps
/// the speed. The same inputs and seed give the same motion.
class OperatorModel {
 public:
  OperatorModel(const OperatorParameters& parameters, const core::JointArray& start_q);

  /// Begins a move from the present reference to `target_q` with the nominal duration `duration_s` > 0.
  void move_to(const core::JointArray& target_q, double duration_s) noexcept;
  /// What she hears and sees of a near object in this tick: warnings from 0 (nothing) to 1 (at its surface).
  /// They stay until the next call. Real-time safe: yes.
  void notice(double heard, double seen) noexcept { heard_ = heard, seen_ = seen; }
  /// Abandons the move: the reference becomes the hand's position `q`, at rest.
  void release(const core::JointArray& q) noexcept;

  /// Returns the torque of the hand on the master (MLT for the velocity servo), computed from the device's
  /// true motion. While `go` is false the reference stays where it is. Real-time safe: yes.
  const core::JointArray& step(const core::JointArray& q, const core::JointArray& v, bool go,
                               double dt_s) noexcept;

  bool arrived() const noexcept { return phase_ >= 1.0; }
  double pace() const noexcept { return pace_; }
  const core::JointArray& reference() const noexcept { return reference_; }
  const core::JointArray& torque_Nm() const noexcept { return torque_Nm_; }

 private:
  static constexpr int kTremorSines = 3;
  Progress progress() const noexcept;
  Progress tremor(std::size_t joint) const noexcept;
  void follow(double load, double dt_s) noexcept;

  OperatorParameters parameters_;
  std::array<std::array<double, kTremorSines>, core::kMaxJoints> tremor_phase_{};
  double time_s_ = 0.0;
  double heard_ = 0.0, seen_ = 0.0;
  DelayedValue felt_load_, heard_before_, seen_before_;
  core::JointArray from_, to_, reference_, reference_v_{}, torque_Nm_{};
  double duration_s_ = 1.0, phase_ = 1.0, pace_ = 1.0;
};

}  // namespace phantom::simulation
