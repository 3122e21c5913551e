#include "components/master_io/devices/desk_decode.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace phantom::master_io {

void InputDecoder::take(const input_event& event, double) noexcept {
  const bool hat = event.code == ABS_HAT0X || event.code == ABS_HAT0Y;
  if (event.type == EV_ABS && hat) return take_hat(event.code == ABS_HAT0X ? 0 : 1, event.value);
  if (event.type == EV_ABS) take_axis(event.code, event.value);
  if (event.type == EV_KEY && event.value != 2) take_key(event.code, event.value == 1);  // 2: key repetition
}

void InputDecoder::take_axis(unsigned code, int value) noexcept {
  std::size_t axis = kDeskAxes;
  bool up_is_negative = false;
  if (code == ABS_X) axis = 0;
  if (code == ABS_Y) axis = 1, up_is_negative = true;
  if (code == (rx_ ? ABS_RX : ABS_Z)) axis = 2;
  if (code == (rx_ ? ABS_RY : ABS_RZ)) axis = 3, up_is_negative = true;
  if (axis == kDeskAxes) return;
  const AxisRange range = ranges_[code];
  if (range.max <= range.min) return;
  const double span = static_cast<double>(range.max) - range.min;
  const double centred = std::clamp(2.0 * (static_cast<double>(value) - range.min) / span - 1.0, -1.0, 1.0);
  state_.axes[axis] = up_is_negative ? -centred : centred;
}

void InputDecoder::hold(std::size_t axis, int direction, bool down) noexcept {
  held_[axis][direction > 0 ? 1 : 0] = down;
  state_.axes[axis] = (held_[axis][1] ? 1.0 : 0.0) - (held_[axis][0] ? 1.0 : 0.0);
}

void InputDecoder::take_key(unsigned code, bool down) noexcept {
  switch (code) {
    case KEY_RIGHT:
      return hold(0, 1, down);
    case KEY_LEFT:
      return hold(0, -1, down);
    case KEY_UP:
      return hold(1, 1, down);
    case KEY_DOWN:
      return hold(1, -1, down);
    case KEY_D:
      return hold(2, 1, down);
    case KEY_A:
      return hold(2, -1, down);
    case KEY_W:
      return hold(3, 1, down);
    case KEY_S:
      return hold(3, -1, down);
    default:
      break;
  }
  if (!down) return;
  switch (code) {
    case BTN_TR:
    case KEY_TAB:
      ++state_.bank;
      return;
    case BTN_TL:
      state_.bank = state_.bank == 0 ? 0 : state_.bank - 1;
      return;
    case BTN_SELECT:
    case BTN_MODE:
    case KEY_ESC:
    case KEY_SPACE:
      ++events_.stops;
      return;
    case BTN_START:
    case KEY_ENTER:
      ++events_.resets;
      return;
    case BTN_SOUTH:
    case KEY_C:
      ++events_.closes;
      return;
    case BTN_EAST:
    case KEY_O:
      ++events_.opens;
      return;
    case BTN_DPAD_LEFT:
    case KEY_1:
      return events_.choose(PerceptKey::kDrag);
    case BTN_DPAD_UP:
    case KEY_2:
      return events_.choose(PerceptKey::kTone);
    case BTN_DPAD_RIGHT:
    case KEY_3:
      return events_.choose(PerceptKey::kViews);
    case BTN_DPAD_DOWN:
    case KEY_L:
      return events_.choose(PerceptKey::kLaw);
    default:
      return;
  }
}

// Most gamepads report their cross as two axes of −1, 0 and 1. Like a key, it counts as it is pressed.
void InputDecoder::take_hat(std::size_t axis, int value) noexcept {
  const int direction = value > 0 ? 1 : value < 0 ? -1 : 0;
  if (std::exchange(hat_[axis], direction) == direction || direction == 0) return;
  if (axis == 0) return events_.choose(direction < 0 ? PerceptKey::kDrag : PerceptKey::kViews);
  events_.choose(direction < 0 ? PerceptKey::kTone : PerceptKey::kLaw);
}

