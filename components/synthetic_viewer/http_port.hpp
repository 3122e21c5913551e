#pragma once

#include <httplib.h>

#include <string>
#include <thread>

namespace phantom::synthetic_viewer {

/// An HTTP server with its own port and threads. Add handlers to `server` before start().
class HttpPort {
 public:
  /// `threads`: number of requests that are handled at once.
  explicit HttpPort(int threads);
  ~HttpPort();
  HttpPort(const HttpPort&) = delete;
  HttpPort& operator=(const HttpPort&) = delete;

  /// Binds the port, 0: any free one. Throws core::MissingError if that fails; `key` names the port's key in
  /// the configuration.
  void bind(const std::string& address, int port, const char* key);
  void start();
  /// Ends all requests and joins the threads. A second call does nothing.
  void stop();
  int port() const { return port_; }

  httplib::Server server;

 private:
  int port_ = 0;
  std::thread thread_;
};

/// Sends the response {"ok": …, "message": …}.
void answer(httplib::Response& response, int status, const std::string& message);
/// Returns the host name without port: "host" of "host:8080", "[::1]" of "[::1]:8080".
std::string host_name_of(std::string host);
bool is_loopback_name(const std::string& host);
bool is_loopback_address(const std::string& address);

}  // namespace phantom::synthetic_viewer
