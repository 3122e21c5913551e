#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/can/drive_group.hpp"
#include "components/simulated_drive/simulated_drive.hpp"
#include "tests/support/local_bus.hpp"

namespace phantom::test {

inline constexpr double kGear = 5.0, kCounts = 65536.0, kCountsPerRad = kCounts * kGear / 6.283185307179586;

inline can::AxisConfig axis(int node, can::DriveMode mode) {
  can::AxisConfig axis;
  axis.name = std::string("j").append(std::to_string(node));
  axis.node = node;
  axis.mode = mode;
  axis.units = {.counts_per_turn = kCounts,
                .gear_ratio = kGear,
                .torque_constant_Nm_per_A = 0.25,
                .rated_current_A = 4};
  axis.lower = -3.0;
  axis.upper = 3.0;
  axis.max_speed = 1.0;
  axis.max_torque = 5.0;
  return axis;
}

inline can::DriveGroupConfig group_config(can::DriveMode mode, int drives,
                                          can::FaultReaction reaction = can::FaultReaction::kHold) {
  can::DriveGroupConfig config;
  for (int node = 1; node <= drives; ++node) config.axes.push_back(axis(node, mode));
  config.reaction = reaction;
  config.timing.boot_timeout_s = 0.2;
  config.timing.sdo_timeout_s = 0.03;
  config.timing.state_timeout_s = 0.5;
  return config;
}

/// The master's port as a busy host has it: what comes is held up for a while, then there all at once, with
/// the time at which it was let through.
class HeldPort final : public can::CanBus {
 public:
  HeldPort(std::unique_ptr<can::CanBus> inner, const simulation::LocalBus& bus)
      : inner_(std::move(inner)), bus_(bus) {}
  can::SendResult send(const can::CanFrame& frame) noexcept override { return inner_->send(frame); }
  bool receive(can::Received& received) noexcept override {
    if (held || !inner_->receive(received)) return false;
    received.time_ns = bus_.now_ns();
    return true;
  }
  bool wait(core::Nanoseconds timeout_ns) noexcept override { return inner_->wait(timeout_ns); }
  core::Status set_filters(std::span<const can::CanFilter> filters) override {
    return inner_->set_filters(filters);
  }
  core::Status restart() override { return inner_->restart(); }
  can::BusState state() const noexcept override { return inner_->state(); }
  const can::BusCounters& counters() const noexcept override { return inner_->counters(); }
  const std::string& address() const noexcept override { return inner_->address(); }

  bool held = false;

 private:
  std::unique_ptr<can::CanBus> inner_;
  const simulation::LocalBus& bus_;
};

/// A master and its drives on one bus in one thread and in virtual time: repeats exactly.
class Rig {
 public:
  explicit Rig(const can::DriveGroupConfig& config, const simulated_drive::DriveOptions& like = {})
      : bus({.bit_rate = 1e6}), period_ns_(core::from_seconds(config.timing.period_s)) {
    std::vector<std::unique_ptr<can::CanBus>> ports;
    auto inner = bus.connect("master");
    port = inner.get();
    auto outer = std::make_unique<HeldPort>(std::move(inner), bus);
    to_master = outer.get();
    ports.push_back(std::move(outer));
    group = std::make_unique<can::DriveGroup>(config, std::move(ports));
    for (const can::AxisConfig& axis : config.axes) {
      auto options = like;
      options.node = axis.node;
      add(options);
    }
  }

  simulated_drive::SimulatedDrive& add(const simulated_drive::DriveOptions& options) {
    drives.push_back(std::make_unique<simulated_drive::SimulatedDrive>(
        options, bus.connect(std::to_string(options.node))));
    frozen.push_back(false);
    return *drives.back();
  }

  /// One period of the master; the drives run four times in it.
  void cycle() {
    if (on_cycle) on_cycle();
    if (!master_frozen) group->step(command, bus.now_ns());
    for (int part = 0; part < 4; ++part) {
      bus.advance_to(bus.now_ns() + period_ns_ / 4);
      for (std::size_t i = 0; i < drives.size(); ++i) {
        if (!frozen[i] && drives[i]) drives[i]->step(bus.now_ns());
      }
    }
  }
  void run(double seconds) {
    for (const auto until = bus.now_ns() + core::from_seconds(seconds); bus.now_ns() < until;) cycle();
  }
  /// Runs until `done` or for `most_s`; returns the milliseconds it took, or −1.
  double run_until(const std::function<bool()>& done, double most_s) {
    const auto start_ns = bus.now_ns();
    while (!done()) {
      if (core::seconds(bus.now_ns() - start_ns) >= most_s) return -1.0;
      cycle();
    }
    return core::seconds(bus.now_ns() - start_ns) * 1e3;
  }
  can::DriveGroupState state() const { return group->report().state; }
  const can::DriveReport& drive(std::size_t i) const { return group->report().drives[i]; }
  bool bring_up() {
    command.enable = true;
    return run_until([this] { return state() == can::DriveGroupState::kEnabled; }, 5.0) >= 0.0;
  }
  void reset() {
    command.reset = true;
    cycle();
    command.reset = false;
  }

  simulation::LocalBus bus;
  can::CanBus* port = nullptr;    ///< the master's, as the bus knows it
  HeldPort* to_master = nullptr;  ///< the same, as the master reads it
  std::unique_ptr<can::DriveGroup> group;
  std::vector<std::unique_ptr<simulated_drive::SimulatedDrive>> drives;
  std::vector<bool> frozen;
  bool master_frozen = false;
  can::DriveCommand command;
  std::function<void()> on_cycle;

 private:
  core::Nanoseconds period_ns_;
};

}  // namespace phantom::test
