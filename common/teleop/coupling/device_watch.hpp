#pragma once

#include <array>
#include <cstdint>

#include "common/core/clock.hpp"
#include "common/core/motion_agreement.hpp"
#include "common/teleop/coupling/cartesian_hand.hpp"

namespace phantom::teleop {

/// How a handle stands and moves, in its device's frame D. Trivially copyable.
struct HandleMotion {
  std::array<double, 3> position_m{};
  std::array<double, 9> R_DH{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< by columns
  std::array<double, 3> velocity_m_s{}, angular_velocity_rad_s{};

  friend bool operator==(const HandleMotion&, const HandleMotion&) = default;
};

/// The newest valid sample of a device that another process serves. Trivially copyable.
struct DeviceReading {
  core::Nanoseconds received_ns = 0;  ///< on this host's monotonic clock; 0: none yet
  core::Nanoseconds measured_ns = 0;  ///< on the clock of the device's host
  core::Nanoseconds answers_ns = 0;   ///< when we computed the wrench that acted in it; 0: none of ours
  std::uint64_t session = 0;          ///< of the device's process
  HandleMotion handle;
  bool ready = false, clutch = false;
};

/// Why a device is not taken. The first in this list that holds is reported.
enum class DeviceTrouble {
  kNone,
  kSilent,      ///< nothing (new enough) is heard
  kNotReady,    ///< it says so: not homed, in fault, switched off
  kUnanswered,  ///< it does not say which of our wrenches acts: how long the loop is, is not known
  kLate,        ///< the loop through it is too long
  kJumped,      ///< its pose jumped: it was homed, or something is wrong with it
  kDisagrees,   ///< its velocity leads elsewhere than its pose: a sign or a unit is wrong
  kRestarted,   ///< another process serves it
  kClutchIn,    ///< all is well again, but the clutch was not let out since
};

/// Returns the trouble in words for the operator; empty for none.
const char* sentence(DeviceTrouble trouble) noexcept;

struct DeviceWatchParameters {
  double staleness_s = 0.02;         ///< its newest sample counts as stale beyond this age
  double round_trip_limit_s = 0.03;  ///< greatest length of the loop through it
  double loop_s = 0.002;             ///< length of the loop for which the joints' damping limits are found
};

/// What follows from the device in one tick.
struct DeviceVerdict {
  DeviceTrouble trouble = DeviceTrouble::kSilent;
  HandState hand;         ///< invalid while there is trouble
  double longer_s = 0.0;  ///< by how much the loop through the device is longer than `loop_s`; ≥ 0
};

/// Decides, tick by tick, whether a haptic device that is served by another process can be taken.
///
/// 1. Trouble is seen within a tick after `staleness_s` or `round_trip_limit_s`, and at once in what arrives.
/// 2. It lasts until it is over and the clutch was seen out since: what a hand held closed through a loss
/// moves nothing
///    afterwards.
/// 3. The length of the loop is the age of the wrench of ours that acted in the newest measurement, by our
/// own clock: it counts both ways, the device's sampling and the time that its state waits for a tick. It
/// follows what is longer at once, and forgets it at 0.1 s per second.
/// A pose has jumped if it moved otherwise than its velocities say, by more than encoders and a hand can in
/// one sample. Pose and velocity disagree if the same adds up over samples (core::MotionAgreement, along each
/// axis of D); what is allowed is 5 mm or 0.05 rad, and 20 ms of the way that both make of it. What is not
/// found: pose and velocity that are false alike. A hand is active, so that no energy tells them.
/// Pure: it uses no clock. Real-time safe: yes.
class DeviceWatch {
 public:
  explicit DeviceWatch(const DeviceWatchParameters& parameters) : parameters_(parameters) {}

  const DeviceVerdict& step(const DeviceReading& newest, core::Nanoseconds now_ns, double dt_s) noexcept;

 private:
  DeviceTrouble present(const DeviceReading& newest, double loop_s, core::Nanoseconds now_ns) const noexcept;
  bool jumped(const DeviceReading& newest) const noexcept;
  bool disagrees(const DeviceReading& newest) noexcept;

  DeviceWatchParameters parameters_;
  DeviceReading last_;
  /// One coordinate of the handle's motion.
  struct Coordinate {
    core::MotionAgreement agreement;
    double fastest_by_pose = 0.0, fastest_by_velocity = 0.0;  // of late
  };
  std::array<Coordinate, 6> coordinates_;  // three of position, three of rotation
  DeviceTrouble latched_ = DeviceTrouble::kSilent;
  double round_trip_s_ = 0.0;
  DeviceVerdict verdict_;
};

}  // namespace phantom::teleop
