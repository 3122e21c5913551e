#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/core/joints.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/runtime/drives_config.hpp"
#include "common/runtime/periodic_loop.hpp"
#include "common/simulation/slave_plant.hpp"
#include "common/teleop/joint_servo.hpp"
#include "common/teleop/link_state.hpp"

namespace phantom::slave_io {

/// How the arm's skin becomes contact points, and how finely the bodies' distances are known.
struct ContactConfig {
  double point_pitch_m = 0.02;
  int max_points = 1000;
  double touch_voxel_m = 0.008;     ///< of the field close to the surfaces
  double clearance_voxel_m = 0.02;  ///< of the field farther out
  double clearance_range_m = 0.13;
};

enum class Driver { kSimulated, kCan };

/// slave_io.yaml, resolved for one arm: everything per joint stands in arrays by joint.
struct Config {
  Driver driver = Driver::kSimulated;
  double period_s = 0.001;
  runtime::LoopScheduling scheduling;
  bool measure_bare_loop = false;
  teleop::LinkTiming link;
  std::array<teleop::JointServoGains, core::kMaxJoints> gains{};
  bool gravity_feed_forward = false;
  bool force_sensor = false;  ///< the arm measures the forces on it (F_e, laws c and e)
  core::JointArray align_tolerance{}, align_speed{}, align_range{};  ///< rad, rad/s, rad or m, m/s, m
  simulation::SlavePlantParameters plant;
  ContactConfig contact;
  std::optional<runtime::DrivesConfig> can;  ///< always there for driver can
};

extern const char* const kParameters;  ///< the shipped slave_io.yaml: their table

/// Reads and checks the file for `arm`, whose inertia is taken at `home`. Throws ConfigError naming file,
/// line, key, value and what is allowed.
Config load_config(const std::filesystem::path& file, const robot::SerialArm& arm,
                   const core::JointArray& home);

}  // namespace phantom::slave_io
