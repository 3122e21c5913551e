#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>

#include "common/core/status.hpp"
#include "components/synthetic_viewer/broadcast.hpp"
#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/image.hpp"
#include "components/synthetic_viewer/samples.hpp"

namespace phantom::synthetic_viewer {

/// A view's newest picture, for those who follow it.
struct ViewOutput {
  Broadcast<std::string> jpeg;
  Broadcast<Image> image;  ///< with its HUD; followed by window and recorder

  bool followed() const { return jpeg.followers > 0 || image.followers > 0; }
};

/// What is shown; filled by the viewer, read by the server's threads and the window's.
struct PageContent {
  std::array<ViewOutput, kViews.size()> views;
  Broadcast<std::string> state_json;  ///< page_state_json()
  ViewOutput& view(View which) { return views[static_cast<std::size_t>(which)]; }
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
///   POST /view                  {"view": …, "orbit_deg": …, "zoom": …, "home": …, "record": …}, likewise
/// Threads of its own; nothing here is shared with the servo path.
class WebServer {
 public:
  /// Carries out a checked command. Called on a server thread. An error's message is shown to the operator.
  using OnCommand = std::function<core::Status(const Command&)>;
  /// Takes a checked wish for a view. Likewise.
  using OnViewRequest = std::function<core::Status(const ViewRequest&)>;

  /// Serves as soon as it stands. Throws core::MissingError if the address or port cannot be had.
  WebServer(const PageConfig& config, PageContent& content, OnCommand on_command,
            OnViewRequest on_view_request);
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
