#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace phantom::web {

/// Greatest sizes of a request, in octets as they come over the network.
struct RequestLimits {
  std::size_t head = 8192;  ///< request line and headers
  std::size_t body = 4096;
};

/// What the octets of a connection are, as far as they have come.
struct RequestFrame {
  enum class State { kIncomplete, kComplete, kRefused };
  State state = State::kIncomplete;
  std::string method, path;  ///< path without the query; of a complete request
  std::string text;       ///< of a complete request: its head, with the headers that are used, and its body
  std::string_view body;  ///< part of the octets given
  int status = 0;         ///< HTTP status of a refusal
  std::string reason;     ///< why, and what is allowed

  static RequestFrame refused(int status, std::string reason);
};

/// Finds the first request (RFC 9112) in what a connection has sent. Takes less than the standard allows, so
/// that no two parsers can differ about a request, and so that it is bounded before anything is read into it:
/// GET, HEAD and POST of an absolute path; lines that end with CR LF; no control characters; each header that
/// is used once at most; a body of POST only, in the length that it announces, neither chunked nor
/// compressed. `text` keeps only the headers that the page's server uses. Pure; allocates at most the limits'
/// sum.
RequestFrame frame_request(std::string_view octets, const RequestLimits& limits);

}  // namespace phantom::web
