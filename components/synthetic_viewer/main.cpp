#include <spdlog/spdlog.h>
#include <unistd.h>

#include <iostream>
#include <optional>

#include "common/core/errors.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/line_writer.hpp"
#include "common/runtime/process/process.hpp"
#include "common/web/tls_context.hpp"
#include "components/synthetic_viewer/calibrate.hpp"
#include "components/synthetic_viewer/output/publishing_schedule.hpp"
#include "components/synthetic_viewer/output/window.hpp"
#include "components/synthetic_viewer/page/web_server.hpp"
#include "components/synthetic_viewer/render/gl_context.hpp"
#include "components/synthetic_viewer/review_command.hpp"
#include "components/synthetic_viewer/scene/arm_meshes.hpp"
#include "components/synthetic_viewer/scene/live_shape_follower.hpp"
#include "components/synthetic_viewer/sheet.hpp"
#include "components/synthetic_viewer/stream/fluid_store.hpp"
#include "components/synthetic_viewer/stream/headset_hand.hpp"
#include "components/synthetic_viewer/stream/scene_feed.hpp"
#include "components/synthetic_viewer/topics/dds_adapter.hpp"
#include "components/synthetic_viewer/video/video_source.hpp"
#include "components/synthetic_viewer/viewer_loop.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr double kTurn_s = core::seconds(PublishingSchedule::kViewPeriod_ns);  // period of the loop below

/// Runs the viewer until a stop is requested: drawing thread, topics, page and, if one is wanted and there is
/// a display, window. Throws core::MissingError if there is no OpenGL, no port for the page, or a link's mesh
/// is missing.
void run_session(ViewerConfig config, const runtime::CellConfig& cell, const core::NetworkOptions& network,
                 const std::filesystem::path& report_dir) {
  const runtime::ArmConfig& arm_config = cell.arm(config.arm);
  robot::SerialArm arm = runtime::load_arm(arm_config);
  const messages::ArmBounds shape{.joint_count = arm.joint_count(), .link_count = arm.links().size()};
  std::vector<LinkMeshData> arm_meshes = load_arm_meshes(arm, runtime::load_skin(arm_config, arm));
  if (!arm_config.gripper_closed.empty())
    set_closing(runtime::load_arm_with_closed_gripper(arm_config), arm_meshes);
  const auto others = sources_of(load_other_arms(cell, config.arm, config.other_arms), config.other_arms);
  HeadsetHand hand(config.page.hand_silent_s, arm.base_pose().rotation);
  if (config.recording.folder.empty()) config.recording.folder = report_dir;
  Inbox inbox;
  PageContent content;
  ViewerLoop viewer(config, cell, std::move(arm), std::move(arm_meshes), inbox, content, report_dir);
  const auto& camera = config.camera_view.camera;
  DdsAdapter adapter(network, shape, inbox,
                     camera && camera->kind == VideoKind::kTopic ? camera->name : std::string(), others);
  const bool leads = config.page.enabled && config.page.headset_hand;
  if (leads) adapter.serve(hand);
  FluidStore fluid([&adapter] { return adapter.workspace(); });
  content.fluid = &fluid;
  const LiveShapeFollower live_shape(inbox, [&adapter] { return adapter.workspace(); });
  content.stops = [&inbox] { return inbox.stops.at(core::monotonic_ns()); };
  const auto move = [&inbox](const ViewRequest& request) {
    return inbox.put(request)
               ? core::Status::ok()
               : core::Status(core::ErrorCode::kUnavailable, "the viewer is too busy to take this");
  };
  runtime::LineWriter out(STDOUT_FILENO);
  std::string url;
  std::unique_ptr<SceneFeed> scene;
  std::unique_ptr<WebServer> server;  // ends first: it hands its followers to the scene
  if (config.page.enabled) {
    scene = std::make_unique<SceneFeed>(config, config.page.scene_Hz, cell.name, inbox, content,
                                        leads ? &hand : nullptr);
    scene->start();
    server = std::make_unique<WebServer>(
        config.page, content, [&adapter](const Command& command) { return adapter.ask(command); }, move,
        [&adapter](const WorkspaceRequest& request) { return adapter.change(request); }, scene.get());
    url = server->url();
    out.put("operator's page: " + url + '\n');
    if (!config.page.secrets)
      spdlog::info("page.secrets is empty: everybody on this host may watch and command");
    if (config.page.tls) {
      const std::string fault = config.page.tls->date_fault(std::time(nullptr));
      if (!fault.empty()) spdlog::warn("page.certificate {}: browsers will refuse it", fault);
    } else if (config.page.secrets) {
      spdlog::info("page.certificate is empty: secrets and commands are sent without encryption");
    }
    spdlog::info("its live pictures and events: port {}", server->stream_port());
  }
  viewer.start();
  std::unique_ptr<Window> window;
  if (config.window.wanted) try {
      window = std::make_unique<Window>(
          "Phantom - " + cell.name, content, move,
          [&](const Command& command) {
            if (!config.page.allow_commands)
              return spdlog::warn("this viewer only shows: page.allow_commands is false");
            adapter.send(command);
          },
          config.language);
    } catch (const core::MissingError& problem) {
      spdlog::warn("{}; continuing without a window", problem.what());
    }
  PublishingSchedule schedule(config.page.allow_commands, config.frame_rate_hz);
  while (viewer.running() && !runtime::stop_requested()) {
    if (window && !window->turn(kTurn_s)) {
      spdlog::info("window closed; continuing without it");
      window.reset();
    } else if (!window && !runtime::sleep_unless_stopped(kTurn_s)) {
      break;
    }
    const ViewPoseSample view = content.view_pose.newest_or_default();
    const PublishingSchedule::Due due = schedule.at(core::monotonic_ns(), view.made_ns);
    if (due.view_pose) adapter.publish(view);
    adapter.publish_pictures(content, config.pictures_Hz);
    if (due.status) {
      adapter.release_workspace();
      core::Health health = viewer.health();
      health.page = url;
      if (server)
        for (core::LoopStatistics& loop : server->progress()) health.loops.push_back(std::move(loop));
      if (scene) health.loops.push_back(scene->progress());
      adapter.publish(health);
    }
  }
  window.reset();
  server.reset();
  viewer.finish(url);
}

}  // namespace
}  // namespace phantom::synthetic_viewer

