#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/can/can_bus.hpp"

namespace phantom::can {

/// How a number lies in a frame's data.
enum class NumberKind : std::uint8_t { kSigned, kUnsigned, kFloat };

/// One of the six numbers of a force/torque sensor: bytes `first` … `first` + `bytes` − 1 of a frame.
struct WrenchChannel {
  std::uint32_t id = 0;
  int first = 0;       ///< 0…7
  double scale = 1.0;  ///< N or N·m per count (of a float: per unit)
  double zero = 0.0;   ///< N or N·m at count 0
};

/// A part of a byte that says how the sensor is: `data[byte] & mask` is `good` when it measures.
struct StatusBits {
  std::uint32_t id = 0;
  int byte = 0;
  std::uint8_t mask = 0, good = 0;
};

/// The six numbers by name.
inline constexpr std::array kWrenchNames{"force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z"};

/// Frames in which a force/torque sensor sends one wrench: each of the identifiers once, within `set_s`.
struct WrenchFrames {
  static constexpr std::size_t kMax = 6;
  bool extended = false;  ///< 29-bit identifiers
  bool big_endian = false;
  NumberKind kind = NumberKind::kSigned;
  int bytes = 2;                            ///< of each number: 1…4; of a float 4
  std::array<WrenchChannel, 6> channels{};  ///< force along x, y, z, then torque about x, y, z
  std::vector<StatusBits> status;
  double set_s = 0.001;  ///< frames of one wrench come within this, those of two wrenches do not
};

/// Returns the identifiers of `frames`, each once. Not real-time safe.
std::vector<std::uint32_t> ids_of(const WrenchFrames& frames);
/// Checks the frames: identifiers of their format, at most WrenchFrames::kMax, numbers and status within
/// eight bytes, each number in bytes of its own. The message names what is wrong and what is allowed.
core::Status check(const WrenchFrames& frames);

/// A wrench as it was sent. Trivially copyable.
struct SentWrench {
  std::array<double, 6> values{};  ///< force in N, then torque in N·m
  bool valid = false;              ///< its status bits are good, and its numbers are finite
  core::Nanoseconds time_ns = 0;   ///< of its first frame's receipt
};

/// Puts a sensor's wrenches together from frames. A wrench is whole when each of its frames has come once,
/// within WrenchFrames::set_s; a frame that comes again, or too late, begins the next one, so that frames of
/// two wrenches are never mixed. A frame that is too short makes its wrench invalid. Frames of other
/// identifiers or formats, and remote requests, are none of the sensor's.
class WrenchAssembly {
 public:
  /// The frames must have passed check().
  explicit WrenchAssembly(const WrenchFrames& frames);

  /// Takes a frame. Returns whether it completed a wrench, which is then in wrench(). Real-time safe: yes.
  bool take(const CanFrame& frame, core::Nanoseconds time_ns) noexcept;
  /// Forgets the frames of a wrench that is not whole.
  void drop() noexcept { come_ = 0; }
  const SentWrench& wrench() const noexcept { return whole_; }
  std::uint64_t incomplete() const noexcept {
    return incomplete_;
  }  ///< wrenches of which a frame was missing

 private:
  double number(const CanFrame& frame, int first) const noexcept;

  WrenchFrames frames_;
  std::vector<std::uint32_t> ids_;
  std::vector<int> needed_bytes_;  // of each frame
  std::uint32_t come_ = 0;         // bit i: the frame of ids_[i]
  core::Nanoseconds set_ns_;
  SentWrench next_, whole_;
  std::uint64_t incomplete_ = 0;
};

}  // namespace phantom::can
