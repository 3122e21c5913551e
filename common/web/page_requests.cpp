#include "common/web/page_requests.hpp"

#include <optional>

#include "common/web/page_access.hpp"

namespace phantom::web {
namespace {

std::optional<std::string> header(const httplib::Request& request, const char* name) {
  return request.has_header(name) ? std::optional(request.get_header_value(name)) : std::nullopt;
}

}  // namespace

void set_common_answers(httplib::Server& server, const std::string& who) {
  server.set_default_headers({{"Cache-Control", "no-store"}, {"X-Content-Type-Options", "nosniff"}});
  server.set_error_handler([](const httplib::Request& request, httplib::Response& response) {
    if (!response.body.empty()) return;
    answer(response, response.status,
           response.status == 404 ? "unknown path " + request.path : "request refused");
  });
  server.set_exception_handler(
      [who](const httplib::Request&, httplib::Response& response, const std::exception_ptr&) {
        answer(response, 500, who + " could not answer");
      });
}

RequestOrigin origin_of(const httplib::Request& request) {
  RequestOrigin origin{.hosts = {},
                       .origin = header(request, "Origin"),
                       .fetch_site = header(request, "Sec-Fetch-Site"),
                       .served_address = request.local_addr};
  const auto hosts = request.headers.equal_range("Host");
  for (auto host = hosts.first; host != hosts.second; ++host) origin.hosts.push_back(host->second);
  return origin;
}

std::string command_refusal(const OriginRule& rule, const httplib::Request& request) {
  if (request.get_header_value("Content-Type").rfind("application/json", 0) != 0)
    return "the content type must be application/json";
  return rule.command_refusal(origin_of(request));
}

}  // namespace phantom::web
