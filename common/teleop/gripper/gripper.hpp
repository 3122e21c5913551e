#pragma once

#include <cstdint>

namespace phantom::teleop {

/// What a gripper can do. `width` is the distance between its fingers' pads; it is negative nowhere.
struct GripperLimits {
  double widest_m = 0.0;       ///< > 0
  double max_speed_m_s = 0.0;  ///< of the width; > 0
  double least_force_N = 0.0;  ///< > 0: less would not overcome its friction
  double greatest_force_N = 0.0;
  double usual_force_N = 0.0;  ///< greatest force until one is requested
};

/// State of the gripper's drive at a tick.
struct GripperSense {
  bool known = false;  ///< false: its encoder has not reported yet, and nothing else is valid
  double width_m = 0.0;
  double velocity_m_s = 0.0;  ///< of the width, > 0: opens
  double force_N = 0.0;       ///< that the drive exerts on each finger, > 0: closes
  bool follows = false;       ///< the drive follows its demand
  bool fault = false;         ///< the drive holds or coasts until it is reset
};

/// An operator's request. Width and force are requested on their own: each holds from the tick on in which
/// its number changes. Values that are not finite are ignored, others are brought within the limits.
struct GripperRequest {
  std::uint32_t width_number = 0, force_number = 0;  ///< 0: none yet
  double width_m = 0.0;
  double force_N = 0.0;  ///< greatest force, either way
};

/// Demand to the gripper's drive: a position loop whose force is limited.
struct GripperDemand {
  double width_m = 0.0;
  double force_N = 0.0;  ///< greatest force of the drive, either way; > 0
};

/// What the gripper does.
struct GripperStatus {
  GripperSense sense;
  double requested_width_m = 0.0;
  double requested_force_N = 0.0;
  bool moves = false;
  bool holds = false;  ///< pressed to rest at its force before the requested width: something is held
  bool open = false, closed = false;  ///< as far as it goes
};

/// Leads a gripper's fingers to the requested width, no faster than its limit, and tells whether they hold
/// something.
///
/// The demanded width is never farther ahead of the fingers than kLead_m, so that they press with the
/// requested force on what is in their way, and do not leap when it gives way.
///
/// An object that is dropped is a worse failure than one that is held too long. So the fingers keep pressing
/// whatever happens to the link, and nothing but a request opens them:
/// - halt() ends a motion that is under way. Fingers that hold or press go on.
/// - While the drive does not follow, the demand is where the fingers are. When it follows again, fingers
/// that
///   held grip again, and all others stay. A request that came meanwhile is carried out.
/// - A drive that presses when it is first heard of (an earlier process left it so) goes on with that force.
class GripperControl {
 public:
  static constexpr double kLead_m = 0.004;
  static constexpr double kStill_m_s = 0.002;    ///< no faster: at rest
  static constexpr double kTolerance_m = 0.001;  ///< of a width that is reached
  static constexpr double kPressingShare = 0.8;  ///< of the requested force, from which on the fingers press
  static constexpr double kHeldAfter_s = 0.1;    ///< so long they must press, or not, until that is said

  explicit GripperControl(const GripperLimits& limits) noexcept;

  /// Ends a motion that is under way: after an emergency stop, or when the link is lost.
  void halt() noexcept;
  /// Computes one tick. Real-time safe: yes.
  GripperDemand step(const GripperSense& sense, const GripperRequest& request, double dt_s) noexcept;

  const GripperStatus& status() const noexcept { return status_; }

 private:
  void take(const GripperRequest& request) noexcept;
  void begin(const GripperSense& sense) noexcept;
  void assess(const GripperSense& sense, double dt_s) noexcept;

  GripperLimits limits_;
  GripperStatus status_;
  std::uint32_t width_number_ = 0, force_number_ = 0;
  double reference_m_ = 0.0;
  double pressed_s_ = 0.0;  // for how long the fingers have pressed, up to kHeldAfter_s; it runs back as fast
  bool pressing_ = false, begun_ = false,
       waiting_ = false;  // waiting_: a request came while nothing followed
};

}  // namespace phantom::teleop
