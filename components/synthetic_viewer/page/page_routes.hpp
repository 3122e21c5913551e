#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "components/synthetic_viewer/page/web_server.hpp"
#include "components/synthetic_viewer/stream/page_content.hpp"

namespace httplib {
class Server;
struct Request;
}  // namespace httplib

namespace phantom::web {
class PageAccess;
}  // namespace phantom::web

namespace phantom::synthetic_viewer {

/// Status of what cannot be answered now.
inline constexpr int kUnavailable = 503;

/// Answers what WebServer lists for the page's port, but for its files and its session: pictures, meshes,
/// fluid, states, commands, a recording and a calibration. It must outlive the servers that it is added to.
struct PageRoutes {
  PageContent& content;
  web::PageAccess& access;
  bool allow_commands;  ///< else what is posted is refused
  WebServer::OnCommand on_command;
  WebServer::OnViewRequest on_view_request;
  WebServer::OnWorkspaceRequest on_workspace_request;
  std::function<std::string(const httplib::Request&)> refusal;  ///< as PageAccess::Refusal
  std::atomic<int> snapshots{0};                                ///< that are made now

  void add_to(httplib::Server& server);

 private:
  void add_pictures(httplib::Server& server);
  void add_meshes(httplib::Server& server);
  void add_fluid(httplib::Server& server);
  void add_states(httplib::Server& server);
  void add_requests(httplib::Server& server);
  void add_review(httplib::Server& server);
  void add_calibration(httplib::Server& server);
  template <class Parse, class RoleNeeded, class CarryOut>
  void take(httplib::Server& server, const char* path, Parse parse, RoleNeeded role_needed,
            CarryOut carry_out);
};

}  // namespace phantom::synthetic_viewer
