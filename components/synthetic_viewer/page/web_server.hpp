#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/status.hpp"
#include "components/synthetic_viewer/page/page_config.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"
#include "components/synthetic_viewer/stream/page_content.hpp"

namespace phantom::synthetic_viewer {

class SceneFeed;

/// Serves the operator's page by HTTP, or by HTTPS where the configuration has a certificate, and takes its
/// commands. The requests to page.port are answered at
/// once:
///   GET  /                      the page and its files
///   GET  /stop                  stop_json(): which sides are stopped
///   GET  /state                 the newest page_state(), for a page to which no stream comes
///   GET  /snapshot/main.png, /hits/<alert>.jpg
///   GET  /mesh/<hash>, /shaders.json   what the scene stream names, and the programs that draw it here
///   POST /command               {"kind": …, "value": …} as JSON, from the page itself only
///   POST /carry                 {"object": …, "attach": true or false}, likewise
///   POST /model                 {"correct": a doubt's number}, {"found": object} or {"undo": object}
///   GET  /calibration, /calibration/still.jpg, /calibration/overlay.jpg   of a real camera's pose
///   POST /calibration           {"try": …}, {"keep": N} or {"discard": N}, likewise (PoseCalibration)
///   GET  /session               which role this browser has; POST /login, /logout
///   POST /view                  {"view": …, "orbit_deg": …, "zoom": …, "home": …, "record": …,
///                               "approach": …}, likewise
/// and, while a recording is shown (PageContent::review), when every other command is refused:
///   GET  /review                review_json(): what the recording has
///   GET  /review/series         ?names=…&from=…&to=…&columns=…: its numbers, for plots
///   POST /review                {"t": …, "play": …, "rate": …}: which moment is shown
/// What is followed for long has its own port:
///   GET  /scene                 a WebSocket: numbers and alerts, and the scene (SceneFeed)
///   GET  /stream/main|hit|tool  motion JPEG
/// A browser opens at most six connections to a host and port, and further requests wait, so that streams on
/// the page's port would delay a stop. Requests pass RequestGate (sizes, times, numbers), OriginRule (hosts
/// and origins) and PageSessions (roles), in that order. The server has its own threads and shares nothing
/// with the servo path.
class WebServer {
 public:
  /// Carries out a checked command and returns its outcome within half a second. Called on a server thread.
  using OnCommand = std::function<CommandOutcome(const Command&)>;
  /// Asks for what is to be taken, put down or corrected, likewise.
  using OnWorkspaceRequest = std::function<CommandOutcome(const WorkspaceRequest&)>;
  /// Takes a checked request for a view, within half a second. Called on a server thread.
  using OnViewRequest = std::function<core::Status(const ViewRequest&)>;

  /// Starts to serve. Without `on_workspace_request` nothing can be taken, and without `scene` there are
  /// pictures and commands alone; else it must outlive the server. Throws core::MissingError if the address
  /// or a port cannot be had.
  WebServer(const PageConfig& config, PageContent& content, OnCommand on_command,
            OnViewRequest on_view_request, OnWorkspaceRequest on_workspace_request = {},
            SceneFeed* scene = nullptr);
  /// Ends all streams, `scene` included, and joins the threads, within half a second.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  int port() const;
  int stream_port() const;
  /// Returns the progress of the threads that read the requests to each port. Any thread.
  std::vector<core::LoopStatistics> progress() const;
  /// Returns the page's address, such as "http://127.0.0.1:8080/".
  std::string url() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::synthetic_viewer
