#include "common/web/page_access.hpp"

#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "common/core/clock.hpp"
#include "common/web/request_origin.hpp"

namespace phantom::web {

using Json = nlohmann::json;
using httplib::Request;
using httplib::Response;

void answer(Response& response, int status, const std::string& message) {
  response.status = status;
  response.set_content(Json{{"ok", status == 200}, {"message", message}}.dump(), "application/json");
}

void PageAccess::add_to(httplib::Server& server, Refusal refusal) {
  server.Get("/session", [this](const Request& request, Response& response) {
    describe(response, 200, role_of(request));
  });
  server.Post("/login", [this, refusal](const Request& request, Response& response) {
    if (const std::string reason = refusal(request); !reason.empty()) return answer(response, 403, reason);
    log_in(request, response);
  });
  server.Post("/logout", [this, refusal](const Request& request, Response& response) {
    if (const std::string reason = refusal(request); !reason.empty()) return answer(response, 403, reason);
    sessions_.close(token_of(request));
    set_cookie(response, "", 0);
    describe(response, 200, std::nullopt);
  });
}

void PageAccess::log_in(const Request& request, Response& response) {
  if (!sessions_.needed()) return answer(response, 409, "no secrets are configured (page.secrets)");
  const Json json = Json::parse(request.body, nullptr, false);
  if (!json.is_object() || json.size() != 1 || !json.contains("secret") || !json["secret"].is_string())
    return answer(response, 400, R"(a JSON object {"secret": "…"} is expected)");
  const std::string network = network_of(request.remote_addr);
  if (const int wait_s = guard_.take(network, core::monotonic_ns()); wait_s > 0) {
    response.set_header("Retry-After", std::to_string(wait_s));
    return answer(response, 429, "too many wrong secrets; try again in " + std::to_string(wait_s) + " s");
  }
  const auto opened = sessions_.open(json["secret"].get<std::string>(), core::monotonic_ns());
  if (!opened) {
    spdlog::warn("{} has sent a wrong secret to the operator's page", request.remote_addr);
    return answer(response, 401, "this is none of the page's secrets");
  }
  guard_.give_back(network);
  sessions_.close(token_of(request));
  set_cookie(response, opened->token, PageSessions::kLife_ns);
  describe(response, 200, opened->role);
}

bool PageAccess::may(const Request& request, Response& response, Role least) {
  if (!sessions_.needed()) return true;
  const auto role = role_of(request);
  if (!role) {
    answer(response, 401, "log in on the page first");
    return false;
  }
  if (*role >= least) return true;
  answer(response, 403,
         "this needs the role " + name_of(least) + "; this session has the role " + name_of(*role));
  return false;
}

std::string PageAccess::token_of(const Request& request) const {
  return cookie_of(request.get_header_value("Cookie"), cookie_name_);
}

bool PageAccess::lasts(const std::string& token, Role least) {
  if (!sessions_.needed()) return true;
  const auto role = sessions_.role_of(token, core::monotonic_ns());
  return role && *role >= least;
}

std::optional<Role> PageAccess::role_of(const Request& request) {
  return sessions_.role_of(token_of(request), core::monotonic_ns());
}

void PageAccess::describe(Response& response, int status, std::optional<Role> role) const {
  const Json name = role ? Json(name_of(*role)) : Json();
  response.status = status;
  response.set_content(Json{{"ok", status == 200}, {"secrets", sessions_.needed()}, {"role", name}}.dump(),
                       "application/json");
}

// The cookie is for this host alone, out of reach of scripts, not sent by pages from elsewhere, and with TLS
// never sent without.
void PageAccess::set_cookie(Response& response, const std::string& token, core::Nanoseconds life_ns) const {
  response.set_header("Set-Cookie", cookie_name_ + "=" + token + "; Path=/; HttpOnly; SameSite=Strict; " +
                                        (encrypted_ ? "Secure; " : "") +
                                        "Max-Age=" + std::to_string(life_ns / core::kNsPerSecond));
}

}  // namespace phantom::web
