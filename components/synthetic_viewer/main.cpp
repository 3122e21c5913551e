#include <iostream>
#include <optional>

#include "common/dds/participant.hpp"
#include "common/runtime/arm_model.hpp"
#include "common/runtime/deployment.hpp"
#include "common/runtime/process.hpp"
#include "components/synthetic_viewer/arm_meshes.hpp"
#include "components/synthetic_viewer/gl_context.hpp"
#include "components/synthetic_viewer/session.hpp"
#include "components/synthetic_viewer/sheet.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  using namespace phantom::synthetic_viewer;
  SheetRequest sheet;
  runtime::Command sheet_command;
  bool window = false;
  runtime::ProcessDescription description;
  description.name = "synthetic_viewer";
  description.summary =
      "Shows the cell and the moving arm from their models alone, "
      "and the zone that threatens to be hit from the best side; serves the operator's page.";
  description.details =
      "Writes operator_command (from the page and the window) and component_status; "
      "reads the topics that its README names.\nNeeds no display; --window opens one where there is. "
      "The page's address is printed on standard output.\n"
      "With --report-dir it leaves hit_<number>_<node>.png, main*.png and synthetic_viewer.json.\n"
      "Example without DDS: synthetic_viewer sheet --cell deploy/cells/two_plates/cell.yaml --out sheet.png";
  description.add_options = [&](runtime::Command app) {
    app.flag("--window", window, "open a window on this host's desktop as well");
    sheet_command = add_sheet_command(app, sheet);
  };
  description.parameters = {kParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    ViewerConfig config = load_config(options.config);
    std::optional<runtime::EndsAtOnce> starting;
    if (sheet_command.given()) starting.emplace(runtime::kExitFailed);
    if (sheet_command.given()) return run_sheet(sheet, config);
    starting.emplace();
    const runtime::Deployment deployment = runtime::load_deployment(options);
    dds::check_qos_profiles(deployment.network.qos_profiles);
    const runtime::CellConfig cell = runtime::load_cell(deployment.cell);
    config.window.wanted = config.window.wanted || window;
    if (options.check) {
      const robot::SerialArm arm = runtime::load_arm(cell.arm(config.arm));
      load_arm_meshes(arm, runtime::load_skin(cell.arm(config.arm), arm));
      const GlContext graphics(config.graphics);
      std::cout << "configuration is valid; graphics: " << graphics.description() << '\n';
      return static_cast<int>(runtime::kExitDone);
    }
    starting.reset();
    run_session(std::move(config), cell, deployment.network, options.report_dir);
    return static_cast<int>(runtime::kExitDone);
  };
  return runtime::process_main(argc, argv, description);
}
