#include "components/synthetic_viewer/http_port.hpp"

#include <arpa/inet.h>
#include <dirent.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "common/core/errors.hpp"
#include "common/core/thread_place.hpp"

namespace phantom::synthetic_viewer {
namespace {

/// Returns the local TCP port of a socket; 0 if the descriptor is not a socket.
int local_port(int descriptor) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  if (address.ss_family == AF_INET) return ntohs(reinterpret_cast<sockaddr_in*>(&address)->sin_port);
  if (address.ss_family == AF_INET6) return ntohs(reinterpret_cast<sockaddr_in6*>(&address)->sin6_port);
  return 0;
}

/// Closes all connections of the port. Otherwise the HTTP library waits for the time-out of idle connections
/// before it ends.
void shut_connections(int port) {
  DIR* folder = opendir("/proc/self/fd");
  if (folder == nullptr) return;
  while (const dirent* entry = readdir(folder)) {
    const int descriptor = std::atoi(entry->d_name);
    int type = 0;
    socklen_t size = sizeof type;
    if (descriptor <= 2 || getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) != 0) continue;
    if (type == SOCK_STREAM && local_port(descriptor) == port) shutdown(descriptor, SHUT_RDWR);
  }
  closedir(folder);
}

}  // namespace

HttpPort::HttpPort(int threads) {
  server.new_task_queue = [threads] { return new httplib::ThreadPool(static_cast<std::size_t>(threads)); };
  server.set_tcp_nodelay(true);
  server.set_keep_alive_max_count(1);  // because an idle connection would occupy a thread
  server.set_keep_alive_timeout(2);
  server.set_read_timeout(2);
  server.set_write_timeout(2);
  server.set_payload_max_length(4096);
  // Replaces the library's default, which lets two servers share a port unnoticed.
  server.set_socket_options([](int descriptor) {
    const int yes = 1;
    setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server.set_default_headers({{"Cache-Control", "no-store"}, {"X-Content-Type-Options", "nosniff"}});
  server.set_error_handler([](const httplib::Request& request, httplib::Response& response) {
    if (response.body.empty()) {
      answer(response, response.status,
             response.status == 404 ? "unknown path " + request.path : "request refused");
    }
  });
  server.set_exception_handler([](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
    answer(response, 500, "the viewer could not answer");
  });
}

HttpPort::~HttpPort() { stop(); }

void HttpPort::bind(const std::string& address, int port, const char* key) {
  if (port == 0) {
    port_ = server.bind_to_any_port(address);
  } else {
    port_ = server.bind_to_port(address, port) ? port : -1;
  }
  if (port_ > 0) return;
  throw core::MissingError("the operator's page cannot be served on " + address + ":" + std::to_string(port) +
                           ": the port is taken or the address is not this host's. Choose another " + key +
                           " (0: any free one) or page.address.");
}

void HttpPort::start() {
  thread_ = std::thread([this] {
    core::take_place(core::ThreadRole::kPage);  // the threads of the pool inherit this
    server.listen_after_bind();
  });
  // Waits, because only a running server can be stopped.
  while (!server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void HttpPort::stop() {
  if (!thread_.joinable()) return;
  server.stop();
  shut_connections(port_);
  thread_.join();
}

void answer(httplib::Response& response, int status, const std::string& message) {
  response.status = status;
  response.set_content(nlohmann::json{{"ok", status == 200}, {"message", message}}.dump(),
                       "application/json");
}

std::string host_name_of(std::string host) {
  if (const auto colon = host.rfind(':');
      colon != std::string::npos && host.find(']', colon) == std::string::npos) {
    host.resize(colon);
  }
  return host;
}

bool is_loopback_name(const std::string& host) {
  const std::string name = host_name_of(host);
  return name == "localhost" || name == "[::1]" || name.rfind("127.", 0) == 0;
}

bool is_loopback_address(const std::string& address) {
  return address == "localhost" || address == "::1" || address.rfind("127.", 0) == 0;
}

}  // namespace phantom::synthetic_viewer
