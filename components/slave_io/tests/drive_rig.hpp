#pragma once

// The drives of the hot cell's arm on CAN buses in this process, as deploy/can/hot_cell_slave_io.yaml has
// them.

#include <memory>
#include <vector>

#include "common/simulation/local_bus.hpp"
#include "components/simulated_drive/simulated_drive.hpp"
#include "components/slave_io/tests/fixture.hpp"

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

/// Motor, gear and joint as the configuration has them: joint angle or way at the start is `home`.
inline simulated_drive::DriveOptions drive_like(const can::AxisConfig& axis, double home, double inertia) {
  const double rad_per_unit = 2.0 * 3.14159265358979323846 / axis.units.travel_per_turn;
  simulated_drive::DriveOptions o;
  o.node = axis.node;
  o.motor.counts_per_turn = axis.units.counts_per_turn;
  o.motor.gear_ratio = axis.units.gear_ratio;
  o.motor.rated_torque_Nm = axis.units.rated_motor_torque_Nm();
  o.motor.start_rad = home * rad_per_unit;
  o.motor.joint.inertia = inertia / (rad_per_unit * rad_per_unit);
  o.motor.joint.viscous = 2.0 * o.motor.joint.inertia;  // about what the shipped drives have
  o.motor.joint.coulomb = 0.75 * o.motor.joint.inertia;
  o.motor.joint.lower = -100.0;
  o.motor.joint.upper = 100.0;
  return o;
}

/// Buses and drives; time passes on them as the test says.
class DriveRig {
 public:
  /// `config.can` must be there; it is kept.
  DriveRig(Config with, const core::JointArray& start) : config(std::move(with)) {
    for (std::size_t b = 0; b < config.can->addresses.size(); ++b)
      buses.push_back(std::make_unique<simulation::LocalBus>(simulation::BusModelOptions{.bit_rate = 1e6}));
    const auto& axes = config.can->group.axes;
    for (std::size_t j = 0; j < axes.size(); ++j) {
      drives.push_back(std::make_unique<simulated_drive::SimulatedDrive>(
          drive_like(axes[j], start[j], config.plant.joints[j].inertia),
          buses[axes[j].bus]->connect(axes[j].name)));
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

 private:
  double unit(std::size_t j) const {
    return config.can->group.axes[j].units.travel_per_turn / (2.0 * 3.14159265358979323846);
  }
};

}  // namespace phantom::slave_io
