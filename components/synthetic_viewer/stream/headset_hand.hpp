#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string_view>

#include "common/core/clock.hpp"
#include "common/core/status.hpp"
#include "common/teleop/coupling/cartesian_hand.hpp"
#include "common/teleop/coupling/free_handle.hpp"

namespace phantom::synthetic_viewer {

/// What a page sends of the controller that leads the arm, at each of its headset's frames (README.md,
/// "A headset's controller leads the arm").
struct ControllerPose {
  std::uint32_t number = 0;                              ///< rising
  double page_s = 0.0;                                   ///< the page's clock; rising
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the axes of W, from a point of the room
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();
  bool tracked = false;  ///< the headset sees where it is
  bool grip = false;     ///< its squeeze button is held
  double trigger = 0.0;  ///< 0…1
};

/// Reads a message of the kind `hand`. Errors: another length or kind, a flag that is not known, a number
/// that is none, a quaternion that is none, a place farther away than 10 m.
core::Expected<ControllerPose> controller_pose(std::string_view octets);

/// How it is with the hand, as a page is told. What follows kLeads is why it does not lead.
enum class HandWord {
  kFree,       ///< no controller leads
  kElsewhere,  ///< that of another page does
  kForbidden,  ///< who asked may not command
  kReady,      ///< hold the squeeze button to lead
  kLeads,
  kClutchIn,    ///< the squeeze button is to be let go first
  kNotTaken,    ///< master_io does not take the hand
  kNotCoupled,  ///< master and slave are not coupled
  kSilent,      ///< no pose came for too long
  kLate,        ///< poses come too late
  kUntracked,   ///< the headset does not see the controller
  kJumped,      ///< its pose jumped, or was none
  kEnd,         ///< the way of the handle is used up: it goes back to its middle
};
/// Returns the word as the scene stream has it, such as "leads".
const char* name_of(HandWord word);

/// A headset's controller as the hand that leads the arm: whose it is, whether it can be believed, and the
/// handle that it moves.
///
/// 1. One page has it, from its claim until it gives it back, goes, or has been silent for 2 s.
/// 2. The arm moves only while the squeeze button is held. What the hand does meanwhile the handle does, from
/// where it stands: nothing jumps as the button is pressed again elsewhere.
/// 3. Nothing leads once no pose has come for `silent_s`, poses come later than the earliest by that, the
/// controller is not tracked, or its pose jumps; and after that, and after master_io did not take the
/// hand, until the button was seen let go.
/// 4. Drag and feedback slow the handle down; the hand is pushed by nothing. What it is ahead of the handle
/// by more than 50 mm or 0.3 rad is dropped, so that an arm does not go on once the hand stands.
/// Pure: time comes in. Thread-safe.
class HeadsetHand {
 public:
  /// Of the handle that it moves: a hand's spring and damping of 40 rad/s.
  static constexpr teleop::FreeHandleParameters kHandle{
      .mass_kg = 1.0, .inertia_kg_m2 = 0.02, .push_N_s_per_m = 80.0, .push_N_m_s_per_rad = 1.6};

  /// `R_WB`: axes of the arm's base, which are those of the handle.
  HeadsetHand(double silent_s, const Eigen::Matrix3d& R_WB)
      : silent_ns_(core::from_seconds(silent_s)), R_BW_(R_WB.transpose()) {}

  /// Gives the hand to a page, unless another one has it. Returns whether it has it then. `page`: not 0.
  bool claim(std::uint64_t page, core::Nanoseconds now_ns);
  /// Takes the hand from a page, if it has it.
  void leave(std::uint64_t page);
  /// Takes a message from a page; passes over it if that does not have the hand. Errors: it is no message of
  /// a pose; the page does not have the hand any more.
  core::Status take(std::uint64_t page, std::string_view octets, core::Nanoseconds now_ns);
  /// Returns how it is, for a page.
  HandWord word(std::uint64_t page) const;
  /// Returns whether a page has the hand.
  bool is_of(std::uint64_t page) const;

  struct Felt {
    robot::Spatial wrench = robot::Spatial::Zero();  ///< on the handle, in the base's axes
    bool taken = false, leads = false;               ///< by master_io
  };
  struct Handle {
    /// In the base's axes. Not valid: it cannot be believed, or nobody has it any more, for as long as a
    /// clutch may fade. A hand that nobody has is at rest then, so that a session need not wait for one.
    teleop::HandState hand;
    double grip_opening = -1.0;
  };
  /// Moves the handle on by `dt_s`. Real-time safe: yes, but for the wait for another thread's short lock.
  Handle step(const Felt& felt, double dt_s, core::Nanoseconds now_ns);

 private:
  void let_go(HandWord why);
  void forget();
  bool late(const ControllerPose& pose, core::Nanoseconds now_ns);
  bool jumped(const ControllerPose& pose) const;
  void follow(const ControllerPose& pose);
  void move(const robot::Spatial& wrench, double dt_s);
  HandWord held_word() const;

  const core::Nanoseconds silent_ns_;
  const Eigen::Matrix3d R_BW_;
  mutable std::mutex mutex_;  // guards all that follows
  std::uint64_t holder_ = 0;
  std::optional<HandWord> trouble_;  // why nothing leads, until the button was seen let go
  bool seen_out_ = false;            // the button, since the last trouble and while master_io takes the hand
  core::Nanoseconds heard_ns_ = 0, taken_ns_ = 0;
  std::optional<double> least_delay_s_;           // of the page's clock to ours, of the pose that was fastest
  core::Nanoseconds delayed_ns_ = 0;              // when that was judged last
  std::optional<ControllerPose> newest_, last_;   // the newest; the last that was believed
  double free_s_ = teleop::FreeHandle::kRests_s;  // so long nobody has had it
  bool gripping_ = false;
  geometry::Pose target_, aim_;  // where the hand has led; on the way there, over the time between two poses
  robot::Spatial aim_twist_ = robot::Spatial::Zero();
  double aim_left_s_ = 0.0;
  Felt felt_;
  teleop::FreeHandle handle_{kHandle};
};

}  // namespace phantom::synthetic_viewer
