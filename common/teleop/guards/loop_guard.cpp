#include "common/teleop/guards/loop_guard.hpp"

#include <algorithm>

namespace phantom::teleop {
namespace {

// On schedule, each second takes this many seconds off the time that torques are expected to act.
constexpr double kForgotten = 0.1;

}  // namespace

void LoopGuard::slide(double away_s) noexcept {
  const double slot_s = parameters_.window_s / kSlots;
  in_slot_s_ += away_s;
  for (std::size_t i = 0; i < kSlots && in_slot_s_ >= slot_s; ++i) {
    in_slot_s_ -= slot_s;
    newest_ = (newest_ + 1) % kSlots;
    slots_[newest_] = {};
  }
  in_slot_s_ = std::min(in_slot_s_, slot_s);
}

void LoopGuard::assess() noexcept {
  Slot all;
  for (const Slot& slot : slots_) {
    all.late_s += slot.late_s;
    all.longest_s = std::max(all.longest_s, slot.longest_s);
    all.ticks += slot.ticks;
  }
  if (!pace_.starved && all.late_s > parameters_.most_late_s) {
    pace_.starved = true;
    pace_.window_s = parameters_.window_s;
    pace_.late_ticks = all.ticks;
    pace_.longest_gap_s = all.longest_s;
  } else if (pace_.starved && all.late_s <= 0.5 * parameters_.most_late_s) {
    pace_.starved = false;
  }
}

const LoopPace& LoopGuard::tick(core::Nanoseconds now_ns) noexcept {
  const double away_s =
      before_ns_ == 0 ? parameters_.period_s : std::max(0.0, core::seconds(now_ns - before_ns_));
  before_ns_ = now_ns;
  pace_.held_s = std::max(away_s, pace_.held_s - kForgotten * away_s);
  pace_.late = away_s > parameters_.late_limit_s;
  slide(away_s);
  if (pace_.late) {
    Slot& slot = slots_[newest_];
    slot.late_s += away_s - parameters_.period_s;
    slot.longest_s = std::max(slot.longest_s, away_s);
    ++slot.ticks;
  }
  assess();
  return pace_;
}

}  // namespace phantom::teleop
