#include "components/simulated_drive/force_sensor.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace phantom::simulated_drive {

double ForceSensorOptions::lever_m() const { return axis.dot((touches_at_m - axis_at_m).cross(normal)); }

void SimulatedForceSensor::put(can::CanFrame& frame, const Eigen::Vector3d& values, double noise, double bias,
                               double count) {
  for (int axis = 0; axis < 3; ++axis) {
    const double counts = std::round((values[axis] + bias + noise * normal_(random_)) / count);
    overload_ = overload_ || !(std::abs(counts) <= 32767.0);
    const auto sent =
        static_cast<std::uint16_t>(static_cast<int>(std::fmin(std::fmax(counts, -32768.0), 32767.0)));
    frame.data[static_cast<std::size_t>(2 * axis)] = static_cast<std::uint8_t>(sent & 0xFF);
    frame.data[static_cast<std::size_t>(2 * axis + 1)] = static_cast<std::uint8_t>(sent >> 8);
  }
}

void SimulatedForceSensor::send(core::Nanoseconds now_ns) {
  const double turned_rad = motor_.joint_rad() - motor_.parameters().start_rad;
  const Eigen::Vector3d weight_N = Eigen::AngleAxisd(-turned_rad, options_.axis) * options_.weight_N;
  const Eigen::Vector3d wall_N = wall_force_N() * options_.normal;
  const double time_s = core::seconds(now_ns - start_ns_);
  can::CanFrame force{.id = options_.id, .length = 7}, torque{.id = options_.id + 1, .length = 6};
  overload_ = false;
  put(force, wall_N + weight_N, options_.noise_N, options_.offset_N + options_.drift_N_per_s * time_s,
      options_.count_N);
  put(torque, options_.touches_at_m.cross(wall_N) + options_.weight_at_m.cross(weight_N), options_.noise_Nm,
      options_.offset_Nm + options_.drift_Nm_per_s * time_s, options_.count_Nm);
  force.data[6] = overload_ ? 0x81 : 0x80;
  bus_->send(force);
  bus_->send(torque);
}

void SimulatedForceSensor::step(core::Nanoseconds now_ns) {
  const core::Nanoseconds period_ns = core::from_seconds(1.0 / options_.rate_Hz);
  if (start_ns_ < 0) start_ns_ = due_ns_ = now_ns;
  can::Received received;
  while (bus_->receive(received)) {  // a sensor listens to nobody; what came must not fill the queue
  }
  if (now_ns < due_ns_) return;
  due_ns_ = std::max(due_ns_ + period_ns, now_ns - period_ns);
  send(now_ns);
}

}  // namespace phantom::simulated_drive
