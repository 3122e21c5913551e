#pragma once

#include <linux/input.h>

#include <array>
#include <cstddef>
#include <string_view>

#include "components/master_io/desk.hpp"

namespace phantom::master_io {

/// Range of an absolute axis as reported by its device.
struct AxisRange {
  int min = -32768, max = 32767;
};
using AxisRanges = std::array<AxisRange, ABS_CNT>;

/// Decodes the kernel's input events. Sticks: left x, y and right x, y (ABS_RX/RY, or ABS_Z/RZ if the device
/// has no RX). Shoulder buttons or Tab: other joints. Select, Mode or Esc: emergency stop. Start or Enter:
/// reset. A keyboard's arrows are the left stick, W A S D the right stick. Up is positive.
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

/// Decodes the bytes of a terminal, which reports presses but no releases. A press pushes for kPress_s; the
/// keyboard's repetition prolongs it. Esc or Space alone: emergency stop.
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
