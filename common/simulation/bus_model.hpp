#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "common/can/frame.hpp"

namespace phantom::simulation {

/// Fault injection for frames whose identifier equals `id` in the bits of `mask` (mask 0: all frames).
struct FaultRule {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
  double drop = 0.0;                ///< probability that nobody receives the frame
  double duplicate = 0.0;           ///< probability that the frame is received twice
  core::Nanoseconds delay_ns = 0;   ///< delay of the reception
  core::Nanoseconds jitter_ns = 0;  ///< greatest random addition to it; frames may overtake each other
};

struct BusModelOptions {
  double bit_rate = 0.0;           ///< bit/s; a frame takes its worst-case time; 0: it takes no time
  std::size_t queue_frames = 128;  ///< capacity of each node's transmit queue
  std::uint64_t seed = 1;          ///< seed of the random faults
};

/// Models a CAN bus in time: nodes with transmit queues, arbitration by identifier, acknowledgement, bus-off,
/// and faults. It is deterministic for a given seed and uses no clock, socket or thread. Only attach(),
/// detach() and set_faults() use the heap, unless more than 16384 frames are in transit.
class BusModel {
 public:
  using NodeId = std::size_t;
  using Deliver = std::function<void(NodeId to, const can::Received&)>;

  explicit BusModel(const BusModelOptions& options);

  NodeId attach();
  /// Removes the node and drops its queued frames.
  void detach(NodeId node);
  /// Unplugs the node or plugs it in. An unplugged node neither receives nor sends, and it is not notified.
  void set_plugged(NodeId node, bool plugged);
  void set_faults(std::vector<FaultRule> rules);
  /// Puts the node's controller into bus-off: it drops its queued frames and stays off until restart().
  void set_bus_off(NodeId node, core::Nanoseconds now_ns);
  /// Brings the node back on the bus after 128 × 11 bit times.
  void restart(NodeId node, core::Nanoseconds now_ns);

  /// Queues a frame. Returns false if the queue is full or the node is not on the bus. Times never decrease.
  bool submit(NodeId node, const can::CanFrame& frame, core::Nanoseconds now_ns);
  /// Runs the bus until now_ns and delivers the frames received by then, in order of time.
  void advance(core::Nanoseconds now_ns, const Deliver& deliver);
  /// Returns the time of the next event for advance(); the greatest time if no event is known.
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
    core::Nanoseconds back_ns = -1;  // when the restart completes; < 0: none requested
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
  void push_event(NodeId to, std::uint16_t errors, can::BusState state, core::Nanoseconds time_ns);
  void finish_restarts(core::Nanoseconds now_ns);

  BusModelOptions options_;
  std::vector<Node> nodes_;
  std::vector<FaultRule> rules_;
  std::vector<Delivery> deliveries_;  // a heap by time
  core::Nanoseconds free_ns_ = 0;     // the bus is idle from this time on
  std::uint64_t order_ = 0, frames_ = 0;
  std::mt19937_64 random_;
};

}  // namespace phantom::simulation
