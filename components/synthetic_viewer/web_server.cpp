#include "components/synthetic_viewer/web_server.hpp"

#include <algorithm>
#include <atomic>
#include <nlohmann/json.hpp>

#include "common/core/clock.hpp"
#include "components/synthetic_viewer/commands.hpp"
#include "components/synthetic_viewer/page_state.hpp"
#include "components/synthetic_viewer/stream_server.hpp"
#include "components/synthetic_viewer/web_files.hpp"

namespace phantom::synthetic_viewer {
namespace {

// More threads than browsers hold idle connections, so that a stop always finds a free one.
constexpr int kThreads = 32;
constexpr int kSnapshotsAtOnce = 4;  // each occupies a thread until its picture is made

constexpr int kConflict = 409, kUnavailable = 503, kTimedOut = 504;

int status_of(CommandOutcome::Kind kind) {
  switch (kind) {
    case CommandOutcome::Kind::kDone:
      return 200;
    case CommandOutcome::Kind::kRefused:
      return kConflict;
    case CommandOutcome::Kind::kUnanswered:
      return kTimedOut;
  }
  return kTimedOut;
}

bool is_host_name(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '[' || c == ']' || c == ':';
  });
}

}  // namespace

struct WebServer::Impl {
  PageConfig config;
  PageContent& content;
  OnCommand on_command;
  OnViewRequest on_view_request;
  std::atomic<int> snapshots{0};
  std::unique_ptr<StreamServer> streams;
  HttpPort http{kThreads};

  Impl(const PageConfig& page, PageContent& page_content, OnCommand command, OnViewRequest view_request)
      : config(page),
        content(page_content),
        on_command(std::move(command)),
        on_view_request(std::move(view_request)) {}

  void set_up();
  void page(const httplib::Request& request, httplib::Response& response) const;
  void add_pictures();
  void add_states();
  void command(const httplib::Request& request, httplib::Response& response);
  void view_request(const httplib::Request& request, httplib::Response& response);
  /// Returns whether a request that may change something is allowed. If not, fills the response with the
  /// refusal.
  bool permitted(const httplib::Request& request, httplib::Response& response) const;
  /// Returns why a request that may change something does not come from the page itself; empty if it does.
  std::string foreign(const httplib::Request& request) const;
};

void WebServer::Impl::set_up() {
  http.server.Get(
      "/", [this](const httplib::Request& request, httplib::Response& response) { page(request, response); });
  const auto serve = [this](const char* path, const char* text, const char* type) {
    http.server.Get(path, [text, type](const httplib::Request&, httplib::Response& response) {
      response.set_content(text, type);
    });
  };
  serve("/page.css", web::kPageCss, "text/css; charset=utf-8");
  serve("/page.js", web::kPageJs, "text/javascript; charset=utf-8");
  serve("/stop.js", web::kStopJs, "text/javascript; charset=utf-8");
  add_pictures();
  add_states();
  http.server.Post("/command", [this](const httplib::Request& request, httplib::Response& response) {
    command(request, response);
  });
  http.server.Post("/view", [this](const httplib::Request& request, httplib::Response& response) {
    view_request(request, response);
  });
}

/// Sends the page with the address of its streams, and a policy that allows the browser to load from there
/// and nowhere else.
void WebServer::Impl::page(const httplib::Request& request, httplib::Response& response) const {
  const std::string port = std::to_string(streams->port());
  const std::string host = host_name_of(request.get_header_value("Host"));
  const std::string from = is_host_name(host) ? " http://" + host + ":" + port : "";
  response.set_header("Content-Security-Policy", "default-src 'self'; img-src 'self' data:" + from +
                                                     "; connect-src 'self'" + from +
                                                     "; frame-ancestors 'none'");
  std::string text = web::kIndexHtml;
  const std::string place = "{stream_port}";
  text.replace(text.find(place), place.size(), port);
  response.set_content(text, "text/html; charset=utf-8");
}

