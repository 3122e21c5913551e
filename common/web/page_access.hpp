#pragma once

#include <httplib.h>
#undef _res  // a macro of resolv.h, which httplib.h includes: a name of Eigen's

#include <functional>
#include <optional>
#include <string>

#include "common/web/login_guard.hpp"
#include "common/web/page_sessions.hpp"

namespace phantom::web {

/// Sends the response {"ok": …, "message": …}.
void answer(httplib::Response& response, int status, const std::string& message);

/// Who a request comes from, by its session's cookie: logs in and out, and says what a session may.
/// Thread-safe once its cookie has a name.
class PageAccess {
 public:
  /// Returns why a request that changes something is refused, whoever makes it; empty if it is not.
  using Refusal = std::function<std::string(const httplib::Request&)>;

  /// `secrets`: none, and everybody may do everything. `encrypted`: the cookie is sent by TLS alone.
  PageAccess(std::optional<runtime::RoleSecrets> secrets, bool encrypted)
      : sessions_(std::move(secrets)), encrypted_(encrypted) {}

  /// Adds GET /session, POST /login and POST /logout.
  void add_to(httplib::Server& server, Refusal refusal);
  /// Cookies are those of a host with all its ports: the name tells this page's apart from others'.
  void name_cookie(int port) { cookie_name_ = "phantom_" + std::to_string(port); }
  /// Returns whether the request's session has at least this role. If not, answers so.
  bool may(const httplib::Request& request, httplib::Response& response, Role least);
  std::string token_of(const httplib::Request& request) const;
  /// Returns whether what was begun in a session may go on, for which at least this role is needed.
  bool lasts(const std::string& token, Role least = Role::kWatch);

 private:
  std::optional<Role> role_of(const httplib::Request& request);
  void describe(httplib::Response& response, int status, std::optional<Role> role) const;
  void set_cookie(httplib::Response& response, const std::string& token, core::Nanoseconds life_ns) const;
  void log_in(const httplib::Request& request, httplib::Response& response);

  PageSessions sessions_;
  LoginGuard guard_;
  bool encrypted_;
  std::string cookie_name_;
};

}  // namespace phantom::web