int main(int argc, char** argv) {
  using namespace phantom;
  using namespace phantom::synthetic_viewer;
  bound_device_waits();
  SheetRequest sheet;
  ReviewArguments review;
  CalibrateRequest calibrate;
  runtime::Command sheet_command, review_command, calibrate_command;
  bool window = false;
  std::filesystem::path page_secrets;
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
      "Examples without DDS: synthetic_viewer sheet --cell deploy/cells/two_plates/cell.yaml --out sheet.png\n"
      "                      synthetic_viewer review recordings        a recorded session again, on the page";
  description.add_options = [&](runtime::Command app) {
    app.flag("--window", window, "open a window on this host's desktop as well");
    app.option("--page-secrets", page_secrets, "folder of the page's secrets, where page.secrets names none");
    sheet_command = add_sheet_command(app, sheet);
    review_command = add_review_command(app, review);
    calibrate_command = add_calibrate_command(app, calibrate);
  };
  description.parameters = {kParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    ViewerConfig config = load_config(options.config, page_secrets);
    std::optional<runtime::EndsAtOnce> starting;
    const bool without_topics = sheet_command.given() || calibrate_command.given();
    if (without_topics) starting.emplace(runtime::kExitFailed);
    if (sheet_command.given()) return run_sheet(sheet, config);
    if (review_command.given()) return run_review(review, std::move(config), options);
    if (calibrate_command.given()) return run_calibrate(calibrate, config);
    starting.emplace();
    const runtime::Deployment deployment = runtime::load_deployment(options);
    dds::check_qos_profiles(deployment.network.qos_profiles);
    const runtime::CellConfig cell = runtime::load_checked_cell(deployment);
    config.window.wanted = config.window.wanted || window;
    if (options.check) {
      const robot::SerialArm arm = runtime::load_arm(cell.arm(config.arm));
      load_arm_meshes(arm, runtime::load_skin(cell.arm(config.arm), arm));
      load_other_arms(cell, config.arm, config.other_arms);
      const GlContext graphics(config.graphics);
      return runtime::configuration_is_valid("; graphics: " + graphics.description());
    }
    starting.reset();
    run_session(std::move(config), cell, deployment.network, options.report_dir);
    return static_cast<int>(runtime::kExitDone);
  };
  return runtime::process_main(argc, argv, description);
}
