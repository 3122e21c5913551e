#include <iostream>

#include "common/dds/participant.hpp"
#include "common/runtime/arm_model.hpp"
#include "common/runtime/deployment.hpp"
#include "common/runtime/process.hpp"
#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/dds_adapter.hpp"
#include "components/synthetic_viewer/viewer_loop.hpp"

namespace {

using namespace phantom;
using namespace phantom::synthetic_viewer;

int run(const runtime::ProcessOptions& options) {
  const runtime::Deployment deployment = runtime::load_deployment(options);
  dds::check_qos_profiles(deployment.network.qos_profiles);
  const ViewerConfig config = load_config(options.config);
  const runtime::CellConfig cell = runtime::load_cell(deployment.cell);
  robot::SerialArm arm = runtime::load_arm(cell.arm(config.arm));
  const ArmShape shape{arm.joint_count(), arm.links().size()};
  std::vector<LinkMeshData> arm_meshes = load_arm_meshes(arm);
  if (options.check) {
    std::cout << "configuration is valid; graphics: " << GlContext(config.graphics).description() << '\n';
    return runtime::kExitDone;
  }
  Inbox inbox;
  PageContent content;
  ViewerLoop viewer(config, cell, std::move(arm), std::move(arm_meshes), inbox, content,
                    Report(options.report_dir, config.report_pictures));
  DdsAdapter adapter(deployment.network, shape, inbox);
  std::unique_ptr<WebServer> server;
  if (config.page.enabled) {
    server = std::make_unique<WebServer>(
        config.page, content, [&adapter](const Command& command) { return adapter.send(command); });
    std::cout << "operator's page: " << server->url() << std::endl;
  }
  viewer.start();
  while (viewer.running() && runtime::sleep_unless_stopped(0.5)) adapter.publish(viewer.health());
  const std::string url = server ? server->url() : std::string();
  server.reset();
  viewer.finish(url);
  return runtime::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  return runtime::process_main(
      argc, argv,
      {"synthetic_viewer",
       "Shows the cell and the moving arm from their models alone, and the zone that threatens to be hit\n"
       "from the best side; serves the operator's page.",
       "Writes operator_command (from the page) and component_status; reads the topics that its README "
       "names.\n"
       "Needs no display. The page's address is printed on standard output.\n"
       "With --report-dir it leaves hit_<number>_<node>.png, main*.png and synthetic_viewer.json.",
       {},
       run});
}
