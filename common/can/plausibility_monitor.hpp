#pragma once

#include <cstdint>

#include "common/core/clock.hpp"
#include "common/core/motion_agreement.hpp"

namespace phantom::can {

/// Why a drive's feedback cannot be true.
enum class Implausibility : std::uint8_t {
  kNone,
  kJump,       ///< its position moved farther between two answers than the joint can
  kOverspeed,  ///< its position, differentiated here, is faster than its greatest speed permits
  kVelocity,   ///< its velocity, summed up, leads elsewhere than its position
  kStuck,      ///< its torque changes, and not one count of its position does
  kFrozen,     ///< its target changes, and neither its position nor its torque does
  kContrary,   ///< its position moves away from where its target leads
  kEnergy,     ///< it gained more energy than its torque gave it; found by an observer of the arm's dynamics
};

/// What was found, with its numbers in joint units. `seen` and `allowed` mean, by reason:
/// kJump: way in one answer, greatest way; kOverspeed: speed, greatest speed; kVelocity: way that velocity
/// and position disagree by, greatest such way; kStuck: torque's change as a share of the axis's greatest
/// torque, greatest such share; kFrozen: how long, longest such time (s); kContrary: way against the target,
/// greatest such way; kEnergy: energy, greatest such energy (J). Trivially copyable.
struct ImplausibleMotion {
  Implausibility reason = Implausibility::kNone;
  double seen = 0.0, allowed = 0.0;
  bool sliding = false;  ///< joint units are m; else rad
};

struct PlausibilityParameters {
  double max_speed = 0.0;        ///< of the joint, rad/s or m/s; > 0
  double max_torque = 0.0;       ///< at the joint, N·m or N; > 0
  double count = 0.0;            ///< joint units per count; > 0
  double period_s = 0.002;       ///< from one SYNC to the next
  int measure_every = 1;         ///< number of SYNCs from one velocity and torque to the next
  double overspeed_ratio = 2.0;  ///< greatest speed by position ÷ max_speed; > 1
  bool sliding = false;          ///< joint units are m; else rad
};

/// What a drive was told to do. `kNone`: nothing that its answers must show, as while it has no power.
enum class TargetKind : std::uint8_t { kNone, kPosition, kVelocity, kTorque };

/// One answer of a drive to a SYNC, in joint units.
struct MotionSample {
  core::Nanoseconds at_ns = 0;  ///< when the answered SYNC was sent
  double position = 0.0, velocity = 0.0, torque = 0.0;
  bool moves_freely = true;  ///< has power and its brake is known to be open: a torque must move it
  TargetKind target_kind = TargetKind::kNone;
  double target = 0.0;   ///< that was in force: joint units, joint units/s, or N·m or N
  bool limited = false;  ///< its torque is at a limit, or the drive reports one: it may not follow its target
};

/// Decides, answer by answer, whether position, velocity and torque of one drive can belong to one motion.
///
/// With v the joint's greatest speed, T the SYNC's period and m measure_every:
/// 1. Jump: a position that moves by more than 4 v (dt + 2 T) + 4 counts, dt being the time between two
///    answers, is found at once.
/// 2. Overspeed: the position's difference quotient, low-pass filtered with max(10 ms, 5 T), is found beyond
///    overspeed_ratio · v. It does not depend on the drive's own velocity or limit.
/// 3. Velocity: position and velocity disagree (core::MotionAgreement) by more than
///    v (10 ms + 2 T (1 + m)) + 4 counts and its share of the way.
/// 4. Stuck: the torque has ranged over more than 0.2 of the greatest torque since the position changed by
///    more than a count, for 10 ms + 2 T. Only where 1e-4 joint units are 4 counts or more: a coarser encoder
///    does not show how a joint and its gear yield. A joint that stands in contact yields by more, and is no
///    stuck encoder.
/// 5. Frozen: the target has ranged over 0.2 of the greatest torque, or over v · 0.1 s, since position (by
/// more
///    than a count) or torque (by more than 0.002 of the greatest) changed, for 10 ms + 2 T. Like 4 only with
///    a fine encoder; not while the drive is limited.
/// 6. Contrary: the position has moved by more than v (0.25 s + 2 T) + 4 counts away from its target, way
///    towards it subtracted. A target that is a velocity below 0.02 v, or a position nearer than v · 20 ms,
///    leads nowhere. A torque target says nothing of the way: see FeedbackObserver (teleop) for that.
/// A gap of more than 10 periods starts 2 to 6 over: the velocity in it is unknown. What all miss: feedback
/// that is false and consistent with its targets, below the greatest speed. Pure: it uses no clock.
/// Real-time safe: yes.
class PlausibilityMonitor {
 public:
  explicit PlausibilityMonitor(const PlausibilityParameters& parameters) noexcept;

  /// Takes the newest answer; returns what is wrong, if anything is.
  ImplausibleMotion step(const MotionSample& sample) noexcept;
  /// Starts over, as when the drive is set up or homed.
  void reset() noexcept { started_ = false; }

 private:
  void start(const MotionSample& sample) noexcept;
  ImplausibleMotion found(Implausibility reason, double seen, double allowed) const noexcept;
  ImplausibleMotion check_motion(const MotionSample& sample, double dt_s) noexcept;
  ImplausibleMotion check_torque(const MotionSample& sample, double dt_s) noexcept;
  ImplausibleMotion check_frozen(const MotionSample& sample, double dt_s) noexcept;
  ImplausibleMotion check_contrary(const MotionSample& sample) noexcept;

  PlausibilityParameters parameters_;
  double speed_filter_s_, velocity_tolerance_;
  bool sees_yielding_;
  MotionSample last_;
  bool started_ = false;
  double speed_ = 0.0;  // filtered difference quotient of the position
  core::MotionAgreement agreement_;
  double still_at_ = 0.0, least_torque_ = 0.0, greatest_torque_ = 0.0;  // since the position changed
  double strained_s_ = 0.0;                         // for how long the torque has changed by more than it may
  double same_position_ = 0.0, same_torque_ = 0.0;  // since one of them changed
  double least_target_ = 0.0, greatest_target_ = 0.0;  // since then
  double asked_way_ = 0.0;                             // likewise, of a velocity
  double same_s_ = 0.0, ignored_s_ = 0.0;              // since then; of that with a target that must show
  double contrary_way_ = 0.0;
};

}  // namespace phantom::can
