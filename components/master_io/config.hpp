#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/configuration/drives_config.hpp"
#include "common/runtime/servo/enabling_switch.hpp"
#include "common/runtime/servo/periodic_loop.hpp"
#include "common/simulation/master_plant.hpp"
#include "common/simulation/operator_model.hpp"
#include "common/simulation/reach_script.hpp"
#include "common/teleop/coupling/link_state.hpp"
#include "common/teleop/rendering/drag_masking.hpp"
#include "common/teleop/rendering/feedback_rendering.hpp"
#include "common/teleop/rendering/percept_rendering.hpp"
#include "common/teleop/rendering/percept_set.hpp"
#include "components/master_io/config_cartesian.hpp"
#include "components/master_io/config_mapping.hpp"
#include "components/master_io/devices/desk.hpp"

namespace phantom::master_io {

/// Source of the contact state that the contact gain uses.
enum class ContactSource { kSlave, kPhantom, kEither };

/// Name and target object of a reach, for the report.
struct ReachLabel {
  std::string name, object;
};

/// What moves the master.
enum class Driver {
  kSim,        ///< a simulated operator with a simulated device
  kDesk,       ///< a person with a stick or keys on a simulated device
  kCan,        ///< a person with a master arm whose drives are on CAN
  kCartesian,  ///< a device of six axes in its own frame: simulated, or served by another process
};

/// Returns the driver's name in the configuration.
const char* name_of(Driver driver) noexcept;

/// Parameters of master_io.yaml for one arm. Arrays have one value per joint.
struct Config {
  double period_s = 0.001;
  runtime::LoopScheduling scheduling;
  bool measure_bare_loop = true;
  Driver driver = Driver::kSim;
  DeskConfig desk;
  std::optional<runtime::DrivesConfig> can;                      ///< always set for driver can
  std::optional<runtime::EnablingSwitchConfig> enabling_switch;  ///< without: this side has none
  std::optional<CartesianConfig> cartesian;                      ///< always set for driver cartesian
  /// A master with fewer joints than the arm; without: it has the arm's. `device` is then that master as the
  /// arm's joints see it (reflect()), and `can` has the drives of its own joints.
  std::optional<MappingConfig> mapping;
  teleop::LinkTiming link;
  teleop::LoopGuardParameters loop;
  core::JointArray align_tolerance{};  ///< rad or m
  simulation::MasterPlantParameters device;
  int command_delay_samples = 1;  ///< from computing a torque to its effect
  teleop::PerceptParameters percept;
  teleop::MaskingParameters masking;
  core::JointArray percept_gain{};  ///< initial G, by joint
  double reaction_gain = 1.0;       ///< of what soft bodies answer
  double percept_staleness_s = 0.06;
  int percepts = teleop::kAllPercepts;  ///< the choice of percepts at the start, by its number
  teleop::FeedbackParameters feedback;
  std::vector<teleop::FeedbackLoop> feedback_loops;  ///< by joint; the feedback must be stable in them
  core::JointArray torque_rate_Nm_per_s{};           ///< greatest rate of the motors' torque, by joint
  ContactSource contact_source = ContactSource::kEither;
  simulation::OperatorParameters hand;
  std::string operator_model;  ///< name of the simulated operator; empty: a person moves the master
  simulation::ReachScriptParameters script;
  std::vector<ReachLabel> labels;  ///< per reach of the script
  core::JointArray hand_start{};   ///< where the hand of driver cartesian begins
};

/// Returns whether a person pushes the master by sticks, keys or a space mouse.
inline bool uses_desk(const Config& config) noexcept {
  return config.driver == Driver::kDesk ||
         (config.driver == Driver::kCartesian && is_pushed(config.cartesian->input));
}
/// Returns whether a person holds a device that is not simulated here.
inline bool is_held_by_person(const Config& config) noexcept {
  return config.driver == Driver::kCan ||
         (config.driver == Driver::kCartesian && config.cartesian->input == CartesianInput::kHapticDevice);
}
/// Returns whether a script moves a simulated operator.
inline bool is_scripted(const Config& config) noexcept {
  return !is_held_by_person(config) && !uses_desk(config);
}

/// Choices on the command line that replace the file's; empty: the file's.
struct Choices {
  std::string operator_model, law, driver, desk_device;
};

extern const char* const kParameters;  ///< the shipped master_io.yaml as table of the parameters

/// Reads and checks the file for `arm`, with the slave's inertia at `home`, and the reaches (by default
/// reaches.yaml beside `cell_file`). Throws ConfigError naming file, line, key, value and what is allowed.
Config load_config(const std::filesystem::path& file, const std::filesystem::path& cell_file,
                   const robot::SerialArm& arm, const core::JointArray& home, const Choices& choices);

}  // namespace phantom::master_io