void SpaceMouseDecoder::take(const input_event& event, double now_s) noexcept {
  static_assert(ABS_X == REL_X && ABS_RZ == REL_RZ && ABS_RZ == ABS_X + 5);
  if ((event.type == EV_ABS || event.type == EV_REL) && event.code < kDeskAxes) {
    const bool relative = event.type == EV_REL;
    const AxisRange range = relative ? AxisRange{-kFull, kFull} : ranges_[event.code];
    const double full = static_cast<double>(std::max(std::abs(range.min), std::abs(range.max)));
    const double deflection = full > 0.0 ? std::clamp(event.value / full, -1.0, 1.0) : 0.0;
    const bool along_x = event.code == ABS_X || event.code == ABS_RX;
    state_.axes[event.code] = along_x ? deflection : -deflection;
    relative_[event.code] = relative;
    until_s_[event.code] = now_s + kHeld_s;
  }
  if (event.type != EV_KEY) return;
  if (event.code == BTN_0) state_.clutch_out = event.value != 0;
  if (event.value != 1) return;
  if (event.code == BTN_1) ++events_.stops;
  if (event.code == BTN_2) ++events_.closes;
  if (event.code == BTN_3) ++events_.opens;
}

void SpaceMouseDecoder::release_expired(double now_s) noexcept {
  for (std::size_t i = 0; i < kDeskAxes; ++i) {
    if (relative_[i] && now_s >= until_s_[i]) state_.axes[i] = 0.0;
  }
}

bool is_desk_key(int code, bool space_mouse) noexcept {
  if (space_mouse) return code == BTN_0 || code == BTN_1 || code == BTN_2 || code == BTN_3;
  InputDecoder decoder({}, true);
  decoder.state().bank = 1;  // from which another one may be chosen in either direction
  input_event down{};
  down.type = EV_KEY;
  down.code = static_cast<__u16>(code);
  down.value = 1;
  decoder.take(down);
  const DeskState& now = decoder.state();
  return now.bank != 1 || now.axes != DeskState{}.axes || decoder.events() != DeskEvents{};
}

void SpacenavDecoder::deflect(const std::array<int, kDeskAxes>& axes, double now_s) noexcept {
  constexpr std::array<std::size_t, kDeskAxes> kFrom{0, 2, 1, 3, 5, 4};
  for (std::size_t i = 0; i < kDeskAxes; ++i)
    state_.axes[i] = std::clamp(axes[kFrom[i]] / double{SpaceMouseDecoder::kFull}, -1.0, 1.0);
  until_s_ = now_s + kHeld_s;
}

void SpacenavDecoder::press(int button, bool down) noexcept {
  if (button == 0) state_.clutch_out = down;
  if (button == 1 && down) ++events_.stops;
}

void SpacenavDecoder::release_expired(double now_s) noexcept {
  if (now_s >= until_s_) state_.axes = {};
}

void TerminalDecoder::press(std::size_t axis, double push, double now_s) noexcept {
  state_.axes[axis] = push;
  until_s_[axis] = now_s + kPress_s;
}

void TerminalDecoder::take(std::string_view bytes, double now_s) noexcept {
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (bytes[i] == '\x1b' && i + 2 < bytes.size() && bytes[i + 1] == '[') {
      const char arrow = bytes[i + 2];
      if (arrow == 'C') press(0, 1.0, now_s);
      if (arrow == 'D') press(0, -1.0, now_s);
      if (arrow == 'A') press(1, 1.0, now_s);
      if (arrow == 'B') press(1, -1.0, now_s);
      i += 2;
      continue;
    }
    switch (bytes[i]) {
      case 'd':
        press(2, 1.0, now_s);
        break;
      case 'a':
        press(2, -1.0, now_s);
        break;
      case 'w':
        press(3, 1.0, now_s);
        break;
      case 's':
        press(3, -1.0, now_s);
        break;
      case '\t':
        ++state_.bank;
        break;
      case '\x1b':
      case ' ':
        ++events_.stops;
        break;
      case '\r':
      case '\n':
        ++events_.resets;
        break;
      case 'c':
        ++events_.closes;
        break;
      case 'o':
        ++events_.opens;
        break;
      case '1':
        events_.choose(PerceptKey::kDrag);
        break;
      case '2':
        events_.choose(PerceptKey::kTone);
        break;
      case '3':
        events_.choose(PerceptKey::kViews);
        break;
      case 'l':
        events_.choose(PerceptKey::kLaw);
        break;
      default:
        break;
    }
  }
}

void TerminalDecoder::release_expired(double now_s) noexcept {
  for (std::size_t k = 0; k < kDeskAxes; ++k) {
    if (now_s >= until_s_[k]) state_.axes[k] = 0.0;
  }
}

}  // namespace phantom::master_io
