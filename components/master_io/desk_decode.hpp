#pragma once

#include <linux/input.h>

#include <array>
#include <cstddef>
#include <string_view>

#include "components/master_io/desk.hpp"

namespace phantom::master_io {

/// Range of an absolute axis as its device reports it.
struct AxisRange {
  int min = -32768, max = 32767;
};
using AxisRanges = std::array<AxisRange, ABS_CNT>;

/// From the kernel's input events to what they mean. Sticks: left x, y and right x, y (ABS_RX/RY, or ABS_Z/RZ
/// where the device has no RX); shoulder buttons or Tab: other joints; Select, Mode or Esc: emergency stop;
/// Start or Enter: reset. A keyboard's arrows are the left stick, W A S D the right one. Up is positive.
class InputDecoder {
 public:
  InputDecoder(const AxisRanges& ranges, bool right_stick_is_rx) : ranges_(ranges), rx_(right_stick_is_rx) {}

  void take(const input_event& event) noexcept;
  const DeskState& state() const noexcept { return state_; }
  DeskState& state() noexcept { return state_; }
  const DeskEvents& events() const noexcept { return events_; }

 private:
  void take_axis(unsigned code, int value) noexcept;
  void take_key(unsigned code, bool down) noexcept;
  void hold(std::size_t axis, int direction, bool down) noexcept;

  AxisRanges ranges_;
  bool rx_;
  std::array<std::array<bool, 2>, kDeskAxes> held_{};  // by axis: negative, positive
  DeskState state_{.alive = true};
  DeskEvents events_;
};

/// The same from the bytes of a terminal, which tells presses but no releases: a press pushes for kPress_s,
/// and the keyboard's own repetition keeps it up. Esc or Space alone: emergency stop.
class TerminalDecoder {
 public:
  static constexpr double kPress_s = 0.3;

  void take(std::string_view bytes, double now_s) noexcept;
  /// Lets go of what was pressed too long ago.
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
