// What the operator's page reads of a request: host names and addresses, cookies, commands and requests for a
// view. The first octet chooses which; the rest is the text.

#include <arpa/inet.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>

#include "common/web/page_sessions.hpp"
#include "common/web/request_origin.hpp"
#include "components/synthetic_viewer/page/commands.hpp"

namespace {

using namespace phantom;
using namespace phantom::synthetic_viewer;

void need(bool holds) {
  if (!holds) std::abort();
}

void check_authority(const std::string& text) {
  const auto parsed = web::parse_authority(text);
  if (!parsed) return;
  const bool six = parsed->host.find(':') != std::string::npos;
  const std::string written =
      (six ? "[" + parsed->host + "]" : parsed->host) + (parsed->port.empty() ? "" : ":" + parsed->port);
  need(web::parse_authority(written) == parsed);
  need(!parsed->address || parsed->address->octets.size() == (six ? 16U : 4U));
  const web::OriginRule rule({"viewer.example"}, "https");
  const web::RequestOrigin request{
      .hosts = {text}, .origin = {}, .fetch_site = {}, .served_address = "10.0.0.1"};
  if (rule.host_of(request))
    need(parsed->address ? parsed->address->is_loopback() || parsed->host == "10.0.0.1"
                         : parsed->host == "localhost" || parsed->host == "viewer.example");
  need(rule.is_origin("https://" + text, *parsed));
  need(!rule.is_origin("http://" + text, *parsed));
}

void check_address(const std::string& text) {
  const auto parsed = web::parse_address(text);
  if (!parsed) return;
  need(parsed->octets.size() == 4 || parsed->octets.size() == 16);
  char written[INET6_ADDRSTRLEN];
  need(inet_ntop(parsed->octets.size() == 4 ? AF_INET : AF_INET6, parsed->octets.data(), written,
                 sizeof written) != nullptr);
  need(web::parse_address(written) == parsed);
  need(web::network_of(text) == web::network_of(written));
}

/// The value of a cookie, by the letter: the first part between semicolons that begins with "name=".
std::string literal_cookie(const std::string& header, const std::string& name) {
  std::istringstream parts(header);
  for (std::string part; std::getline(parts, part, ';');) {
    part.erase(0, part.find_first_not_of(' '));
    if (part.starts_with(name + "=")) return part.substr(name.size() + 1);
  }
  return "";
}

void check_command(const std::string& text) {
  const auto command = parse_command(text);
  if (!command) return need(!command.status().message().empty());
  need(std::isfinite(command->value) &&
       phantom::teleop::value_refusal(command->kind, command->value).empty());
  const nlohmann::json written{{"kind", phantom::teleop::rule_of(command->kind).name},
                               {"value", command->value}};
  const auto again = parse_command(written.dump());
  need(again && again->kind == command->kind && again->value == command->value);
}

void check_view_request(const std::string& text) {
  const auto request = parse_view_request(text);
  if (!request) return need(!request.status().message().empty());
  need(std::abs(request->azimuth_rad) <= std::numbers::pi + 1e-9);
  need(std::abs(request->elevation_rad) <= std::numbers::pi + 1e-9);
  need(request->zoom >= 0.1 && request->zoom <= 10);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(bytes + 1), size - 1);
  switch (bytes[0] % 5) {
    case 0:
      check_authority(text);
      break;
    case 1:
      check_address(text);
      break;
    case 2:
      need(web::cookie_of(text, "phantom_8080") == literal_cookie(text, "phantom_8080"));
      break;
    case 3:
      check_command(text);
      break;
    default:
      check_view_request(text);
  }
  return 0;
}
