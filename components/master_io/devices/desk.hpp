#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/joints.hpp"

namespace phantom::master_io {

/// Axes of the desk, at which a person works without a master arm. Sticks, keys or a space mouse push a
/// virtual master; its drag and feedback are felt as its slowness and as rumble. Sticks have the first
/// kStickAxes.
inline constexpr std::size_t kDeskAxes = 6, kStickAxes = 4;

struct DeskConfig {
  std::string device =
      "auto";  ///< a file of /dev/input, "auto" for the first gamepad or joystick, or "terminal" for keys
  bool space_mouse = false;  ///< "auto" is the first space mouse
  double dead_zone = 0.12;   ///< share of an axis around its middle that has no effect, 0…0.9
  double exponent = 1.5;     ///< exponent of the axes' curve; above 1: fine near the middle
  std::vector<std::array<int, kDeskAxes>>
      banks;                ///< joint, from 0, that each axis pushes, −1: none; one bank applies at a time
  core::JointArray push{};  ///< greatest push, N·m or N
  core::JointArray
      brake{};  ///< damping of the hand, N·m·s/rad or N·s/m; full push ÷ damping is the greatest speed
};

/// Present state of the stick or keys.
struct DeskState {
  /// −1…1: left stick right/up, right stick right/up. Of a space mouse: moved right, away, up; turned about
  /// these.
  std::array<double, kDeskAxes> axes{};
  std::size_t bank = 0;
  bool clutch_out = false;  ///< a space mouse's left button is held
  bool alive = false;       ///< false: the device is gone, and nothing is pushed
};

/// What a key or button chooses of the percepts (Table 6.1): one of them on or off, or those beside the law.
enum class PerceptKey : std::uint8_t { kDrag, kTone, kViews, kLaw };
inline constexpr std::size_t kPerceptKeys = 4;

/// Numbers of requests so far: to stop, to reset, to open and to close the gripper, and of each PerceptKey.
struct DeskEvents {
  std::uint32_t stops = 0, resets = 0, opens = 0, closes = 0;
  std::array<std::uint32_t, kPerceptKeys> percepts{};

  void choose(PerceptKey key) noexcept { ++percepts[static_cast<std::size_t>(key)]; }
  friend bool operator==(const DeskEvents&, const DeskEvents&) = default;
};

/// Returns an axis after dead zone and curve, −1…1. Real-time safe: yes.
double shaped(double axis, double dead_zone, double exponent) noexcept;

/// Computes the hand's torque from the desk's input. Has no side effects.
class DeskHand {
 public:
  DeskHand(const DeskConfig& config, std::size_t joint_count);

  /// Returns the torque on the virtual master that moves at `v`. Real-time safe: yes.
  const core::JointArray& step(const DeskState& desk, const core::JointArray& v) noexcept;

 private:
  static constexpr std::size_t kMaxBanks = 8;
  std::size_t joint_count_, bank_count_;
  std::array<std::array<int, kDeskAxes>, kMaxBanks> banks_{};
  double dead_zone_, exponent_;
  core::JointArray push_, brake_, torque_Nm_{};
};

}  // namespace phantom::master_io
