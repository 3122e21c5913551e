#pragma once

#include <sys/un.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "common/can/frame.hpp"
#include "common/core/status.hpp"

namespace phantom::can::wire {

/// A packet between a node of a userspace bus and its hub, which run on the same host.
struct Packet {
  enum Kind : std::uint8_t { kFrame = 1, kEvent = 2, kRestart = 3 };
  std::uint8_t kind = kFrame;
  std::uint8_t state = 0;
  std::uint16_t errors = 0;
  std::uint32_t id = 0;
  std::uint8_t extended = 0, remote = 0, length = 0, reserved = 0;
  std::uint32_t lost = 0;  ///< frames before this one that did not fit into the node's socket
  std::uint8_t data[8] = {};
  std::int64_t time_ns = 0;
};
static_assert(sizeof(Packet) == 32);

inline Packet packet_of(const CanFrame& frame) noexcept {
  Packet p;
  p.id = frame.id;
  p.extended = frame.extended;
  p.remote = frame.remote;
  p.length = frame.length;
  std::memcpy(p.data, frame.data.data(), 8);
  return p;
}

inline CanFrame frame_of(const Packet& p) noexcept {
  CanFrame frame{.id = p.id, .extended = p.extended != 0, .remote = p.remote != 0, .length = p.length};
  std::memcpy(frame.data.data(), p.data, 8);
  return frame;
}

/// Returns the NAME of "user:NAME", 1 to 64 characters. Errors: kInvalidArgument.
core::Expected<std::string> name_in(const std::string& address);

/// Fills in the hub's socket address, in the abstract namespace (first byte zero), and returns its size.
/// `name` has at most 64 characters.
inline socklen_t address_of(const std::string& name, sockaddr_un& address) noexcept {
  const std::string path = "phantom-can/" + name;
  address = {};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path + 1, path.data(), path.size());
  return static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + path.size());
}

}  // namespace phantom::can::wire
