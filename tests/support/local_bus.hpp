#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/can/can_bus.hpp"
#include "common/simulation/bus_model.hpp"

namespace phantom::simulation {

/// A CAN bus within one thread on a clock that its owner sets, for simulations and tests that are exactly
/// repeatable.
///
///     LocalBus bus({.bit_rate = 1e6});
///     auto master = bus.connect("master"), drive = bus.connect("drive");
///     master->send(frame);
///     bus.advance_to(bus.now_ns() + 1'000'000);
///     drive->receive(received);
class LocalBus {
 public:
  explicit LocalBus(const BusModelOptions& options = {});
  ~LocalBus();

  /// Connects a node, which must not outlive the bus.
  std::unique_ptr<can::CanBus> connect(const std::string& name);
  /// Runs the bus until `now_ns`, which never decreases.
  void advance_to(core::Nanoseconds now_ns);
  core::Nanoseconds now_ns() const noexcept { return now_ns_; }

  void set_faults(std::vector<FaultRule> rules) { model_.set_faults(std::move(rules)); }
  /// Puts the controller of `node`, a node of this bus, into bus-off.
  void set_bus_off(const can::CanBus& node);
  void set_plugged(const can::CanBus& node, bool plugged);
  std::uint64_t frames_on_bus() const noexcept { return model_.frames_on_bus(); }

 private:
  class Node;
  core::Nanoseconds now_ns_ = 0;
  BusModel model_;
  std::vector<Node*> nodes_;  // indexed by BusModel::NodeId
};

}  // namespace phantom::simulation
