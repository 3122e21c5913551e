#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/core/status.hpp"
#include "components/synthetic_viewer/broadcast.hpp"
#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/samples.hpp"

namespace phantom::synthetic_viewer {

/// What the page shows; filled by the viewer, read by the server's threads.
struct PageContent {
  Broadcast main_jpeg, hit_jpeg, tool_jpeg;  ///< newest picture of each view
  Broadcast state_json;                      ///< page_state_json()
  /// PNG of the newest main picture; empty if there is none yet. Called on a server thread.
  std::function<std::string()> main_png;
  /// JPEG of an alert's first picture; empty if there is none (any more). Called on a server thread.
  std::function<std::string(std::uint32_t alert)> hit_picture;
};

/// Serves the operator's page and its streams over HTTP, and takes its commands:
///   GET  /                      the page (/page.css, /page.js)
///   GET  /stream/main|hit|tool  motion JPEG
///   GET  /events                server-sent events with page_state_json()
///   GET  /snapshot/main.png, /hits/<alert>.jpg
///   POST /command               {"kind": …, "value": …} as JSON, from the page itself only
/// Threads of its own; nothing here is shared with the servo path.
class WebServer {
 public:
  /// Carries out a checked command. Called on a server thread. An error's message is shown to the operator.
  using OnCommand = std::function<core::Status(const Command&)>;

  /// Serves as soon as it stands. Throws core::MissingError if the address or port cannot be had.
  WebServer(const PageConfig& config, PageContent& content, OnCommand on_command);
  /// Ends all streams and joins its threads: within half a second.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  int port() const;
  /// "http://127.0.0.1:8080/"
  std::string url() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::synthetic_viewer
