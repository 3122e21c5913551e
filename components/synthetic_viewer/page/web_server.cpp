#include "components/synthetic_viewer/page/web_server.hpp"

#include <httplib.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <utility>

#include "common/web/page_access.hpp"
#include "common/web/page_requests.hpp"
#include "common/web/request_gate.hpp"
#include "common/web/request_origin.hpp"
#include "common/web/web_socket.hpp"
#include "components/synthetic_viewer/page/commands.hpp"
#include "components/synthetic_viewer/page/page_files.hpp"
#include "components/synthetic_viewer/page/page_routes.hpp"
#include "components/synthetic_viewer/stream/scene_feed.hpp"

namespace phantom::synthetic_viewer {

namespace assets {  // files of web/
extern const char* const kIndexHtml;
extern const char* const kEnglishTexts;
extern const char* const kGermanTexts;
extern const unsigned char kSceneBundle[];   // by gzip; made by web/scene/bundle.mjs
extern const std::size_t kSceneBundleBytes;  // 0: built without
}  // namespace assets

namespace {

using httplib::Request;
using httplib::Response;

constexpr int kThreads = 16;      // the stop has its own
constexpr int kSpareThreads = 4;  // for refusing further followers of streams
constexpr int kUpgradeRequired = 426;
constexpr int kHttpPort = 80, kHttpsPort = 443;  // left out of an origin
constexpr std::chrono::milliseconds kPatience{200};
constexpr std::chrono::milliseconds kPageWrite{5000}, kStreamWrite{15000};
// After this many times kPatience a still picture is sent again, so that a dead connection is noticed.
constexpr int kRepeatAfter = 5;

/// Returns the limits of the page's port and, with `streams`, of the other one.
web::GateLimits limits_of(const PageConfig& config, bool streams) {
  web::GateLimits limits;
  limits.connections = config.max_connections;
  limits.connections_per_address = config.max_connections_per_address;
  limits.workers = streams ? config.max_streams + kSpareThreads : kThreads;
  limits.write_time = streams ? kStreamWrite : kPageWrite;
  return limits;
}

/// Returns whether a request asks for the stop, which must wait for nothing else.
bool is_stop(const web::RequestFrame& request) {
  if (request.method != "POST" || request.path != "/command") return false;
  const auto command = parse_command(std::string(request.body));
  return command && command->kind == CommandKind::kEmergencyStop;
}

/// Returns a part of a motion JPEG. It ends with the next boundary, because browsers show a picture only once
/// they have its end.
std::string jpeg_part(const std::string& jpeg) {
  return "Content-Type: image/jpeg\r\nContent-Length: " + std::to_string(jpeg.size()) + "\r\n\r\n" + jpeg +
         "\r\n--picture\r\n";
}

/// Returns the host of an authority with another port, as it stands in a URL.
std::string with_port(const web::Authority& authority, const std::string& port) {
  const bool brackets = authority.host.find(':') != std::string::npos;
  return (brackets ? "[" + authority.host + "]" : authority.host) + ":" + port;
}

/// Returns whether a path of the page's port is given without a session: the page itself, its form to log in,
/// and who is stopped.
bool is_for_all(const std::string& path) {
  constexpr std::array<std::string_view, 4> kOthers{"/", "/stop", "/scene.js", "/session"};
  return std::ranges::find(kOthers, path) != kOthers.end() ||
         std::ranges::find(page_files(), path, &PageFile::path) != page_files().end();
}

void fill(std::string& text, const std::string& place, const std::string& content) {
  text.replace(text.find(place), place.size(), content);
}

/// Returns the page with all its texts, so that none is missing when the page is there, and with the port of
/// its streams.
std::string page_of(const std::string& stream_port) {
  std::string text = assets::kIndexHtml;
  fill(text, "{stream_port}", stream_port);
  fill(text, "{texts}",
       std::string("{\"en\": ") + assets::kEnglishTexts + ", \"de\": " + assets::kGermanTexts + "}");
  return text;
}

}  // namespace

struct WebServer::Impl {
  using Source = web::Broadcast<std::string>;

  PageConfig config;
  PageContent& content;
  SceneFeed* const scene;
  std::atomic<bool> stopping{false};
  std::atomic<int> followers{0};
  const std::string scheme{config.tls ? "https" : "http"};
  web::OriginRule origins{config.host_names, scheme};
  web::PageAccess access{config.secrets, config.tls != nullptr};
  PageRoutes routes;
  web::RequestGate page{"page", limits_of(config, false), is_stop, config.tls.get()};
  web::RequestGate streams{"page_streams", limits_of(config, true), nullptr, config.tls.get()};

