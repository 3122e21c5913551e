#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/can/frame.hpp"

namespace phantom::can {

/// Identifiers of the CiA 301 predefined connection set: function + node id (1…127).
enum Cob : std::uint32_t {
  kCobNmt = 0x000,
  kCobSync = 0x080,  ///< EMCY is 0x080 + node
  kCobEmcy = 0x080,
  kCobTpdo1 = 0x180,
  kCobRpdo1 = 0x200,
  kCobTpdo2 = 0x280,
  kCobTpdo3 = 0x380,
  kCobSdoReply = 0x580,
  kCobSdoRequest = 0x600,
  kCobHeartbeat = 0x700,
};

enum class NmtCommand : std::uint8_t {
  kStart = 0x01,
  kStop = 0x02,
  kPreOperational = 0x80,
  kResetNode = 0x81,
  kResetCommunication = 0x82,
};

/// NMT states as coded in a heartbeat.
enum class NmtState : std::uint8_t { kBootUp = 0, kStopped = 4, kOperational = 5, kPreOperational = 127 };

/// Read and write little-endian integers, as in CANopen. `bytes` holds at least `size` (1…4) bytes.
constexpr std::uint32_t get_le(std::span<const std::uint8_t> bytes, std::size_t size) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= static_cast<std::uint32_t>(bytes[i]) << (8 * i);
  return value;
}
constexpr void put_le(std::span<std::uint8_t> bytes, std::uint32_t value, std::size_t size) noexcept {
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

constexpr CanFrame nmt_frame(NmtCommand command, std::uint8_t node) noexcept {
  return {.id = kCobNmt, .length = 2, .data = {static_cast<std::uint8_t>(command), node}};
}
constexpr CanFrame sync_frame() noexcept { return {.id = kCobSync}; }
constexpr CanFrame heartbeat_frame(std::uint8_t node, NmtState state) noexcept {
  return {.id = kCobHeartbeat + node, .length = 1, .data = {static_cast<std::uint8_t>(state)}};
}

/// Returns the meaning of an SDO abort code (CiA 301).
const char* sdo_abort_text(std::uint32_t code) noexcept;
/// Returns the meaning of an emergency error code (CiA 301 and 402), by its group.
const char* emergency_text(std::uint16_t code) noexcept;

/// Abort codes sent by SdoClient.
inline constexpr std::uint32_t kAbortTimedOut = 0x05040000;
inline constexpr std::uint32_t kAbortUnknownCommand = 0x05040001;
inline constexpr std::uint32_t kAbortToggle = 0x05030000;
inline constexpr std::uint32_t kAbortOutOfMemory = 0x05040005;

}  // namespace phantom::can
