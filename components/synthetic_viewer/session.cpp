#include "components/synthetic_viewer/session.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include "common/core/errors.hpp"
#include "common/runtime/arm_model.hpp"
#include "common/runtime/line_writer.hpp"
#include "common/runtime/process.hpp"
#include "components/synthetic_viewer/dds_adapter.hpp"
#include "components/synthetic_viewer/publishing_schedule.hpp"
#include "components/synthetic_viewer/viewer_loop.hpp"
#include "components/synthetic_viewer/web_server.hpp"
#include "components/synthetic_viewer/window.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr double kTurn_s = core::seconds(PublishingSchedule::kViewPeriod_ns);  // period of the loop below

/// Returns null if no window is wanted, or there is no display.
std::unique_ptr<Window> open_window(const ViewerConfig& config, const std::string& cell, PageContent& content,
                                    WindowActions actions) {
  if (!config.window.wanted) return nullptr;
  try {
    return std::make_unique<Window>("Phantom - " + cell, content, std::move(actions));
  } catch (const core::MissingError& problem) {
    spdlog::warn("{}; the viewer goes on without a window", problem.what());
    return nullptr;
  }
}

}  // namespace

void run_session(ViewerConfig config, const runtime::CellConfig& cell, const core::NetworkOptions& network,
                 const std::filesystem::path& report_dir) {
  robot::SerialArm arm = runtime::load_arm(cell.arm(config.arm));
  const messages::ArmBounds shape{.joint_count = arm.joint_count(), .link_count = arm.links().size()};
  std::vector<LinkMeshData> arm_meshes = load_arm_meshes(arm, runtime::load_skin(cell.arm(config.arm), arm));
  if (config.recording.folder.empty()) config.recording.folder = report_dir;
  Inbox inbox;
  PageContent content;
  ViewerLoop viewer(config, cell, std::move(arm), std::move(arm_meshes), inbox, content,
                    Report(report_dir, config.report_pictures));
  DdsAdapter adapter(network, shape, inbox);
  content.stops = [&inbox] { return inbox.stops.at(core::monotonic_ns()); };
  const auto move = [&inbox](const ViewRequest& request) {
    return inbox.put(request)
               ? core::Status::ok()
               : core::Status(core::ErrorCode::kUnavailable, "the viewer is too busy to take this");
  };
  runtime::LineWriter out(STDOUT_FILENO);
  std::unique_ptr<WebServer> server;
  std::string url;
  if (config.page.enabled) {
    server = std::make_unique<WebServer>(
        config.page, content, [&adapter](const Command& command) { return adapter.ask(command); }, move);
    url = server->url();
    out.put("operator's page: " + url + '\n');
    spdlog::info("its live pictures and events: port {}", server->stream_port());
  }
  viewer.start();
  // The window is at the operator's desk. Whether the operator may send commands is decided in one place.
  WindowActions actions;
  actions.move = move;
  actions.switches = [&viewer] { return viewer.switches(); };
  actions.stops = content.stops;
  actions.command = [&](const Command& command) {
    if (!config.page.allow_commands)
      return spdlog::warn("this viewer only shows: page.allow_commands is false");
    adapter.send(command);
  };
  std::unique_ptr<Window> window = open_window(config, cell.name, content, std::move(actions));
  PublishingSchedule schedule(config.page.allow_commands, config.frame_rate_hz);
  while (viewer.running() && !runtime::stop_requested()) {
    if (window && !window->turn(kTurn_s)) {
      spdlog::info("window closed; the viewer goes on without it");
      window.reset();
    } else if (!window && !runtime::sleep_unless_stopped(kTurn_s)) {
      break;
    }
    const ViewPoseSample view = viewer.view_pose();
    const PublishingSchedule::Due due = schedule.at(core::monotonic_ns(), view.made_ns);
    if (due.view_pose) adapter.publish(view);
    if (due.status) {
      core::Health health = viewer.health();
      health.page = url;
      adapter.publish(health);
    }
  }
  window.reset();
  server.reset();
  viewer.finish(url);
}

}  // namespace phantom::synthetic_viewer