void WebServer::Impl::add_pictures() {
  http.server.Get("/snapshot/main.png", [this](const httplib::Request&, httplib::Response& response) {
    struct Place {
      std::atomic<int>& taken;
      const bool free = taken.fetch_add(1) < kSnapshotsAtOnce;
      ~Place() { taken.fetch_sub(1); }
    } const place{snapshots};
    if (!place.free) return answer(response, kUnavailable, "too many ask for pictures at once");
    const std::string png = content.main_png ? content.main_png() : std::string();
    if (png.empty()) return answer(response, kUnavailable, "there is no picture yet");
    response.set_content(png, "image/png");
  });
  http.server.Get(R"(/hits/(\d{1,9})\.jpg)",
                  [this](const httplib::Request& request, httplib::Response& response) {
                    const auto alert = static_cast<std::uint32_t>(std::stoul(request.matches[1].str()));
                    const std::string jpeg = content.hit_picture ? content.hit_picture(alert) : std::string();
                    if (jpeg.empty())
                      return answer(response, 404, "there is no picture of alert " + std::to_string(alert));
                    response.set_content(jpeg, "image/jpeg");
                  });
}

void WebServer::Impl::add_states() {
  http.server.Get("/stop", [this](const httplib::Request&, httplib::Response& response) {
    response.set_content(stop_json(content.stops ? content.stops() : StopView()), "application/json");
  });
  http.server.Get("/state", [this](const httplib::Request&, httplib::Response& response) {
    content.ask_state(core::monotonic_ns());
    const auto newest = content.state_json.newest();
    if (!newest) return answer(response, kUnavailable, "there is no state yet");
    response.set_content(*newest, "application/json");
  });
}

std::string WebServer::Impl::foreign(const httplib::Request& request) const {
  const std::string host = request.get_header_value("Host"), origin = request.get_header_value("Origin");
  // A page from elsewhere in the same browser must not control the arm. It cannot send this content type
  // without a preflight request, its origin differs, and a DNS name rebound to this host is not a loopback
  // name.
  if (request.get_header_value("Content-Type").rfind("application/json", 0) != 0) {
    return "the content type must be application/json";
  }
  if (!origin.empty() && origin != "http://" + host)
    return "commands are taken from the operator's page only";
  if (is_loopback_address(config.address) && !is_loopback_name(host))
    return "commands must name this host as " + config.address;
  return {};
}

bool WebServer::Impl::permitted(const httplib::Request& request, httplib::Response& response) const {
  if (const std::string reason = foreign(request); !reason.empty()) {
    answer(response, 403, reason);
    return false;
  }
  if (!config.allow_commands) {
    answer(response, 403, "this viewer only shows: page.allow_commands is false in its configuration");
    return false;
  }
  return true;
}

void WebServer::Impl::command(const httplib::Request& request, httplib::Response& response) {
  if (!permitted(request, response)) return;
  const auto parsed = parse_command(request.body);
  if (!parsed) return answer(response, 400, parsed.status().message());
  const CommandOutcome outcome = on_command(*parsed);
  answer(response, status_of(outcome.kind), outcome.message);
}

void WebServer::Impl::view_request(const httplib::Request& request, httplib::Response& response) {
  if (!permitted(request, response)) return;
  const auto parsed = parse_view_request(request.body);
  if (!parsed) return answer(response, 400, parsed.status().message());
  const core::Status done = on_view_request(*parsed);
  answer(response, done.is_ok() ? 200 : kUnavailable, done.is_ok() ? "done" : done.message());
}

WebServer::WebServer(const PageConfig& config, PageContent& content, OnCommand on_command,
                     OnViewRequest on_view_request)
    : impl_(std::make_unique<Impl>(config, content, std::move(on_command), std::move(on_view_request))) {
  impl_->set_up();
  impl_->http.bind(config.address, config.port, "page.port");
  impl_->streams = std::make_unique<StreamServer>(config, impl_->http.port(), content);
  impl_->http.start();
}

WebServer::~WebServer() { impl_->http.stop(); }

int WebServer::port() const { return impl_->http.port(); }
int WebServer::stream_port() const { return impl_->streams->port(); }

std::string WebServer::url() const {
  const bool everywhere = impl_->config.address == "0.0.0.0" || impl_->config.address == "::";
  std::string host = everywhere ? "127.0.0.1" : impl_->config.address;
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  return "http://" + host + ":" + std::to_string(port()) + "/";
}

}  // namespace phantom::synthetic_viewer
