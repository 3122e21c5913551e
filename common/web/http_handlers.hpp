#pragma once

#include <httplib.h>

#include <string>

namespace phantom::web {

/// The library's server without its own reading of connections.
struct HttpHandlers : httplib::Server {
  /// Answers one request, after which its connection ends.
  void answer(httplib::Stream& request) { answer_by(*this, request); }

 private:
  // Since cpp-httplib 0.16 the addresses are asked of the stream before.
  template <class Server>
  static void answer_by(Server& server, httplib::Stream& request) {
    bool closed = false;
    if constexpr (requires { server.process_request(request, true, closed, nullptr); }) {
      server.process_request(request, true, closed, nullptr);
    } else {
      std::string remote, local;
      int remote_port = 0, local_port = 0;
      request.get_remote_ip_and_port(remote, remote_port);
      request.get_local_ip_and_port(local, local_port);
      server.process_request(request, remote, remote_port, local, local_port, true, closed, nullptr);
    }
  }
};

}  // namespace phantom::web
