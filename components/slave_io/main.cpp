#include <iostream>
#include <optional>

#include "common/dds/endpoints/participant.hpp"
#include "common/messages/operator_command_line.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/configuration/drives_check.hpp"
#include "common/runtime/configuration/operator_options.hpp"
#include "common/runtime/process/process.hpp"
#include "common/runtime/process/stop_place.hpp"
#include "common/runtime/servo/switch_input.hpp"
#include "common/simulation/contact_points.hpp"
#include "components/slave_io/config.hpp"
#include "components/slave_io/model.hpp"
#include "components/slave_io/session.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  teleop::OperatorRequest request;
  runtime::Command command;
  runtime::ProcessDescription description;
  description.name = "slave_io";
  description.summary =
      "The arm in the cell: position loops at 1 kHz follow the master, "
      "within the arm's limits whatever arrives. Its drives are on CAN (CiA 402), "
      "or simulated with friction, weight and contact with the objects where they really stand.";
  description.details =
      "Topics in: master_state, operator_command, wrist_wrench. Topics out: slave_state (1 kHz), gripper_state, component_status.\n"
      "Example: slave_io --deployment deploy/topologies/single_host.yaml\n"
      "Example while it runs: slave_io command stop; slave_io command reset; slave_io command home; "
      "slave_io command gripper close --force-N 20; slave_io command tare\n"
      "kill -USR1 is an emergency stop; a stop outlives the process (--state-dir), until a reset.\n"
      "With --report-dir it leaves slave_io.json: how the loop ran, and every contact.";
  description.add_options = [&](runtime::Command app) {
    command = app.subcommand("command", "ask something of the running master_io and slave_io");
    runtime::add_operator_options(command, request, false);
  };
  description.parameters = {slave_io::kParameters, runtime::kDriveParameters, runtime::kSwitchParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    std::optional<runtime::EndsAtOnce> starting(std::in_place);
    const auto deployment = runtime::load_deployment(options);
    if (command.given()) {
      starting.emplace(runtime::kExitFailed);  // a command that is interrupted has failed
      return static_cast<int>(runtime::exit_code(
          messages::run_operator_request(deployment.network, "slave_io command", request, std::cout)));
    }
    const auto cell = runtime::load_checked_cell(deployment);
    const auto model = slave_io::load_arm(cell, runtime::arm_name(options.config));
    auto config = slave_io::load_config(options.config, model.arm, model.home);
    config.object_bounds = slave_io::object_bounds_with_boxes(cell);
    config.link_boxes = slave_io::link_boxes(model.arm, model.skin, cell.voxel_size_m.reference_m());
    const bool simulated = config.driver == slave_io::Driver::kSimulated;
    if (simulated) {
      runtime::require_simulation_meant(deployment, options, options.config.string() + ": driver: sim");
      simulation::contact_points(model.arm, model.skin, config.contact.point_pitch_m,
                                 config.contact.max_points);
    }
    if (config.enabling_switch &&
        config.enabling_switch->source == runtime::EnablingSwitchConfig::Source::kSimulated)
      runtime::require_simulation_meant(deployment, options,
                                        options.config.string() + ": enabling_switch.source: simulated");
    dds::check_qos_profiles(deployment.network.qos_profiles);
    if (options.check) {
      if (simulated) {
        runtime::load_real_bodies(cell);
        runtime::load_loose_bodies(cell);
      }
      runtime::check_switch(config.enabling_switch);
      std::string found = simulated ? "" : runtime::check_drives(*config.can);
      if (!simulated && config.gripper) found += runtime::check_drives(*config.gripper->drive);
      if (config.force_sensor && config.wrist) found += slave_io::check_wrist_bus(*config.wrist);
      return runtime::configuration_is_valid(found);
    }
    starting.reset();
    return slave_io::run_session(cell, model, config, deployment.network,
                                 runtime::stop_place(options.state_dir), options.report_dir);
  };
  return runtime::process_main(argc, argv, description);
}
