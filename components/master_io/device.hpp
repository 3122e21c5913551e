#pragma once

#include <memory>
#include <vector>

#include "common/can/arm_drives.hpp"
#include "common/simulation/master_plant.hpp"
#include "components/master_io/config.hpp"

namespace phantom::master_io {

/// What a tick is told of the master device.
struct DeviceSense {
  bool known = true;                                  ///< false: the encoders have not spoken yet
  core::JointArray position{}, velocity{};            ///< as the encoders say
  core::JointArray hand_position{}, hand_velocity{};  ///< as a simulated hand feels them
  bool follows = true;                                ///< its motors do what they are told
  bool fault = false;                                 ///< they hold or coast until a reset
};

/// What a tick asks of the master device.
struct DeviceDemand {
  core::JointArray motor_Nm{};  ///< of its motors
  core::JointArray hand_Nm{};   ///< of a simulated hand
  bool power = false;           ///< its drives may have power
  bool reset = false;           ///< a reset that releases the stop was asked for since the last tick
};

/// What the hand holds: a simulated device, or one with drives. sense() and move() belong to the servo
/// thread, allocate nothing and never wait.
class Device {
 public:
  virtual ~Device() = default;

  virtual const DeviceSense& sense() noexcept = 0;
  /// Lets `dt_s` pass under the demand.
  virtual void move(const DeviceDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept = 0;
  /// The last call, once the servo thread has ended: the motors go on with nothing that they were told
  /// before.
  virtual void end(core::Nanoseconds now_ns) noexcept = 0;
  /// Whether periods that the loop missed must be lived through one by one, for a device whose time is the
  /// loop's.
  virtual bool makes_up_periods() const noexcept = 0;
  /// One reader thread, any but the servo's.
  virtual core::ActuatorHealth health() = 0;
};

class SimulatedDevice final : public Device {
 public:
  SimulatedDevice(const Config& config, const core::JointArray& start_q) : plant_(config.device, start_q) {}

  const DeviceSense& sense() noexcept override {
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

/// A device whose motors are drives on CAN in torque mode: their encoders are the master's joints, a person
/// moves it.
class CanDevice final : public Device {
 public:
  /// `config.can` must be there. One open bus per address.
  CanDevice(const Config& config, std::vector<std::unique_ptr<can::CanBus>> buses)
      : drives_(config.can.value().group, config.align_tolerance, std::move(buses)) {}

  const DeviceSense& sense() noexcept override {
    const can::ArmDrivesSense& drives = drives_.sense();
    sense_.known = drives.known;
    sense_.position = sense_.hand_position = drives.position;
    sense_.velocity = sense_.hand_velocity = drives.velocity;
    sense_.follows = drives.follows;
    sense_.fault = drives.fault;
    return sense_;
  }
  void move(const DeviceDemand& demand, double, core::Nanoseconds now_ns) noexcept override {
    drives_.step({.enable = demand.power, .reset = demand.reset, .torque = demand.motor_Nm}, now_ns);
  }
  void end(core::Nanoseconds now_ns) noexcept override { drives_.end(now_ns); }
  bool makes_up_periods() const noexcept override { return false; }
  core::ActuatorHealth health() override { return drives_.health(); }

 private:
  can::ArmDrives drives_;
  DeviceSense sense_;
};

}  // namespace phantom::master_io
