#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/joints.hpp"

namespace phantom::master_io {

/// A person at a desk, without a master arm: stick or keys push a virtual master, whose drag and feedback are
/// felt as its slowness and as rumble.
inline constexpr std::size_t kDeskAxes = 4;

struct DeskConfig {
  std::string device =
      "auto";               ///< a file of /dev/input, "auto": the first gamepad or joystick, "terminal": keys
  double dead_zone = 0.12;  ///< of an axis, 0…0.9
  double exponent = 1.5;    ///< above 1: fine near the middle
  std::vector<std::array<int, kDeskAxes>>
      banks;                ///< joint from 0 that each axis pushes, −1: none; one bank at a time
  core::JointArray push{};  ///< greatest push, N·m or N
  core::JointArray
      brake{};  ///< damping of the hand, N·m·s/rad or N·s/m: full push over it is the fastest motion
};

/// What the stick or the keys say now.
struct DeskState {
  std::array<double, kDeskAxes> axes{};  ///< −1…1: left right/up, right right/up
  std::size_t bank = 0;
  bool alive = false;  ///< false: the device is gone; nothing is pushed
};

/// Requests that are events, counted.
struct DeskEvents {
  std::uint32_t stops = 0, resets = 0;
};

/// An axis with its dead zone cut out and its curve, −1…1. Real-time safe: yes.
double shaped(double axis, double dead_zone, double exponent) noexcept;

/// The hand at the desk. Pure.
class DeskHand {
 public:
  DeskHand(const DeskConfig& config, std::size_t joint_count);

  /// Torque on the virtual master that moves at `v`. Real-time safe: yes.
  const core::JointArray& step(const DeskState& desk, const core::JointArray& v) noexcept;

 private:
  static constexpr std::size_t kMaxBanks = 8;
  std::size_t joint_count_, bank_count_;
  std::array<std::array<int, kDeskAxes>, kMaxBanks> banks_{};
  double dead_zone_, exponent_;
  core::JointArray push_, brake_, torque_Nm_{};
};

}  // namespace phantom::master_io
