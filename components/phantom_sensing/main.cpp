#include <iostream>
#include <optional>

#include "common/dds/endpoints/participant.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/process/process.hpp"
#include "components/phantom_sensing/command.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/phantom_sensing/other_arms.hpp"
#include "components/phantom_sensing/service.hpp"
#include "components/phantom_sensing/tools/dds_adapter_replay.hpp"
#include "components/phantom_sensing/tools/probe.hpp"
#include "components/phantom_sensing/tools/self_test.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  phantom_sensing::ProbeRequest request;
  phantom_sensing::CommandRequest command_arguments;
  phantom_sensing::ReplayRequest recorded;
  std::string share;
  runtime::Command probe, command, replay;
  runtime::ProcessDescription description;
  description.name = "phantom_sensing";
  description.summary =
      "The phantom: a virtual arm with a virtual skin that wades through the activated workspace in the "
      "slave's pose. Turns every slave_state into drag coefficients per joint, "
      "and tells what the skin perceives and where a hit threatens.";
  description.details =
      "In: slave_state, workspace_brick, workspace_version, workspace_object, sensing_command. Out: "
      "drag_field, percept, interest_points, hit_alert, sensing_reply, component_status.\n"
      "Example while it runs: phantom_sensing command allow --object gate_valve --link gripper --for-s 60\n"
      "Example without DDS: phantom_sensing probe --cell deploy/cells/hot_cell/cell.yaml --joints "
      "poses.csv --out drag.csv";
  description.add_options = [&](runtime::Command app) {
    const auto add = [&app](const char* name, const char* what, auto& options) {
      runtime::Command added = app.subcommand(name, what);
      phantom_sensing::add_options(added, options);
      return added;
    };
    app.option("--share", share,
               "sense this share of the skin, for the phantom_sensing of the arm (sharing.shares)");
    probe = add("probe", "sense poses from a CSV file (t, q1…qn, v1…vn) instead of from DDS", request);
    replay = add("replay",
                 "make the percepts of a recording again, and compare them with those that were recorded",
                 recorded);
    command = add("command", "tell the running phantom_sensing what may be touched, or to test itself",
                  command_arguments);
  };
  description.parameters = {phantom_sensing::kParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    auto config = phantom_sensing::load_config(options.config);
    config.own_share = share;
    std::optional<runtime::EndsAtOnce> batch;
    if (probe.given() || replay.given()) batch.emplace(runtime::kExitFailed);
    if (probe.given()) return phantom_sensing::run_probe(request, config);
    if (replay.given()) return phantom_sensing::run_replay(recorded, config);
    const auto deployment = runtime::load_deployment(options);
    if (command.given())
      return phantom_sensing::run_command(command_arguments, deployment.network, std::cout);
    std::optional<runtime::EndsAtOnce> starting(std::in_place);
    const auto cell = phantom_sensing::sensed_cell(runtime::load_checked_cell(deployment), config);
    auto model = phantom_sensing::load_model(cell, config);
    const auto others = phantom_sensing::load_other_arms(cell, config);
    model.other_links = phantom_sensing::links_of(others);
    phantom_sensing::allowed_contact(cell, config, model);
    dds::check_qos_profiles(deployment.network.qos_profiles);
    if (options.check) {
      const auto tested = phantom_sensing::test_step(config.percept);
      if (!tested.passed) throw std::runtime_error(tested.message);
      return runtime::configuration_is_valid(
          ": " + std::to_string(model.skin.size()) + " sensors and " +
          std::to_string(model.interest_points.size()) + " interest points on " +
          std::to_string(model.arm.joint_count()) + " joints\n" +
          phantom_sensing::describe(phantom_sensing::predict_tick(cell, config, model)));
    }
    starting.reset();
    return phantom_sensing::run_service(options, deployment, cell, config, model, others);
  };
  return runtime::process_main(argc, argv, description);
}
