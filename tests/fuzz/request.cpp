// Octets as a connection of the operator's page sends them: in whatever pieces they come, they are the same
// request or the same refusal; and what is passed on says to the HTTP library what it says to us.

#include <httplib.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "common/web/http_handlers.hpp"
#include "common/web/request_frame.hpp"

namespace {

using namespace phantom;
using State = web::RequestFrame::State;

void need(bool holds) {
  if (!holds) std::abort();
}

/// Feeds the octets as RequestGate does, in pieces whose lengths `seed` chooses.
web::RequestFrame in_pieces(std::string_view octets, const web::RequestLimits& limits, std::uint32_t seed) {
  std::string come;
  while (!octets.empty()) {
    seed = seed * 1664525U + 1013904223U;
    const std::size_t piece = std::min<std::size_t>(1 + (seed >> 24U) % 97U, octets.size());
    come.append(octets.substr(0, piece));
    octets.remove_prefix(piece);
    web::RequestFrame frame = web::frame_request(come, limits);
    if (frame.state == State::kIncomplete) continue;
    frame.body = {};  // part of what goes
    return frame;
  }
  return {};
}

/// The library's server, which reads a text instead of a connection and tells what it has read.
class Library {
 public:
  Library() {
    const auto keep = [this](const httplib::Request& request, httplib::Response&) { read_ = request; };
    server_.Get(".*", keep);
    server_.Post(".*", keep);
  }
  /// Empty method: the library has refused it.
  const httplib::Request& read(const std::string& text) {
    read_ = {};
    Text stream(text);
    server_.answer(stream);
    return read_;
  }

 private:
  struct Text final : httplib::Stream {
    explicit Text(const std::string& whole) : text(whole) {}
    bool is_readable() const override { return at < text.size(); }
    bool is_writable() const override { return true; }
    ssize_t read(char* data, std::size_t size) override {
      const std::size_t taken = text.copy(data, size, at);
      at += taken;
      return static_cast<ssize_t>(taken);
    }
    ssize_t write(const char*, std::size_t size) override { return static_cast<ssize_t>(size); }
    void get_remote_ip_and_port(std::string& ip, int& port) const override { ip = "127.0.0.1", port = 1; }
    void get_local_ip_and_port(std::string& ip, int& port) const override { ip = "127.0.0.1", port = 2; }
    int socket() const override { return -1; }
    const std::string& text;
    std::size_t at = 0;
  };
  web::HttpHandlers server_;
  httplib::Request read_;
};

void need_what_was_framed(const web::RequestFrame& frame) {
  static Library library;
  const httplib::Request& read = library.read(frame.text);
  if (read.method.empty()) return;
  need(read.method == frame.method || (frame.method == "HEAD" && read.method == "GET"));
  need(read.get_header_value_count("Host") == 1);
  need(read.get_header_value_count("Origin") <= 1 && read.get_header_value_count("Cookie") <= 1);
  // The library decodes the path and cuts off what follows a '#', which no path of ours has.
  if (frame.path.find_first_of("%#") == std::string::npos) need(read.path == frame.path);
  if (!read.is_multipart_form_data()) need(read.body == frame.body);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view octets(reinterpret_cast<const char*>(bytes + 1), size - 1);
  const web::RequestLimits limits = (bytes[0] & 1U) != 0 ? web::RequestLimits() : web::RequestLimits{256, 32};
  const web::RequestFrame whole = web::frame_request(octets, limits),
                          pieces = in_pieces(octets, limits, bytes[0]);
  need(pieces.state == whole.state && pieces.status == whole.status && pieces.reason == whole.reason);
  if (whole.state == State::kRefused) need(whole.status >= 400 && !whole.reason.empty());
  if (whole.state != State::kComplete) return 0;
  need(pieces.text == whole.text && pieces.method == whole.method && pieces.path == whole.path);
  need(whole.body.size() <= limits.body && whole.text.size() <= limits.head + limits.body + 2);
  need(whole.text.find("\r\n\r\n") + 4 + whole.body.size() == whole.text.size());
  const web::RequestFrame again = web::frame_request(whole.text, {limits.head + 2, limits.body});
  need(again.state == State::kComplete && again.text == whole.text && again.path == whole.path);
  need_what_was_framed(whole);
  return 0;
}
