#pragma once

#include <array>
#include <cstdint>

#include "common/core/clock.hpp"

namespace phantom::can {

/// A classic CAN frame (ISO 11898-1) as on the bus.
struct CanFrame {
  std::uint32_t id = 0;                ///< 11 bits, or 29 if extended
  bool extended = false;               ///< 29-bit identifier
  bool remote = false;                 ///< remote request: a length, no data
  std::uint8_t length = 0;             ///< 0…8
  std::array<std::uint8_t, 8> data{};  ///< bytes past `length` are zero

  friend bool operator==(const CanFrame&, const CanFrame&) = default;
};

/// Returns whether length and identifier are valid for the frame's format.
constexpr bool is_valid(const CanFrame& frame) noexcept {
  return frame.length <= 8 && frame.id < (frame.extended ? 1U << 29 : 1U << 11);
}

/// State of the bus as a controller sees it: error confinement of ISO 11898-1, and down (no controller, no
/// link).
enum class BusState : std::uint8_t { kActive, kWarning, kPassive, kBusOff, kDown };

constexpr const char* name_of(BusState state) noexcept {
  constexpr const char* kNames[] = {"active", "warning", "passive", "bus-off", "down"};
  return kNames[static_cast<std::size_t>(state)];
}

/// Errors and events of a bus; bits of Received::errors.
enum BusError : std::uint16_t {
  kErrorTransmitTimeout = 1,
  kErrorArbitrationLost = 2,
  kErrorProtocol = 4,   ///< bit, form or stuff error
  kErrorNoAck = 8,      ///< nobody acknowledged: alone on the bus, or the cable is off
  kErrorOverflow = 16,  ///< received frames were lost
  kErrorState = 32,     ///< the controller's state changed
  kErrorBusOff = 64,
  kErrorRestarted = 128,  ///< back on the bus after bus-off
  kErrorDown = 256,       ///< the interface went down or away
  kErrorTransceiver = 512,
};

/// A received frame (errors = 0), or an event of the bus itself (errors ≠ 0, frame empty).
struct Received {
  CanFrame frame;
  std::uint16_t errors = 0;
  BusState state = BusState::kActive;  ///< state after this
  core::Nanoseconds time_ns = 0;       ///< time of receipt, CLOCK_MONOTONIC of this host; never decreases

  bool is_frame() const noexcept { return errors == 0; }
};

}  // namespace phantom::can
