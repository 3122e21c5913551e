#pragma once

#include <atomic>

#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/http_port.hpp"
#include "components/synthetic_viewer/page_content.hpp"

namespace phantom::synthetic_viewer {

/// Serves the long-lived streams on their own port:
///   GET /stream/main|hit|tool  motion JPEG
///   GET /events                server-sent events with page_state_json()
/// A browser opens at most six connections to a host and port, and further requests wait. With their own
/// port, streams never delay requests to the page's port.
class StreamServer {
 public:
  /// Starts to serve, events only to pages of `page_port`. Throws core::MissingError.
  StreamServer(const PageConfig& config, int page_port, PageContent& content);
  /// Ends all streams.
  ~StreamServer();
  int port() const { return http_.port(); }

 private:
  using Source = Broadcast<std::string>;
  /// `write` sends new content (or repeats the last, if null) and returns whether the follower is still
  /// connected.
  using WriteItem = std::function<bool(httplib::DataSink&, const Source::Content&)>;
  void follow(httplib::Response& response, const char* type, Source& source, std::string opening,
              WriteItem write);
  void motion_jpeg(httplib::Response& response, Source& source);
  void events(const httplib::Request& request, httplib::Response& response);

  PageConfig config_;
  std::string page_port_;
  PageContent& content_;
  std::atomic<bool> stopping_{false};
  std::atomic<int> streams_{0};
  HttpPort http_;
};

}  // namespace phantom::synthetic_viewer
