#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/runtime/drives_config.hpp"
#include "common/runtime/periodic_loop.hpp"
#include "common/simulation/master_plant.hpp"
#include "common/simulation/operator_model.hpp"
#include "common/simulation/reach_script.hpp"
#include "common/teleop/feedback_rendering.hpp"
#include "common/teleop/link_state.hpp"
#include "common/teleop/percept_rendering.hpp"
#include "components/master_io/desk.hpp"

namespace phantom::master_io {

/// Who says that the arm is in contact, for the contact gain.
enum class ContactSource { kSlave, kPhantom, kEither };

/// Name and aim of a reach, for the report.
struct ReachLabel {
  std::string name, object;
};

/// Who moves the master.
enum class Driver {
  kSim,   ///< a simulated operator on a simulated device
  kDesk,  ///< a person with a stick or keys on a simulated device
  kCan,   ///< a person who moves a master arm with drives on CAN
};

/// master_io.yaml, resolved for one arm: everything per joint stands in arrays by joint.
struct Config {
  double period_s = 0.001;
  runtime::LoopScheduling scheduling;
  bool measure_bare_loop = true;
  Driver driver = Driver::kSim;
  DeskConfig desk;
  std::optional<runtime::DrivesConfig> can;  ///< always there for driver can
  teleop::LinkTiming link;
  core::JointArray align_tolerance{};  ///< rad or m
  simulation::MasterPlantParameters device;
  int command_delay_samples = 1;  ///< from computing a torque to its acting
  teleop::PerceptParameters percept;
  core::JointArray percept_gain{};  ///< G at the start, by joint
  double percept_staleness_s = 0.06;
  teleop::FeedbackParameters feedback;
  std::vector<teleop::FeedbackLoop> feedback_loops;  ///< by joint, what the feedback must be stable with
  core::JointArray torque_rate_Nm_per_s{};           ///< at which the motors' torque may change, by joint
  ContactSource contact_source = ContactSource::kEither;
  simulation::OperatorParameters hand;
  std::string operator_model;  ///< its name; empty: a person moves the master
  simulation::ReachScriptParameters script;
  std::vector<ReachLabel> labels;  ///< per reach of the script
};

/// What the command line may choose instead of the file; empty: the file's.
struct Choices {
  std::string operator_model, law, driver, desk_device;
};

extern const char* const kParameters;  ///< the shipped master_io.yaml: their table

/// Reads and checks the file for `arm`, with the slave's inertia taken at `home`, and the reaches (by default
/// reaches.yaml beside `cell_file`). Throws ConfigError naming file, line, key, value and what is allowed.
Config load_config(const std::filesystem::path& file, const std::filesystem::path& cell_file,
                   const robot::SerialArm& arm, const core::JointArray& home, const Choices& choices);

}  // namespace phantom::master_io
