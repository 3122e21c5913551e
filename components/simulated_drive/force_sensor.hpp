#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <random>

#include "common/can/can_bus.hpp"
#include "components/simulated_drive/motor.hpp"

namespace phantom::simulated_drive {

/// Parameters of a force/torque sensor at the wrist of the arm that the drives move. Vectors are in the
/// sensor's frame S, in which the joint of `node`, whose wall the tool meets, stands still.
struct ForceSensorOptions {
  int node = 1;
  double rate_Hz = 500.0;
  std::uint32_t id = 416;                   ///< of the force's frame; the torque's is the next one
  double count_N = 0.02, count_Nm = 0.001;  ///< resolution of the 16-bit numbers
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY(), axis_at_m = Eigen::Vector3d::Zero();  ///< of the joint
  Eigen::Vector3d touches_at_m = Eigen::Vector3d::Zero();  ///< where the tool meets the wall
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();       ///< of the wall, along which its force acts
  Eigen::Vector3d weight_N = Eigen::Vector3d::Zero();      ///< of what it carries, where the joint starts
  Eigen::Vector3d weight_at_m = Eigen::Vector3d::Zero();
  double noise_N = 0.0, noise_Nm = 0.0;    ///< standard deviation along each axis
  double offset_N = 0.0, offset_Nm = 0.0;  ///< of each axis at the start
  double drift_N_per_s = 0.0, drift_Nm_per_s = 0.0;

  /// Torque about the joint's axis of a unit force of the wall, in m.
  double lever_m() const;
};

/// Simulates that sensor as seen from the bus: two frames in each period, little-endian 16-bit numbers, force
/// along x, y, z with a status byte (bit 7: it measures; bit 0: a number is beyond its range), then torque
/// about x, y, z. The force is the one that exerts the wall's torque on the joint, at the place where the
/// tool touches; the weight turns with the joint. It shares no encoding with slave_io's side. Not real-time
/// safe.
class SimulatedForceSensor {
 public:
  /// `motor`: of the drive `options.node`; must outlive the sensor.
  SimulatedForceSensor(const ForceSensorOptions& options, const Motor& motor,
                       std::unique_ptr<can::CanBus> bus)
      : options_(options), motor_(motor), bus_(std::move(bus)) {}

  /// Sends what is due at `now_ns`. Call it about every millisecond.
  void step(core::Nanoseconds now_ns);
  /// Returns the wall's force on the tool now, in N.
  double wall_force_N() const { return motor_.wall_torque_Nm() / options_.lever_m(); }

 private:
  void send(core::Nanoseconds now_ns);
  void put(can::CanFrame& frame, const Eigen::Vector3d& values, double noise, double bias, double count);

  ForceSensorOptions options_;
  const Motor& motor_;
  std::unique_ptr<can::CanBus> bus_;
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
  core::Nanoseconds start_ns_ = -1, due_ns_ = 0;
  bool overload_ = false;
};

}  // namespace phantom::simulated_drive
