#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/core/clock.hpp"

namespace phantom::teleop {

struct LoopGuardParameters {
  double period_s = 0.001;     ///< of the loop, > 0
  double late_limit_s = 0.01;  ///< a tick is late if it begins longer than this after the one before
  double window_s = 1.0;       ///< over which late time is added up, > 0
  double most_late_s = 0.06;   ///< more late time than this within the window: the loop is starved
};

/// A tick that comes within so many periods of the one before counts as punctual.
inline constexpr double kPunctual = 1.5;

/// How regularly a servo's ticks come.
struct LoopPace {
  /// The time for which a torque may act before the next tick can change it: the longest recent time between
  /// two ticks. 0: nobody watches, because nothing moves while the loop is away.
  double held_s = 0.0;
  bool late = false;             ///< this tick is late
  bool starved = false;          ///< the loop does not run often enough for anything to be coupled
  std::uint32_t late_ticks = 0;  ///< in the window in which the loop became starved
  double window_s = 0.0;         ///< length of that window
  double longest_gap_s = 0.0;    ///< longest time between two ticks in that window

  /// Returns the share of its full gain that a control law keeps if a torque may act unchanged for
  /// `longest_s` at full gain (docs/theory.md, 11).
  double share_within(double longest_s) const noexcept {
    return held_s > longest_s ? longest_s / held_s : 1.0;
  }
};

/// Watches how regularly a loop runs that controls something real, which goes on moving under the last
/// command while the loop is held up.
///
/// The time that torques must be expected to act follows the longest gap at once, and is forgotten slowly.
/// Apart from that, late time is added up over a sliding window: each late tick counts with the time that it
/// is late. More of it than allowed means that the loop is starved, until at most half of that is left in the
/// window. The class uses no clock; it is deterministic.
class LoopGuard {
 public:
  explicit LoopGuard(const LoopGuardParameters& parameters) noexcept : parameters_(parameters) {}

  /// Notes a tick that began at `now_ns` on a monotonic clock. Real-time safe: yes.
  const LoopPace& tick(core::Nanoseconds now_ns) noexcept;

 private:
  static constexpr std::size_t kSlots = 20;  // the window slides by one of them
  struct Slot {
    double late_s = 0.0, longest_s = 0.0;
    std::uint32_t ticks = 0;
  };
  void slide(double away_s) noexcept;
  void assess() noexcept;

  LoopGuardParameters parameters_;
  LoopPace pace_;
  core::Nanoseconds before_ns_ = 0;  // the tick before; 0: none
  std::array<Slot, kSlots> slots_{};
  std::size_t newest_ = 0;
  double in_slot_s_ = 0.0;  // how much of its time the newest slot has had
};

}  // namespace phantom::teleop
