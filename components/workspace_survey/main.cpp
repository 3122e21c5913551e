#include <iostream>

#include "common/dds/endpoints/participant.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/process.hpp"
#include "components/workspace_survey/commands.hpp"
#include "components/workspace_survey/library.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  workspace_survey::Request request;
  runtime::ProcessDescription description;
  description.name = "workspace_survey";
  description.summary =
      "From a few laser points to an object in the running workspace: "
      "corners of plane faces, targeted with a pan-tilt range head from metres away, "
      "are matched with a library of CAD models; the part that fits is placed, "
      "with its uncertainty and a guard skin that covers it. "
      "Where the data do not say what it is or where it stands, it says why and what to measure next. "
      "An object that stands elsewhere than in the model is corrected by touching it.";
  description.details =
      "Topics out: workspace_command; in: workspace_reply; both with --send and touch only; "
      "for touch slave_state, workspace_object, workspace_version and mesh_chunk in.\n"
      "Try:  workspace_survey assist --practice v_groove_block --pose \"0.1 0 0.4 90 0 20\"     (then press "
      "Enter a few times)\n"
      "      workspace_survey simulate --part wedge --pose \"0.1 0 0.4 90 0 20\" --out wedge.csv\n"
      "      workspace_survey fit --measurements wedge.csv --picture wedge.png\n"
      "      workspace_survey assist --driver 'workspace_survey simulate_head --part wedge --pose \"0.1 0 0.4 90 0 "
      "20\"'\n"
      "      workspace_survey fit --measurements wedge.csv --send            (while the demo runs)\n"
      "      workspace_survey touch --object pump                            (while an arm touches it)";
  description.add_options = [&](runtime::Command app) { workspace_survey::add_options(app, request); };
  description.parameters = {workspace_survey::kParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    const auto config = workspace_survey::load_config(options.config);
    const auto deployment = runtime::load_deployment(options);
    const auto cell = runtime::load_checked_cell(deployment);
    const workspace_survey::Workspace workspace{deployment.network, cell.voxel_size_m, cell};
    if (options.check || request.send || request.what == "touch")
      dds::check_qos_profiles(deployment.network.qos_profiles);
    if (options.check) {
      const auto library = workspace_survey::load_library(
          request.library.empty() ? runtime::share_path("deploy/parts") : request.library);
      if (!library.unusable.empty()) throw core::ConfigError(library.unusable.front().problem);
      return runtime::configuration_is_valid(": " + std::to_string(library.parts.size()) +
                                             " parts in the library");
    }
    if (request.what.empty())
      throw core::ConfigError(
          "what shall be done? allowed: parts, simulate, simulate_head, identify, fit, assist, touch (see --help)");
    const runtime::EndsAtOnce batch(runtime::kExitFailed);  // a stop ends it at once, also at a prompt
    return workspace_survey::run(request, config, workspace, std::cin, std::cout);
  };
  return runtime::process_main(argc, argv, description);
}
