#include "common/web/request_origin.hpp"

#include <arpa/inet.h>

#include <algorithm>

#include "common/core/text.hpp"

namespace phantom::web {
namespace {

constexpr std::size_t kMaxName = 253;  // of a DNS name, RFC 1035

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_name_octet(char c) { return is_digit(c) || (c >= 'a' && c <= 'z') || c == '-' || c == '_'; }

/// Returns whether a text in lower case is a DNS name whose last label is no number: browsers read such a
/// name as an IPv4 address, in one of many spellings (URL standard, "ends in a number").
bool is_name(const std::string& host) {
  if (host.empty() || host.size() > kMaxName) return false;
  std::size_t begin = 0;
  std::string label;
  while (begin <= host.size()) {
    const std::size_t end = std::min(host.find('.', begin), host.size());
    label = host.substr(begin, end - begin);
    if (label.empty() || !std::all_of(label.begin(), label.end(), is_name_octet)) return false;
    begin = end + 1;
  }
  return !std::all_of(label.begin(), label.end(), is_digit) && !label.starts_with("0x");
}

std::optional<std::string> parse_port(std::string_view text) {
  if (text.empty() || text.size() > 5 || text[0] == '0' || !std::all_of(text.begin(), text.end(), is_digit))
    return std::nullopt;
  return std::stoi(std::string(text)) <= 65535 ? std::optional(std::string(text)) : std::nullopt;
}

std::optional<IpAddress> address_of_family(int family, std::size_t octets, const std::string& text) {
  IpAddress address{std::string(octets, '\0')};
  if (text.find('\0') != std::string::npos) return std::nullopt;  // inet_pton would not see what follows
  if (inet_pton(family, text.c_str(), address.octets.data()) != 1) return std::nullopt;
  return address;
}

}  // namespace

bool IpAddress::is_loopback() const {
  return octets.size() == 4 ? octets[0] == 127
                            : octets == std::string_view("\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\1", 16);
}

std::optional<IpAddress> parse_address(const std::string& text) {
  if (auto four = address_of_family(AF_INET, 4, text)) return four;
  auto six = address_of_family(AF_INET6, 16, text);
  static const std::string kMapped = std::string(10, '\0') + "\xFF\xFF";
  if (six && six->octets.starts_with(kMapped)) six->octets.erase(0, kMapped.size());
  return six;
}

std::string network_of(const std::string& address) {
  const auto parsed = parse_address(address);
  return parsed ? parsed->octets.substr(0, parsed->octets.size() == 4 ? 4 : 8) : address;
}

std::optional<Authority> parse_authority(std::string_view text) {
  Authority authority;
  std::string_view host = text;
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    host = text.substr(1, end - 1);
    text.remove_prefix(end + 1);
    authority.address = address_of_family(AF_INET6, 16, std::string(host));
    // A mapped address has many spellings and no page needs it.
    if (!authority.address || parse_address(std::string(host)) != authority.address) return std::nullopt;
  } else {
    host = text.substr(0, text.find(':'));
    text.remove_prefix(host.size());
  }
  authority.host = core::lower_case(host);
  if (!authority.address) authority.address = address_of_family(AF_INET, 4, authority.host);
  if (!authority.address && !is_name(authority.host)) return std::nullopt;
  if (text.empty()) return authority;
  const auto port = text[0] == ':' ? parse_port(text.substr(1)) : std::nullopt;
  if (!port) return std::nullopt;
  authority.port = *port;
  return authority;
}

OriginRule::OriginRule(const std::vector<std::string>& names, std::string scheme)
    : scheme_(std::move(scheme)) {
  for (const std::string& name : names) {
    const bool six = name.find(':') != std::string::npos;
    if (auto authority = parse_authority(six ? "[" + name + "]" : name)) names_.push_back(*authority);
  }
}

std::optional<Authority> OriginRule::host_of(const RequestOrigin& request) const {
  if (request.hosts.size() != 1) return std::nullopt;
  auto asked = parse_authority(request.hosts[0]);
  if (!asked) return std::nullopt;
  const bool served = asked->address ? asked->address->is_loopback() ||
                                           asked->address == parse_address(request.served_address)
                                     : asked->host == "localhost";
  const bool configured = std::any_of(names_.begin(), names_.end(), [&](const Authority& name) {
    return asked->address ? name.address == asked->address : !name.address && name.host == asked->host;
  });
  return served || configured ? asked : std::nullopt;
}

bool OriginRule::is_origin(const std::string& origin, const Authority& page) const {
  const std::string scheme = scheme_ + "://";
  if (!origin.starts_with(scheme)) return false;
  return parse_authority(std::string_view(origin).substr(scheme.size())) == page;
}

std::string OriginRule::read_refusal(const RequestOrigin& request, const Authority& page,
                                     bool embedded) const {
  if (!host_of(request))
    return "the host of the request is none of this page's; allowed are localhost, the address served and "
           "page.host_names";
  if (!embedded) return "";
  const bool own = request.origin && is_origin(*request.origin, page);
  if (request.origin && !own) return "this is read by the operator's page only";
  // What comes from another origin without saying from which may be any page of this host's other ports.
  const bool elsewhere =
      request.fetch_site && *request.fetch_site != "same-origin" && *request.fetch_site != "none";
  return elsewhere && !own ? "this is shown on the operator's page only" : "";
}

std::string OriginRule::command_refusal(const RequestOrigin& request) const {
  const auto host = host_of(request);
  if (!host)
    return "commands must name this host; allowed are localhost, the address served and page.host_names";
  const bool own = (!request.origin || is_origin(*request.origin, *host)) &&
                   (!request.fetch_site || *request.fetch_site == "same-origin");
  return own ? "" : "commands are taken from the operator's page only";
}

}  // namespace phantom::web
