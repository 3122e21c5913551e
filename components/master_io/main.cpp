#include <iostream>
#include <optional>

#include "common/dds/endpoints/participant.hpp"
#include "common/messages/operator_command_line.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/configuration/drives_check.hpp"
#include "common/runtime/configuration/operator_options.hpp"
#include "common/runtime/process/process.hpp"
#include "common/runtime/process/stop_place.hpp"
#include "common/runtime/servo/switch_input.hpp"
#include "components/master_io/config.hpp"
#include "components/master_io/devices/desk_input.hpp"
#include "components/master_io/jnd/command.hpp"
#include "components/master_io/reaches/reaches.hpp"
#include "components/master_io/session.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  master_io::Choices choices;
  teleop::OperatorRequest request;
  master_io::JndRequest jnd_request;
  runtime::Command command, jnd;
  runtime::ProcessDescription description;
  description.name = "master_io";
  description.summary =
      "The operator's side: commands the slave and renders drag (percept) and slave torque on the master at "
      "1 kHz; here with "
      "a simulated device and a simulated operator who makes reaches, in turn with the percept and without.";
  description.details =
      "Topics in: slave_state, drag_field, percept, operator_command. Topics out: "
      "master_state (1 kHz), component_status.\n"
      "Example: master_io --operator constant_velocity --law pf\n"
      "Steer yourself: master_io --driver desk --desk-device terminal (arrows, W A S D; Tab: other joints; "
      "C, O: gripper; 1, 2, 3, L: percepts; Esc: stop)\n"
      "Example while it runs: master_io command stop; master_io command reset; master_io command law pf\n"
      "Example while it runs: master_io jnd --joint j3_shoulder (asks which of two drags is more viscous)\n"
      "kill -USR1 is an emergency stop; a stop outlives the process (--state-dir), until a reset.\n"
      "With --report-dir it leaves master_io.json: how the loop ran, round trips, and how each reach went.";
  description.add_options = [&](runtime::Command app) {
    command = app.subcommand("command", "ask something of the running master_io and slave_io");
    runtime::add_operator_options(command, request, true);
    jnd = app.subcommand("jnd", "measure an operator's just noticeable difference of drag on a joint");
    master_io::add_options(jnd, jnd_request);
    app.option("--operator", choices.operator_model, "operator model, instead of the configured one")
        .one_of({"minimum_jerk", "cautious", "attentive", "constant_velocity"});
    app.option("--law", choices.law,
               "bilateral law of Table 5.1, instead of the configured one: "
               "pf (a), sctfb (b), pfff (c), pe (d), peff (e)")
        .one_of({"pf", "sctfb", "pfff", "pe", "peff"});
    app.option("--driver", choices.driver,
               "who moves the master, instead of the configured one: sim, desk, can or cartesian")
        .one_of({"sim", "desk", "can", "cartesian"});
    app.text_flag("--help-reaches", master_io::kReachKeys,
                  "print every key of a reaches file with its meaning");
    app.option("--desk-device", choices.desk_device,
               "driver desk: auto (first gamepad or joystick), a file of /dev/input, or terminal (keys)");
  };
  description.parameters = {master_io::kParameters, runtime::kDriveParameters, runtime::kSwitchParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    std::optional<runtime::EndsAtOnce> starting(std::in_place);
    const auto deployment = runtime::load_deployment(options);
    const auto cell = runtime::load_checked_cell(deployment);
    const auto model = master_io::load_arm(cell, runtime::arm_name(options.config));
    if (command.given()) {
      starting.emplace(runtime::kExitFailed);  // a command that is interrupted has failed
      request.joint = master_io::joint_index(model, request.joint_name);
      return static_cast<int>(runtime::exit_code(
          messages::run_operator_request(deployment.network, "master_io command", request, std::cout)));
    }
    const auto config = master_io::load_config(options.config, cell.file, model.arm, model.home, choices);
    if (jnd.given()) {
      starting.reset();  // an interruption restores the gain
      return master_io::run_jnd(jnd_request, model, config, deployment.network);
    }
    if (!master_io::is_held_by_person(config))
      runtime::require_simulation_meant(
          deployment, options,
          (choices.driver.empty() ? options.config.string() + ": driver: " : "--driver ") +
              master_io::name_of(config.driver));
    if (config.enabling_switch &&
        config.enabling_switch->source == runtime::EnablingSwitchConfig::Source::kSimulated)
      runtime::require_simulation_meant(deployment, options,
                                        options.config.string() + ": enabling_switch.source: simulated");
    dds::check_qos_profiles(deployment.network.qos_profiles);
    if (options.check) {
      if (master_io::uses_desk(config)) master_io::check_device(config.desk);
      runtime::check_switch(config.enabling_switch);
      return runtime::configuration_is_valid(
          config.driver == master_io::Driver::kCan ? runtime::check_drives(*config.can) : "");
    }
    starting.reset();
    return master_io::run_session(cell, model, config, deployment.network,
                                  runtime::stop_place(options.state_dir), options.report_dir);
  };
  return runtime::process_main(argc, argv, description);
}
