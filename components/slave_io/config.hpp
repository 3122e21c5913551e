#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/configuration/drives_config.hpp"
#include "common/runtime/servo/enabling_switch.hpp"
#include "common/runtime/servo/periodic_loop.hpp"
#include "common/simulation/gripper_plant.hpp"
#include "common/simulation/slave_plant.hpp"
#include "common/teleop/coupling/joint_servo.hpp"
#include "common/teleop/coupling/link_state.hpp"
#include "common/teleop/gripper/gripper.hpp"
#include "common/teleop/guards/contact_force_limit.hpp"
#include "common/teleop/guards/momentum_observer.hpp"
#include "components/slave_io/force_bounds.hpp"
#include "components/slave_io/wrist_config.hpp"

namespace phantom::slave_io {

/// Parameters of the contact points on the arm's skin.
struct ContactConfig {
  double point_pitch_m = 0.02;
  int max_points = 1000;
  double clearance_range_m = 0.13;
};

/// The gripper at the end of the arm.
struct GripperConfig {
  teleop::GripperLimits limits;
  simulation::GripperPlantParameters plant;    ///< of driver sim
  double pad_friction = 0.6;                   ///< of driver sim
  std::optional<runtime::DrivesConfig> drive;  ///< always set for driver can: one axis on one bus
};

enum class Driver { kSimulated, kCan };

/// Parameters of slave_io.yaml for one arm. Arrays have one value per joint.
struct Config {
  Driver driver = Driver::kSimulated;
  double period_s = 0.001;
  runtime::LoopScheduling scheduling;
  bool measure_bare_loop = false;
  teleop::LinkTiming link;
  std::array<teleop::JointServoGains, core::kMaxJoints> gains{};
  std::array<teleop::HeldTorque, core::kMaxJoints> held{};  ///< of joints whose loop is closed here, on CAN
  teleop::LoopGuardParameters loop;
  teleop::ContactForceLimitParameters contact_limit;
  std::vector<ObjectForceBound> object_bounds;  ///< of objects that do not bear any force
  LinkBoxes link_boxes;  ///< by which it is known which of them the arm may touch; empty: any
  bool gravity_feed_forward = false;
  double max_payload_kg = 10.0;  ///< what the arm carries counts for nothing beyond it
  bool force_sensor = false;     ///< the arm measures the external forces on it (F_e, laws c and e)
  std::optional<teleop::MomentumObserverParameters> force_observer;  ///< on CAN for that, or `wrist`
  double unexplained_energy_share = 0.25;  ///< teleop::FeedbackObserverParameters::energy_share
  std::optional<WristSensorConfig> wrist;  ///< F_e is its, if force_sensor and this are set
  core::JointArray align_tolerance{}, align_speed{}, align_range{};  ///< rad, rad/s, rad; or m, m/s, m
  simulation::SlavePlantParameters plant;
  ContactConfig contact;
  std::optional<runtime::DrivesConfig> can;                      ///< always set for driver can
  std::optional<runtime::EnablingSwitchConfig> enabling_switch;  ///< without: this side has none
  std::optional<GripperConfig> gripper;
};

/// Returns by how much the momentum observer of drives on CAN lags, in s: its time constant, and the
/// measurements of the drives, which are a cycle old at least.
double force_lag_s(const Config& config);

extern const char* const kParameters;  ///< the shipped slave_io.yaml as table of the parameters

/// Reads and checks the file for `arm`, with its inertia at `home`. Throws ConfigError naming file, line,
/// key, value and what is allowed.
Config load_config(const std::filesystem::path& file, const robot::SerialArm& arm,
                   const core::JointArray& home);

}  // namespace phantom::slave_io
