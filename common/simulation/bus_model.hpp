#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "common/can/frame.hpp"

namespace phantom::simulation {

/// What goes wrong with frames whose identifier equals `id` in the bits of `mask` (mask 0: all of them).
struct FaultRule {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
  double drop = 0.0;                ///< probability that nobody receives it
  double duplicate = 0.0;           ///< probability that it is received twice
  core::Nanoseconds delay_ns = 0;   ///< it is received so much later
  core::Nanoseconds jitter_ns = 0;  ///< and up to so much more, each for itself: frames overtake
};

struct BusModelOptions {
  double bit_rate = 0.0;           ///< bit/s; frames take their worst-case time; 0: no time
  std::size_t queue_frames = 128;  ///< each node's transmit queue
  std::uint64_t seed = 1;          ///< of the faults
};

/// A CAN bus as a model in time: nodes with transmit queues, arbitration by identifier, acknowledgement,
/// bus-off, and faults. Deterministic with a seed. Knows no clock, socket or thread. Nothing but attach(),
/// detach() and set_faults() uses the heap, unless more than 16384 frames are on their way.
class BusModel {
 public:
  using NodeId = std::size_t;
  using Deliver = std::function<void(NodeId to, const can::Received&)>;

  explicit BusModel(const BusModelOptions& options);

  NodeId attach();
  /// The node is gone, with all it had to send.
  void detach(NodeId node);
  /// A node that is unplugged hears and says nothing, and is told nothing of it.
  void set_plugged(NodeId node, bool plugged);
  void set_faults(std::vector<FaultRule> rules);
  /// The node's controller leaves the bus and drops what it had to send, until restart().
  void set_bus_off(NodeId node, core::Nanoseconds now_ns);
  /// Back on the bus after 128 × 11 bit times.
  void restart(NodeId node, core::Nanoseconds now_ns);

  /// Queues a frame; false if the queue is full or the node is not on the bus. Times never fall.
  bool submit(NodeId node, const can::CanFrame& frame, core::Nanoseconds now_ns);
  /// Lets the bus work until now_ns and hands out what was received by then, in order of time.
  void advance(core::Nanoseconds now_ns, const Deliver& deliver);
  /// When advance() will next have something to do; the greatest time if nothing is known.
  core::Nanoseconds next_event_ns() const noexcept;
  bool queue_is_full(NodeId node) const noexcept { return nodes_[node].count == options_.queue_frames; }
  std::uint64_t frames_on_bus() const noexcept { return frames_; }

 private:
  struct Queued {
    can::CanFrame frame;
    core::Nanoseconds submitted_ns = 0;
  };
  struct Node {
    std::vector<Queued> ring;
    std::size_t first = 0, count = 0;
    bool attached = true, plugged = true, bus_off = false, unacknowledged = false;
    core::Nanoseconds back_ns = -1;  // when a restart completes; < 0: none asked for
    bool speaks() const noexcept { return attached && plugged && !bus_off; }
  };
  struct Delivery {
    core::Nanoseconds time_ns = 0;
    std::uint64_t order = 0;
    NodeId to = 0;
    can::Received received;
  };
  static bool later(const Delivery& a, const Delivery& b) noexcept;
  bool someone_acknowledges(NodeId sender) const noexcept;
  NodeId winner(core::Nanoseconds at_ns) const noexcept;
  core::Nanoseconds earliest_submitted() const noexcept;
  bool transmit_one(core::Nanoseconds now_ns);
  void put_on_bus(NodeId sender, const can::CanFrame& frame, core::Nanoseconds end_ns);
  void push(core::Nanoseconds time_ns, NodeId to, const can::Received& received);
  void news(NodeId to, std::uint16_t errors, can::BusState state, core::Nanoseconds time_ns);
  void finish_restarts(core::Nanoseconds now_ns);

  BusModelOptions options_;
  std::vector<Node> nodes_;
  std::vector<FaultRule> rules_;
  std::vector<Delivery> deliveries_;  // a heap by time
  core::Nanoseconds free_ns_ = 0;     // the bus is idle from here on
  std::uint64_t order_ = 0, frames_ = 0;
  std::mt19937_64 random_;
};

}  // namespace phantom::simulation
