#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace phantom::web {

/// An IP address of four or sixteen octets; an IPv4 address mapped into IPv6 is kept as IPv4.
struct IpAddress {
  std::string octets;

  bool is_loopback() const;
  friend bool operator==(const IpAddress&, const IpAddress&) = default;
};

/// Reads an address as the kernel writes it: "127.0.0.1", "::1", "::ffff:127.0.0.1". Returns nothing for any
/// other text.
std::optional<IpAddress> parse_address(const std::string& text);

/// Returns what the addresses that one host may have have in common, for counting: the octets of an IPv4
/// address, or of an IPv6 one's /64 network; of a text that is no address the text.
std::string network_of(const std::string& address);

/// What a Host header names.
struct Authority {
  std::string host;                  ///< lower case; an IPv6 address without its brackets
  std::optional<IpAddress> address;  ///< set if the host is an IP address
  std::string port;                  ///< decimal, without leading zeros; empty: the scheme's own

  friend bool operator==(const Authority&, const Authority&) = default;
};

/// Parses "name", "name:8080", "127.0.0.1:8080" or "[::1]:8080" (RFC 9110, 7.2). Refuses whatever browsers do
/// not send: user information, an empty or dangling name or port, a trailing dot, numbers that stand for an
/// address but are not four decimal ones (127.1, 0x7f.0.0.1, 2130706433), IPv4 mapped into IPv6, zones.
std::optional<Authority> parse_authority(std::string_view text);

/// The headers of a request by which it is told where it comes from. Absent: nothing.
struct RequestOrigin {
  std::vector<std::string> hosts;  ///< all Host headers
  std::optional<std::string> origin;
  std::optional<std::string> fetch_site;  ///< Sec-Fetch-Site
  std::string served_address;             ///< local address of the connection
};

/// Decides which requests are the operator's page's own. A page from elsewhere in the same browser must not
/// read what the viewer shows and must not control the arm, not even under a DNS name that its owner has
/// rebound to this host: a name is compared with those of the configuration, an address as an address.
/// Thread-safe; throws nothing.
class OriginRule {
 public:
  /// `names`: further host names, or addresses, under which the page may be asked for, without port.
  /// `scheme`: "http" or "https".
  OriginRule(const std::vector<std::string>& names, std::string scheme);

  /// Returns the host that a request names, if it is localhost, an address of loopback, the address that the
  /// request has reached, or one of the configured names.
  std::optional<Authority> host_of(const RequestOrigin& request) const;
  /// Returns whether the origin is scheme, host and port of `page`.
  bool is_origin(const std::string& origin, const Authority& page) const;
  /// Returns why a request that reads is refused; empty if it is not. `page`: the authority of the page
  /// itself, whose Origin may read. `embedded`: the answer is loaded by a page and is not one by itself.
  std::string read_refusal(const RequestOrigin& request, const Authority& page, bool embedded) const;
  /// Returns why a request that changes something is refused; empty if it is not.
  std::string command_refusal(const RequestOrigin& request) const;

 private:
  std::vector<Authority> names_;
  std::string scheme_;
};

}  // namespace phantom::web
