#include <CLI/CLI.hpp>
#include <iostream>

#include "common/dds/participant.hpp"
#include "common/runtime/process.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/phantom_sensing/probe.hpp"
#include "components/phantom_sensing/self_test.hpp"
#include "components/phantom_sensing/service.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  phantom_sensing::ProbeRequest request;
  CLI::App* probe = nullptr;
  runtime::ProcessDescription description;
  description.name = "phantom_sensing";
  description.summary =
      "The phantom: a virtual arm with a virtual skin that wades through the activated workspace in the "
      "slave's pose. "
      "Turns every slave_state into drag coefficients per joint, and tells what the skin perceives and where "
      "a hit "
      "threatens.";
  description.details =
      "In: slave_state, workspace_brick, workspace_version, workspace_object, sensing_command. Out: drag_field, percept, "
      "interest_points, hit_alert, sensing_reply, component_status.\n"
      "Example without DDS: phantom_sensing probe --cell deploy/cells/hot_cell/cell.yaml --joints poses.csv "
      "--out drag.csv";
  description.add_options = [&](CLI::App& app) {
    probe = app.add_subcommand("probe", "sense poses from a CSV file (t, q1…qn, v1…vn) instead of from DDS");
    probe->fallthrough();
    probe->add_option("--cell", request.cell, "cell file; its meshes make the workspace")->required();
    probe->add_option("--arm", request.arm, "arm of the cell, if it has several");
    probe->add_option("--joints", request.joints, "poses: CSV with columns t, q1…qn, v1…vn")->required();
    probe->add_option("--mode", request.mode, "separable or coupled")
        ->check(CLI::IsMember({"separable", "coupled"}));
    probe->add_flag("--directional", request.directional,
                    "directional drag, whatever the configuration says");
    probe->add_option("--out", request.out, "CSV to write")->required();
    probe->add_option("--skin", request.skin, "CSV to write the skin's sensors to");
  };
  description.run = [&](const runtime::ProcessOptions& options) {
    const auto config = phantom_sensing::load_config(options.config);
    if (probe->parsed()) return phantom_sensing::run_probe(request, config);
    const auto deployment = runtime::load_deployment(options);
    const auto cell = runtime::load_cell(deployment.cell);
    const auto model = phantom_sensing::load_model(cell, config);
    phantom_sensing::allowed_contact(cell, config, model);
    dds::check_qos_profiles(deployment.network.qos_profiles);
    if (options.check) {
      const auto tested = phantom_sensing::test_step(config.percept);
      if (!tested.passed) throw std::runtime_error(tested.message);
      std::cout << "configuration is valid: " << model.skin.size() << " sensors and "
                << model.interest_points.size() << " interest points on " << model.arm.joint_count() << " joints\n";
      return static_cast<int>(runtime::kExitDone);
    }
    return phantom_sensing::run_service(options, deployment, cell, config, model);
  };
  return runtime::process_main(argc, argv, description);
}
