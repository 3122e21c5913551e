#pragma once

#include <linux/input.h>

#include <array>
#include <cstddef>
#include <string_view>

#include "components/master_io/devices/desk.hpp"

namespace phantom::master_io {

/// Range of an absolute axis as reported by its device.
struct AxisRange {
  int min = -32768, max = 32767;
};
using AxisRanges = std::array<AxisRange, ABS_CNT>;

/// Decodes the kernel's input events. Sticks: left x, y and right x, y (ABS_RX/RY, or ABS_Z/RZ if the device
/// has no RX). Shoulder buttons or Tab: other joints. Select, Mode or Esc: emergency stop. Start or Enter:
/// reset. Button A (south) or C: gripper closed; B (east) or O: open. A keyboard's arrows are the left stick,
/// W A S D the right stick. Up is positive. The cross left or 1: drag on or off; up or 2: tone; right or 3:
/// views; down or L: as the law has them.
class InputDecoder {
 public:
  InputDecoder(const AxisRanges& ranges, bool right_stick_is_rx) : ranges_(ranges), rx_(right_stick_is_rx) {}

  void take(const input_event& event, double now_s = 0.0) noexcept;
  void release_expired(double) noexcept {}  ///< a stick reports where it stands
  const DeskState& state() const noexcept { return state_; }
  DeskState& state() noexcept { return state_; }
  const DeskEvents& events() const noexcept { return events_; }

 private:
  void take_axis(unsigned code, int value) noexcept;
  void take_key(unsigned code, bool down) noexcept;
  void take_hat(std::size_t axis, int value) noexcept;
  void hold(std::size_t axis, int direction, bool down) noexcept;

  AxisRanges ranges_;
  bool rx_;
  std::array<std::array<bool, 2>, kDeskAxes> held_{};  // by axis: negative, positive
  std::array<int, 2> hat_{};                           // where the cross is pressed: right, down
  DeskState state_{.alive = true};
  DeskEvents events_;
};

/// Decodes the kernel's input events of a 3Dconnexion space mouse: three axes moved, three turned, as
/// absolute or relative events (each a deflection; the kernel leaves out zeros, so that they expire after
/// kHeld_s). Its axes are right, towards the person and down; ours right, away and up. Left button held:
/// clutch out; right: emergency stop; third and fourth, of those that have them: gripper closed, open.
class SpaceMouseDecoder {
 public:
  static constexpr double kHeld_s = 0.1;
  static constexpr int kFull = 350;  ///< deflection of a relative event at the end stop

  explicit SpaceMouseDecoder(const AxisRanges& ranges) : ranges_(ranges) {}
  void take(const input_event& event, double now_s) noexcept;
  /// Sets relative axes to 0 whose last event is too old.
  void release_expired(double now_s) noexcept;
  const DeskState& state() const noexcept { return state_; }
  DeskState& state() noexcept { return state_; }
  const DeskEvents& events() const noexcept { return events_; }

 private:
  AxisRanges ranges_;
  DeskState state_{.alive = true};
  DeskEvents events_;
  std::array<double, kDeskAxes> until_s_{};
  std::array<bool, kDeskAxes> relative_{};
};

/// Returns whether a key or button means something at the desk, so that it cannot be an enabling switch too.
bool is_desk_key(int code, bool space_mouse) noexcept;

/// Decodes what spacenavd reports of a space mouse: its axes are right, up and away, moved and turned; ours
/// right, away and up. A deflection that is not renewed for kHeld_s counts as none, since a daemon that hangs
/// would hold it for ever. Left button held: clutch out; right: emergency stop.
class SpacenavDecoder {
 public:
  static constexpr double kHeld_s = 0.5;

  void deflect(const std::array<int, kDeskAxes>& axes, double now_s) noexcept;
  void press(int button, bool down) noexcept;
  void release_expired(double now_s) noexcept;
  void lose() noexcept {
    state_ = {.alive = true};
  }  ///< forgets deflection and buttons of a daemon that ended
  const DeskState& state() const noexcept { return state_; }
  const DeskEvents& events() const noexcept { return events_; }

 private:
  DeskState state_{.alive = true};
  DeskEvents events_;
  double until_s_ = 0.0;
};

/// Decodes the bytes of a terminal, which reports presses but no releases. A press pushes for kPress_s; the
/// keyboard's repetition prolongs it. Esc or Space alone: emergency stop. C, O: gripper closed, open.
/// 1, 2, 3, L: percepts, as InputDecoder has them.
class TerminalDecoder {
 public:
  static constexpr double kPress_s = 0.3;

  void take(std::string_view bytes, double now_s) noexcept;
  /// Releases keys whose press has expired.
  void release_expired(double now_s) noexcept;
  const DeskState& state() const noexcept { return state_; }
  const DeskEvents& events() const noexcept { return events_; }

 private:
  void press(std::size_t axis, double push, double now_s) noexcept;

  DeskState state_{.alive = true};
  DeskEvents events_;
  std::array<double, kDeskAxes> until_s_{};
};

}  // namespace phantom::master_io
