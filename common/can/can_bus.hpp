#pragma once

#include <memory>
#include <span>
#include <string>

#include "common/can/frame.hpp"
#include "common/core/status.hpp"

namespace phantom::can {

/// Accepts frames of one format whose identifier equals `id` in the bits of `mask`.
struct CanFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
  bool extended = false;
};

inline bool passes(std::span<const CanFilter> filters, const CanFrame& frame) noexcept {
  for (const CanFilter& f : filters) {
    if (f.extended == frame.extended && (frame.id & f.mask) == (f.id & f.mask)) return true;
  }
  return false;
}

enum class SendResult {
  kSent,       ///< handed to the controller's queue
  kQueueFull,  ///< refused: the bus is slower than its user, or nobody acknowledges
  kBusOff,     ///< refused: the controller has left the bus; see restart()
  kDown,       ///< refused: the interface is down or gone
  kInvalid,    ///< refused: not a valid frame
};

struct BusCounters {
  std::uint64_t sent = 0, received = 0, refused = 0, errors = 0, lost = 0, bus_offs = 0;
};

/// Interface of one node on a CAN bus. Not thread-safe: only one thread may use it.
///
/// Frames of one node arrive at all other nodes in the order in which they were sent, and never at the node
/// itself. A sent frame may still be lost; CAN does not report which nodes missed it.
class CanBus {
 public:
  virtual ~CanBus() = default;

  /// Hands a frame to the controller. Never waits. Real-time safe: yes.
  virtual SendResult send(const CanFrame& frame) noexcept = 0;
  /// Receives the next frame or event. Returns false if there is none. Never waits. Real-time safe: yes.
  virtual bool receive(Received& received) noexcept = 0;
  /// Waits at most `timeout_ns` until receive() may have something. Returns false at the timeout. For threads
  /// that are not periodic.
  virtual bool wait(core::Nanoseconds timeout_ns) noexcept = 0;
  /// Receives from now on only frames that pass one of `filters` (no filters: no frames). Events are always
  /// received. A new bus passes everything. Not real-time safe.
  virtual core::Status set_filters(std::span<const CanFilter> filters) = 0;
  /// Brings the controller back after bus-off or down. The effect may come later: see state(). May take
  /// milliseconds; not real-time safe.
  virtual core::Status restart() = 0;

  /// Returns the bus's state after the events that receive() has delivered.
  virtual BusState state() const noexcept = 0;
  virtual const BusCounters& counters() const noexcept = 0;
  /// Returns the address by which the bus was opened.
  virtual const std::string& address() const noexcept = 0;
};

/// Opens a bus by address: "can0" (any SocketCAN interface) or "user:NAME" (a userspace bus that a process on
/// this host serves, see UserBusHub). Errors: kNotFound with what is missing; kInvalidArgument.
core::Expected<std::unique_ptr<CanBus>> open_bus(const std::string& address);

}  // namespace phantom::can
