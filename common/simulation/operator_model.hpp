#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/core/joints.hpp"

namespace phantom::simulation {

/// How the simulated operator moves.
enum class OperatorKind {
  kMinimumJerk,  ///< a person: minimum-jerk reference, a compliant hand of limited force that slows under
                 ///< load
  kConstantVelocity,  ///< the thesis's rig (5.3, 5.6): a stiff servo that keeps its speed whatever opposes it
};

/// Share of the way, and its rate per unit of phase, at phase 0…1 of a reach.
struct Progress {
  double share = 0.0;
  double rate = 0.0;
};

/// Minimum jerk: s = 10φ³ − 15φ⁴ + 6φ⁵ (Flash and Hogan 1985). Clamped outside 0…1. Real-time safe: yes.
Progress minimum_jerk(double phase) noexcept;
/// Constant speed with linear starts and stops over the first and last `ramp_share` of the phase, 0 <
/// ramp_share ≤ 0.5. Clamped outside 0…1. Real-time safe: yes.
Progress constant_velocity(double phase, double ramp_share) noexcept;

struct OperatorParameters {
  std::size_t joint_count = 0;
  OperatorKind kind = OperatorKind::kMinimumJerk;
  core::JointArray stiffness{};  ///< of hand or servo, N·m/rad or N/m
  core::JointArray damping{};    ///< N·m·s/rad or N·s/m
  core::JointArray max_force{};  ///< N·m or N that it can or will exert
  // A person (minimum jerk):
  double yield_share = 0.25;  ///< share of max_force from which the operator slows down, 0…1
  double stop_share =
      1.0;  ///< share at which the operator waits, above yield_share: a cautious one stops early
  double yield_bandwidth_Hz = 5;     ///< how fast the pace falls with the load (voluntary motion: 5–10 Hz)
  double recovery_bandwidth_Hz = 5;  ///< how fast it rises again
  double reaction_delay_s = 0.0;     ///< from a load to its first effect on the pace, 0…kLongestReaction_s
  core::JointArray tremor_rms{};     ///< of the reference, rad or m
  double tremor_Hz = 10.0;           ///< centre of its band (physiological tremor: 8–12 Hz)
  std::uint32_t seed = 1;            ///< of the tremor's phases
  // The thesis's servo (constant velocity):
  double velocity_ramp_share = 0.1;  ///< share of the reach for start, and again for stop
};

inline constexpr double kLongestReaction_s = 0.5;

/// The hand on the master: a spring and damper that pull the device along a reference, with limited force.
///
/// Minimum jerk: the reference's phase advances at a pace that falls from 1 to 0 as the hand's load u = max_j
/// |τ|/max, felt reaction_delay_s ago, rises from yield_share to stop_share: who feels drag moves more
/// slowly, and a hand at its limit waits, so that no lag builds up to be released later. Tremor shakes the
/// reference: three sines around tremor_Hz per joint with seeded phases. Constant velocity: the pace is
/// always 1 (MLT is then what keeps the speed); only the force is limited. The same inputs and seed give the
/// same motion.
class OperatorModel {
 public:
  OperatorModel(const OperatorParameters& parameters, const core::JointArray& start_q);

  /// Begins a move from where the reference stands to `target_q`, nominally `duration_s` > 0 long.
  void move_to(const core::JointArray& target_q, double duration_s) noexcept;
  /// Lets go of the move: the reference is where the hand is, at rest.
  void release(const core::JointArray& q) noexcept;

  /// Torque of the hand on the master (MLT for the velocity servo), from the device's true motion. `go` false
  /// holds the reference where it is. Real-time safe: yes.
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
  void follow_load(double load, double dt_s) noexcept;
  double felt_load(double load, double dt_s) noexcept;

  OperatorParameters parameters_;
  std::array<std::array<double, kTremorSines>, core::kMaxJoints> tremor_phase_{};
  double time_s_ = 0.0;
  std::array<float, 1024> loads_{};  // the last ones, for the reaction delay
  std::size_t newest_load_ = 0;
  core::JointArray from_, to_, reference_, reference_v_{}, torque_Nm_{};
  double duration_s_ = 1.0, phase_ = 1.0, pace_ = 1.0;
};

}  // namespace phantom::simulation