  Impl(const PageConfig& page_config, PageContent& page_content, OnCommand on_command,
       OnViewRequest on_view_request, OnWorkspaceRequest on_workspace_request, SceneFeed* scene_feed)
      : config(page_config),
        content(page_content),
        scene(scene_feed),
        routes{content,
               access,
               config.allow_commands,
               std::move(on_command),
               std::move(on_view_request),
               std::move(on_workspace_request),
               [this](const Request& request) { return refusal(request); }} {
    check_readers();
    add_files();
    routes.add_to(page.server());
    access.add_to(page.server(), routes.refusal);
    add_streams();
    add_scene();
    page.bind(config.address, config.port, "page.port");
    access.name_cookie(page.port());
    streams.bind(config.address, config.stream_port, "page.stream_port");
    page.start();
    streams.start();
  }
  ~Impl() {
    stopping = true;
    page.stop();
    streams.stop();
    if (scene != nullptr) scene->end();  // its followers' places are of here
  }

  void check_readers();
  void add_files();
  void add_streams();
  void add_scene();
  /// Takes a place among the followers; null: all are taken, and the response says so.
  std::shared_ptr<const void> follower_place(Response& response);
  /// Returns why a request that changes something is refused, whoever makes it; empty if it is not.
  std::string refusal(const Request& request) const;
  void follow(const Request& request, Response& response, Source& source);
};

/// Lets no request pass to the handlers whose host is not this page's, or that a page from elsewhere makes.
void WebServer::Impl::check_readers() {
  for (web::RequestGate* served : {&page, &streams}) {
    web::set_common_answers(served->server(), "the viewer");
    served->server().set_pre_routing_handler([this, served](const Request& request, Response& response) {
      using enum httplib::Server::HandlerResponse;
      if (request.method == "POST") return Unhandled;  // refusal() decides, once the body has been read
      const web::RequestOrigin origin = web::origin_of(request);
      web::Authority own = origins.host_of(origin).value_or(web::Authority());
      const bool usual = page.port() == (config.tls ? kHttpsPort : kHttpPort);
      if (served == &streams) own.port = usual ? "" : std::to_string(page.port());
      const std::string refused = origins.read_refusal(origin, own, request.path != "/");
      if (!refused.empty()) return web::answer(response, 403, refused), Handled;
      const bool for_all = served == &page && is_for_all(request.path);
      return for_all || access.may(request, response, web::Role::kWatch) ? Unhandled : Handled;
    });
  }
}

void WebServer::Impl::add_files() {
  // The page comes with the address of its streams, and with a policy that allows the browser to load from
  // there and nowhere else.
  page.server().Get("/", [this](const Request& request, Response& response) {
    const std::string port = std::to_string(streams.port());
    const auto asked = origins.host_of(web::origin_of(request));
    const std::string authority = asked ? "://" + with_port(*asked, port) : "";
    const std::string from = asked ? " " + scheme + authority : "";
    const std::string socket = asked ? " " + (config.tls ? "wss" + authority : "ws" + authority) : "";
    response.set_header("Content-Security-Policy", "default-src 'self'; img-src 'self' data:" + from +
                                                       "; connect-src 'self'" + from + socket +
                                                       "; frame-ancestors 'none'");
    response.set_content(page_of(port), "text/html; charset=utf-8");
  });
  for (const PageFile& file : page_files())
    page.server().Get(std::string(file.path), [&file](const Request&, Response& response) {
      response.set_content(file.text, file.type);
    });
  page.server().Get("/scene.js", [](const Request&, Response& response) {
    if (assets::kSceneBundleBytes == 0)
      return web::answer(response, 404, "built without the browser's scene");
    response.set_header("Content-Encoding", "gzip");
    // Of this name, the library does not compress it once more.
    response.set_content(reinterpret_cast<const char*>(assets::kSceneBundle), assets::kSceneBundleBytes,
                         "application/x-javascript");
  });
}

std::string WebServer::Impl::refusal(const Request& request) const {
  return web::command_refusal(origins, request);
}

void WebServer::Impl::add_streams() {
  for (const View view : kViews) {
    streams.server().Get(std::string("/stream/") + name_of(view),
                         [this, view](const Request& request, Response& response) {
                           follow(request, response, content.view(view).jpeg);
                         });
  }
}

/// Sends each new picture of `source` for as long as the follower is connected and its session lasts.
void WebServer::Impl::follow(const Request& request, Response& response, Source& source) {
  const auto place = follower_place(response);
  if (!place) return;
  // The page's port is another origin; only that one may read streams, and others were refused.
  if (request.has_header("Origin")) {
    response.set_header("Access-Control-Allow-Origin", request.get_header_value("Origin"));
    response.set_header("Access-Control-Allow-Credentials", "true");  // the session's cookie
    response.set_header("Vary", "Origin");
  }
  source.followers.fetch_add(1);
  response.set_content_provider(
      "multipart/x-mixed-replace; boundary=picture",
      [this, place, &source, token = access.token_of(request), text = std::string("--picture\r\n"),
       last = Source::Content(), seen = std::uint64_t{0},
       idle = 0](std::size_t, httplib::DataSink& sink) mutable {
        if (stopping || !access.lasts(token)) {
          sink.done();
          return true;
        }
        if (auto next = source.next(seen, text.empty() ? kPatience : std::chrono::milliseconds(0))) {
          last = std::move(next);
          idle = 0;
          text += jpeg_part(*last);
        } else if (text.empty()) {
          if (++idle % kRepeatAfter != 0 || !last) return true;
          text = jpeg_part(*last);
        }
        const std::string sent = std::exchange(text, {});
        return sink.write(sent.data(), sent.size());
      },
      [&source](bool) { source.followers.fetch_sub(1); });
}

std::shared_ptr<const void> WebServer::Impl::follower_place(Response& response) {
  if (followers.fetch_add(1) < config.max_streams)
    return {&followers, [](std::atomic<int>* count) { count->fetch_sub(1); }};
  followers.fetch_sub(1);
  web::answer(response, kUnavailable,
              "all " + std::to_string(config.max_streams) + " streams are taken (page.max_streams)");
  return nullptr;
}

void WebServer::Impl::add_scene() {
  streams.server().Get("/scene", [this](const Request& request, Response& response) {
    const auto accept = web::web_socket_accept(request.get_header_value("Sec-WebSocket-Key"));
    const bool asked =
        web::asks_for_web_socket(request.get_header_value("Upgrade"), request.get_header_value("Connection"),
                                 request.get_header_value("Sec-WebSocket-Version"));
    if (!asked || !accept) {
      response.set_header("Sec-WebSocket-Version", "13");
      return web::answer(response, kUpgradeRequired, "a WebSocket (RFC 6455, version 13) is expected");
    }
    if (scene == nullptr) return web::answer(response, kUnavailable, "no scene is served here");
    auto place = follower_place(response);
    if (!place) return;
    auto lasts = [this, token = access.token_of(request)] { return access.lasts(token); };
    auto may_lead = [this, token = access.token_of(request)] {
      return config.allow_commands && access.lasts(token, web::Role::kOperate);
    };
    web::RequestGate::switch_protocol(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Accept: " +
            *accept + "\r\n\r\n",
        [this, lasts = std::move(lasts), may_lead = std::move(may_lead),
         place = std::move(place)](web::Channel channel) mutable {
          scene->take({std::move(channel), std::move(lasts), std::move(place), std::move(may_lead)});
        });
  });
}

WebServer::WebServer(const PageConfig& config, PageContent& content, OnCommand on_command,
                     OnViewRequest on_view_request, OnWorkspaceRequest on_workspace_request, SceneFeed* scene)
    : impl_(std::make_unique<Impl>(config, content, std::move(on_command), std::move(on_view_request),
                                   std::move(on_workspace_request), scene)) {}

WebServer::~WebServer() = default;

int WebServer::port() const { return impl_->page.port(); }
int WebServer::stream_port() const { return impl_->streams.port(); }

std::vector<core::LoopStatistics> WebServer::progress() const {
  return {impl_->page.progress(), impl_->streams.progress()};
}

std::string WebServer::url() const {
  const bool everywhere = impl_->config.address == "0.0.0.0" || impl_->config.address == "::";
  std::string host = everywhere ? "127.0.0.1" : impl_->config.address;
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  return impl_->scheme + "://" + host + ":" + std::to_string(port()) + "/";
}

}  // namespace phantom::synthetic_viewer
