#include "common/teleop/coupling/enabling_switch.hpp"

namespace phantom::teleop {

const char* reason_of(SwitchState state) noexcept {
  switch (state) {
    case SwitchState::kReleased:
      return "released";
    case SwitchState::kToBeReleased:
      return "has to be released before it counts";
    case SwitchState::kPressedThrough:
      return "pressed through: release it, then hold it in the middle";
    case SwitchState::kAbsent:
      return "no data: is it plugged in?";
    case SwitchState::kContactsDiffer:
      return "at fault: its two contacts differ until both are seen released";
    default:
      return "";
  }
}

core::ComponentState component_state(SwitchState state) noexcept {
  switch (state) {
    case SwitchState::kAbsent:
      return core::ComponentState::kDegraded;
    case SwitchState::kContactsDiffer:
      return core::ComponentState::kFault;
    default:
      return core::ComponentState::kReady;
  }
}

SwitchState EnablingSwitch::refuse(SwitchState state) noexcept {
  armed_ = counted_ = false;
  held_s_ = 0.0;
  return state;
}

SwitchState EnablingSwitch::step(const SwitchContacts& contacts, double dt_s) noexcept {
  const bool sound = contacts.read && contacts.age_s <= parameters_.stale_s;  // false for NaN too
  const bool released = sound && !contacts.through && !contacts.first && !contacts.second;
  const bool held = contacts.first && contacts.second;
  released_s_ = released ? released_s_ + dt_s : 0.0;
  differ_s_ = sound && contacts.first != contacts.second ? differ_s_ + dt_s : 0.0;
  faulty_ = faulty_ || differ_s_ > parameters_.discrepancy_s;
  if (!sound) return refuse(SwitchState::kAbsent);
  if (contacts.through) return refuse(faulty_ ? SwitchState::kContactsDiffer : SwitchState::kPressedThrough);
  if (counted_ && !held) armed_ = false;  // it is let go, and both contacts have to say so
  counted_ = counted_ && held;
  if (released_s_ > parameters_.settle_s) {
    armed_ = true;
    faulty_ = false;
  }
  if (faulty_) return refuse(SwitchState::kContactsDiffer);
  if (released) {
    held_s_ = 0.0;
    return SwitchState::kReleased;
  }
  if (!armed_) return SwitchState::kToBeReleased;
  held_s_ = held ? held_s_ + dt_s : 0.0;
  counted_ = counted_ || held_s_ > parameters_.settle_s;
  return counted_ ? SwitchState::kHeld : SwitchState::kReleased;
}

}  // namespace phantom::teleop
