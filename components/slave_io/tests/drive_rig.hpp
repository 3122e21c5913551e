#pragma once

// The drives of the hot cell's arm on CAN buses in this process, as deploy/can/hot_cell_slave_io.yaml has
// them.

#include <functional>
#include <memory>
#include <vector>

#include "components/simulated_drive/tests/drive_like.hpp"
#include "components/slave_io/tests/fixture.hpp"
#include "tests/support/local_bus.hpp"

namespace phantom::slave_io {

/// The shipped configuration with the times of real drives.
inline Config can_config(can::DriveMode mode = can::DriveMode::kTorque,
                         can::FaultReaction reaction = can::FaultReaction::kHold) {
  Config config = load_config(kCanFile, shipped_arm().arm, shipped_arm().home);
  can::DriveGroupConfig& group = config.can.value().group;
  for (can::AxisConfig& axis : group.axes) axis.mode = mode;
  group.reaction = reaction;
  group.timing.heartbeat_s = 0.02;
  group.timing.heartbeat_timeout_s = 0.05;
  group.timing.most_missed = 3;
  group.timing.boot_timeout_s = 0.2;
  return config;
}

/// A drive as simulated_drive::drive_like(), with about the friction that the shipped drives have.
inline simulated_drive::DriveOptions drive_with_friction(const can::AxisConfig& axis, double home,
                                                         double inertia) {
  simulated_drive::DriveOptions o = simulated_drive::drive_like(axis, home, inertia);
  o.motor.joint.viscous = 2.0 * o.motor.joint.inertia;
  o.motor.joint.coulomb = 0.75 * o.motor.joint.inertia;
  o.incremental = axis.homing.has_value();
  return o;
}

/// Buses and drives; time passes on them as the test says.
class DriveRig {
 public:
  /// Changes the drive of a joint before it is made.
  using Change = std::function<void(std::size_t joint, simulated_drive::DriveOptions&)>;

  /// `config.can` must be there; it is kept.
  DriveRig(Config with, const core::JointArray& start, const Change& change = {}) : config(std::move(with)) {
    for (std::size_t b = 0; b < config.can->addresses.size(); ++b)
      buses.push_back(std::make_unique<simulation::LocalBus>(simulation::BusModelOptions{.bit_rate = 1e6}));
    const auto& axes = config.can->group.axes;
    for (std::size_t j = 0; j < axes.size(); ++j) {
      auto options = drive_with_friction(axes[j], start[j], config.plant.joints[j].inertia);
      if (change) change(j, options);
      drives.push_back(std::make_unique<simulated_drive::SimulatedDrive>(
          options, buses[axes[j].bus]->connect(axes[j].name)));
    }
    frozen.resize(drives.size());
  }
  /// One port on each bus for whoever moves the arm.
  std::vector<std::unique_ptr<can::CanBus>> connect() {
    std::vector<std::unique_ptr<can::CanBus>> made;
    ports.clear();
    for (auto& bus : buses) {
      made.push_back(bus->connect("slave_io"));
      ports.push_back(made.back().get());
    }
    return made;
  }
  /// `period_ns` pass up to `now_ns`; the drives run four times in it.
  void pass(core::Nanoseconds now_ns, core::Nanoseconds period_ns) {
    for (int part = 1; part <= 4; ++part) {
      const core::Nanoseconds then_ns = now_ns - period_ns + period_ns * part / 4;
      for (auto& bus : buses) bus->advance_to(then_ns);
      for (std::size_t j = 0; j < drives.size(); ++j) {
        if (!frozen[j]) drives[j]->step(then_ns);
      }
      if (on_part) on_part(then_ns);
    }
  }
  /// A further drive with joint `j`'s node id on its bus.
  void add_twin(std::size_t j) {
    const can::AxisConfig& axis = config.can->group.axes[j];
    drives.push_back(std::make_unique<simulated_drive::SimulatedDrive>(
        simulated_drive::DriveOptions{.node = axis.node}, buses[axis.bus]->connect("twin")));
    frozen.push_back(false);
  }
  void remove_twin() {
    drives.pop_back();
    frozen.pop_back();
  }
  double position(std::size_t j) const { return drives[j]->motor().joint_rad() * unit(j); }  ///< rad or m
  double velocity(std::size_t j) const { return drives[j]->motor().joint_rad_s() * unit(j); }

  Config config;
  std::vector<std::unique_ptr<simulation::LocalBus>> buses;
  std::vector<can::CanBus*> ports;
  std::vector<std::unique_ptr<simulated_drive::SimulatedDrive>> drives;
  std::vector<bool> frozen;
  std::function<void(core::Nanoseconds)> on_part;  ///< steps what else is on the buses

 private:
  double unit(std::size_t j) const { return 1.0 / simulated_drive::rad_per_unit(config.can->group.axes[j]); }
};

}  // namespace phantom::slave_io
