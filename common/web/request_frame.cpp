#include "common/web/request_frame.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <utility>

#include "common/core/text.hpp"

namespace phantom::web {
namespace {

constexpr std::size_t kMaxHeaders = 64;
constexpr int kBadRequest = 400;

constexpr std::array<std::string_view, 12> kUsed{
    "host",           "origin",  "sec-fetch-site",    "content-type",
    "content-length", "cookie",  "if-none-match",     "user-agent",
    "connection",     "upgrade", "sec-websocket-key", "sec-websocket-version"};

bool is_token(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("!#$%&'*+-.^_`|~").find(static_cast<char>(c)) != std::string_view::npos;
  });
}

bool is_visible(char c) { return c > ' ' && c != 0x7F; }

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

/// Takes the first line off a head, without its end.
std::string_view take_line(std::string_view& head) {
  const auto end = head.find("\r\n");
  const std::string_view line = head.substr(0, end);
  head.remove_prefix(end + 2);
  return line;
}

/// Reads a head, line by line.
class HeadReader {
 public:
  HeadReader(RequestFrame& frame, const RequestLimits& limits) : frame_(frame), limits_(limits) {}

  /// `head`: up to and with the empty line.
  void read(std::string_view head) {
    if (has_control(head)) return refuse(kBadRequest, "the head of the request has a control character");
    request_line(take_line(head));
    for (std::size_t count = 0; frame_.status == 0 && head != "\r\n"; ++count) {
      if (count == kMaxHeaders) return refuse(431, "at most 64 headers are taken");
      header(take_line(head));
    }
    if (frame_.status == 0) check();
  }
  std::size_t length() const { return length_.value_or(0); }

 private:
  static bool is_control(char c) { return (static_cast<unsigned char>(c) < ' ' && c != '\t') || c == 0x7F; }
  /// Whether a control character stands elsewhere than in an end of line.
  static bool has_control(std::string_view head) {
    for (std::size_t i = 0; i < head.size(); ++i) {
      if (!is_control(head[i])) continue;
      if (head[i] != '\r' || i + 1 == head.size() || head[i + 1] != '\n') return true;
      ++i;
    }
    return false;
  }
  void refuse(int status, std::string reason) { frame_ = RequestFrame::refused(status, std::move(reason)); }

  void request_line(std::string_view line) {
    const auto first = line.find(' '), last = line.rfind(' ');
    if (first == std::string_view::npos || first == last)
      return refuse(kBadRequest, "the request line is not 'METHOD /path HTTP/1.1'");
    const std::string_view method = line.substr(0, first), version = line.substr(last + 1);
    const std::string_view target = line.substr(first + 1, last - first - 1);
    if (version != "HTTP/1.1" && version != "HTTP/1.0") return refuse(505, "HTTP/1.1 is expected");
    if (method != "GET" && method != "HEAD" && method != "POST")
      return refuse(405, "GET, HEAD and POST are taken");
    if (!target.starts_with('/') || !std::all_of(target.begin(), target.end(), is_visible))
      return refuse(kBadRequest, "the target of the request must be an absolute path");
    frame_.method = method;
    frame_.path = target.substr(0, target.find('?'));
    frame_.text.append(line).append("\r\n");
  }

  void header(std::string_view line) {
    const auto colon = line.find(':');
    if (colon == std::string_view::npos || !is_token(line.substr(0, colon)))
      return refuse(kBadRequest, "a header is not 'Name: value'");
    const std::string name = core::lower_case(line.substr(0, colon));
    const std::string_view value = trimmed(line.substr(colon + 1));
    if (name == "transfer-encoding") return refuse(411, "a body must announce its Content-Length");
    if (name == "content-encoding") return refuse(415, "compressed bodies are not taken");
    if (name == "expect") return refuse(417, "no expectation can be met");
    const auto used = std::find(kUsed.begin(), kUsed.end(), name);
    if (used == kUsed.end()) return;
    bool& seen = seen_[static_cast<std::size_t>(used - kUsed.begin())];
    if (std::exchange(seen, true)) return refuse(kBadRequest, "the header " + name + " stands there twice");
    // The library would decode %XX in it, and pass over it if it is empty.
    const bool origin = name == "host" || name == "origin" || name == "sec-fetch-site";
    if (origin && (value.empty() || value.find('%') != std::string_view::npos))
      return refuse(kBadRequest, "the header " + name + " is empty or has a '%'");
    if (name == "content-length" && !read_length(value)) return;
    frame_.text.append(name).append(": ").append(value).append("\r\n");
  }

  bool read_length(std::string_view value) {
    const bool digits = !value.empty() && std::all_of(value.begin(), value.end(),
                                                      [](unsigned char c) { return std::isdigit(c) != 0; });
    if (!digits) {
      refuse(kBadRequest, "Content-Length is not a number");
      return false;
    }
    if (value.size() > 9 || std::stoul(std::string(value)) > limits_.body) {
      refuse(413, "a body has at most " + std::to_string(limits_.body) + " octets");
      return false;
    }
    length_ = std::stoul(std::string(value));
    return true;
  }

  void check() {
    if (!seen_[0]) return refuse(kBadRequest, "the request names no host");
    if (frame_.method == "POST" && !length_) return refuse(411, "a body must announce its Content-Length");
    if (frame_.method != "POST" && length() > 0) return refuse(kBadRequest, "only POST has a body");
    frame_.text.append("\r\n");
  }

  RequestFrame& frame_;
  const RequestLimits& limits_;
  std::array<bool, kUsed.size()> seen_{};
  std::optional<std::size_t> length_;
};

}  // namespace

RequestFrame RequestFrame::refused(int status, std::string reason) {
  RequestFrame frame;
  frame.state = State::kRefused;
  frame.status = status;
  frame.reason = std::move(reason);
  return frame;
}

RequestFrame frame_request(std::string_view octets, const RequestLimits& limits) {
  const auto end = octets.substr(0, limits.head).find("\r\n\r\n");
  if (end == std::string_view::npos) {
    if (octets.size() < limits.head) return {};
    return RequestFrame::refused(
        431, "request line and headers have at most " + std::to_string(limits.head) + " octets");
  }
  const std::size_t head = end + 4;
  RequestFrame frame;
  HeadReader reader(frame, limits);
  reader.read(octets.substr(0, head));
  if (frame.state == RequestFrame::State::kRefused || octets.size() < head + reader.length()) return frame;
  frame.body = octets.substr(head, reader.length());
  frame.text.append(frame.body);
  frame.state = RequestFrame::State::kComplete;
  return frame;
}

}  // namespace phantom::web
