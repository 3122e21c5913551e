#pragma once

#include <memory>
#include <vector>

#include "common/can/arm_drives.hpp"
#include "common/simulation/master_plant.hpp"
#include "components/master_io/config.hpp"
#include "components/master_io/dds_adapter.hpp"

namespace phantom::master_io {

/// State of the master device at a tick.
struct DeviceSense {
  bool known = true;                                  ///< false: the encoders have not reported yet
  core::JointArray position{}, velocity{};            ///< as measured by the encoders
  core::JointArray hand_position{}, hand_velocity{};  ///< as felt by a simulated hand
  bool follows = true;                                ///< its motors follow their commands
  bool fault = false;                                 ///< its motors hold or coast until a reset
  can::DigitalInputs inputs;                          ///< of its drives, if one is to send them
  double longer_s = 0.0;  ///< by how much the loop through it is longer than configured
  /// Of the power of the last demand's torques, what reached the hand after the device's caps, 0…1.
  double rendered_share = 1.0;
  bool hand_waits = false;  ///< a simulated hand re-indexes: its task waits
};

/// Commands of a tick to the master device.
struct DeviceDemand {
  core::JointArray motor_Nm{};     ///< torque of its motors
  core::JointArray hand_Nm{};      ///< torque of a simulated hand
  bool power = false;              ///< its drives may have power
  bool reset = false;              ///< a reset that releases the stop was requested since the last tick
  bool late = false;               ///< the tick is late: commands must act at once
  bool clutch_out = false;         ///< a person holds the clutch out
  bool coupled = false;            ///< master and slave are coupled
  const SeenView* view = nullptr;  ///< that the operator looks at; null: none, or stale
  const core::JointArray* meet =
      nullptr;  ///< where the slave waits for the master to come; null: it does not
};

/// Interface of the device that the hand holds: simulated, with drives, or served by another process. sense()
/// and move() belong to the servo thread, allocate no memory and never wait.
class Device {
 public:
  virtual ~Device() = default;

  /// Returns its state at a tick at `now_ns` on the monotonic clock.
  virtual const DeviceSense& sense(core::Nanoseconds now_ns) noexcept = 0;
  /// Advances the device by `dt_s` under the demand.
  virtual void move(const DeviceDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept = 0;
  /// Ends the device after the servo thread has ended: the motors stop following earlier commands. It is the
  /// last call.
  virtual void end(core::Nanoseconds now_ns) noexcept = 0;
  /// Returns whether missed periods must be simulated one by one, as for a device whose time is the loop's.
  virtual bool makes_up_periods() const noexcept = 0;
  /// Returns the device's health. Only one thread may call it, and not the servo's.
  virtual core::ActuatorHealth health() = 0;
  /// Returns figures of a Cartesian device, valid once the servo thread has ended; null for any other.
  virtual const CartesianFigures* cartesian_figures() const noexcept { return nullptr; }
  /// Returns figures of a device that leads some of the arm's joints, likewise; null for any other.
  virtual const MappingFigures* mapping_figures() const noexcept { return nullptr; }
  /// Returns the wrench of the last tick for the process that serves the device; null: there is none. Servo
  /// thread only.
  virtual const messages::HapticDeviceWrench* wrench_to_send() const noexcept { return nullptr; }
};

class SimulatedDevice final : public Device {
 public:
  SimulatedDevice(const simulation::MasterPlantParameters& device, const core::JointArray& start_q)
      : plant_(device, start_q) {}
  SimulatedDevice(const Config& config, const core::JointArray& start_q)
      : SimulatedDevice(config.device, start_q) {}

  const DeviceSense& sense(core::Nanoseconds) noexcept override {
    sense_.position = plant_.position();
    sense_.velocity = plant_.velocity();
    sense_.hand_position = plant_.true_position();
    sense_.hand_velocity = plant_.true_velocity();
    return sense_;
  }
  void move(const DeviceDemand& demand, double dt_s, core::Nanoseconds) noexcept override {
    plant_.step(demand.hand_Nm, demand.motor_Nm, dt_s);
  }
  void end(core::Nanoseconds) noexcept override {}  // its time ends with the loop's
  bool makes_up_periods() const noexcept override { return true; }
  core::ActuatorHealth health() override { return {}; }

 private:
  simulation::MasterPlant plant_;
  DeviceSense sense_;
};

/// A device whose motors are drives on CAN in torque mode. Their encoders measure the master's joints; a
/// person moves it.
class CanDevice final : public Device {
 public:
  /// `config.can` must be set. `buses`: one open bus per address.
  CanDevice(const Config& config, std::vector<std::unique_ptr<can::CanBus>> buses)
      : drives_(config.can.value().group, config.mapping ? config.mapping->tolerance : config.align_tolerance,
                std::move(buses)) {}

  const DeviceSense& sense(core::Nanoseconds) noexcept override {
    const can::ArmDrivesSense& drives = drives_.sense();
    sense_.known = drives.known;
    sense_.position = sense_.hand_position = drives.position;
    sense_.velocity = sense_.hand_velocity = drives.velocity;
    sense_.follows = drives.follows;
    sense_.fault = drives.fault;
    sense_.inputs = drives.inputs;
    return sense_;
  }
  void move(const DeviceDemand& demand, double, core::Nanoseconds now_ns) noexcept override {
    drives_.step(
        {.enable = demand.power, .reset = demand.reset, .hasten = demand.late, .torque = demand.motor_Nm},
        now_ns);
  }
  void end(core::Nanoseconds now_ns) noexcept override { drives_.end(now_ns); }
  bool makes_up_periods() const noexcept override { return false; }
  core::ActuatorHealth health() override { return drives_.health(); }

 private:
  can::ArmDrives drives_;
  DeviceSense sense_;
};

}  // namespace phantom::master_io
