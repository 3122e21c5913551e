#pragma once

#include <memory>
#include <span>
#include <string>

#include "common/can/frame.hpp"
#include "common/core/status.hpp"

namespace phantom::can {

/// Passes frames of one format whose identifier equals `id` in the bits of `mask`.
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
  kQueueFull,  ///< not taken: the bus is slower than its user, or nobody acknowledges
  kBusOff,     ///< not taken: the controller has left the bus; see restart()
  kDown,       ///< not taken: the interface is down or gone
  kInvalid,    ///< not taken: not a frame
};

struct BusCounters {
  std::uint64_t sent = 0, received = 0, refused = 0, errors = 0, lost = 0, bus_offs = 0;
};

/// One node's place on a CAN bus. Not thread-safe: one thread uses it.
///
/// Frames of one node arrive at all other nodes in the order in which they were sent, and never at the node
/// itself. A frame that was sent may still be lost: CAN tells nobody who missed it.
class CanBus {
 public:
  virtual ~CanBus() = default;

  /// Hands a frame to the controller; never waits. Real-time safe: yes.
  virtual SendResult send(const CanFrame& frame) noexcept = 0;
  /// Takes the next frame or piece of news; false if there is none. Never waits. Real-time safe: yes.
  virtual bool receive(Received& received) noexcept = 0;
  /// Waits until receive() may have something, at most `timeout_ns`; false if the time passed. For threads
  /// that are not periodic.
  virtual bool wait(core::Nanoseconds timeout_ns) noexcept = 0;
  /// From now on only frames that pass one of `filters` are received (none: no frame); news always is.
  /// A new bus passes everything. Not real-time safe.
  virtual core::Status set_filters(std::span<const CanFilter> filters) = 0;
  /// Brings the controller back after bus-off or down. Takes effect in its time: see state(). May take
  /// milliseconds; not real-time safe.
  virtual core::Status restart() = 0;

  /// As of the news that receive() has delivered.
  virtual BusState state() const noexcept = 0;
  virtual const BusCounters& counters() const noexcept = 0;
  /// The address it was opened by.
  virtual const std::string& address() const noexcept = 0;
};

/// Opens a bus by address: "can0" (any SocketCAN interface) or "user:NAME" (a userspace bus on this host that
/// some process serves, see UserBusHub). Errors: kNotFound with what is missing; kInvalidArgument.
core::Expected<std::unique_ptr<CanBus>> open_bus(const std::string& address);

}  // namespace phantom::can
