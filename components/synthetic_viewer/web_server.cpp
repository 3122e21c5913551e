#include "components/synthetic_viewer/web_server.hpp"

#include <httplib.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/core/clock.hpp"
#include "components/synthetic_viewer/commands.hpp"
#include "components/synthetic_viewer/fluid_store.hpp"
#include "components/synthetic_viewer/page_access.hpp"
#include "components/synthetic_viewer/page_files.hpp"
#include "components/synthetic_viewer/page_review.hpp"
#include "components/synthetic_viewer/page_state.hpp"
#include "components/synthetic_viewer/pose_calibration.hpp"
#include "components/synthetic_viewer/request_gate.hpp"
#include "components/synthetic_viewer/request_origin.hpp"
#include "components/synthetic_viewer/scene_feed.hpp"
#include "components/synthetic_viewer/shaders_json.hpp"
#include "components/synthetic_viewer/web_socket.hpp"

namespace phantom::synthetic_viewer {

namespace web {  // files of web/
extern const char* const kIndexHtml;
extern const char* const kEnglishTexts;
extern const char* const kGermanTexts;
extern const unsigned char kSceneBundle[];   // by gzip; made by web/scene/bundle.mjs
extern const std::size_t kSceneBundleBytes;  // 0: built without
}  // namespace web

namespace {

using httplib::Request;
using httplib::Response;

constexpr int kThreads = 16;         // the stop has its own
constexpr int kSnapshotsAtOnce = 4;  // each occupies a thread until its picture is made
constexpr int kSpareThreads = 4;     // for refusing further followers of streams
constexpr int kNotModified = 304, kTooLarge = 413;
constexpr int kUnavailable = 503, kUpgradeRequired = 426;
constexpr int kHttpPort = 80, kHttpsPort = 443;        // left out of an origin
constexpr std::array kStatusOfOutcome{200, 409, 504};  // by CommandOutcome::Kind
constexpr std::chrono::milliseconds kPatience{200};
constexpr std::chrono::milliseconds kPageWrite{5000}, kStreamWrite{15000};
// After this many times kPatience a still picture is sent again, so that a dead connection is noticed.
constexpr int kRepeatAfter = 5;

/// A place among those whose picture is made now.
struct SnapshotPlace {
  std::atomic<int>& taken;
  const bool free = taken.fetch_add(1) < kSnapshotsAtOnce;
  ~SnapshotPlace() { taken.fetch_sub(1); }
};
constexpr const char* kTooManyPictures = "too many ask for pictures at once";

/// Says how long browsers may keep a response.
void let_keep(Response& response, const char* rule) {
  response.headers.erase("Cache-Control");
  response.set_header("Cache-Control", rule);
}

/// Sends octets that are packed by gzip already.
void send_packed(Response& response, const std::shared_ptr<const std::string>& octets, const char* type) {
  response.set_header("Content-Encoding", "gzip");
  response.set_content_provider(octets->size(), type,
                                [octets](std::size_t at, std::size_t size, httplib::DataSink& sink) {
                                  return sink.write(octets->data() + at, size);
                                });
}

/// Returns the limits of the page's port and, with `streams`, of the other one.
GateLimits limits_of(const PageConfig& config, bool streams) {
  GateLimits limits;
  limits.connections = config.max_connections;
  limits.connections_per_address = config.max_connections_per_address;
  limits.workers = streams ? config.max_streams + kSpareThreads : kThreads;
  limits.write_time = streams ? kStreamWrite : kPageWrite;
  return limits;
}

/// Returns whether a request asks for the stop, which must wait for nothing else.
bool is_stop(const RequestFrame& request) {
  if (request.method != "POST" || request.path != "/command") return false;
  const auto command = parse_command(std::string(request.body));
  return command && command->kind == CommandKind::kEmergencyStop;
}

/// Gives a server what all its answers have in common.
void set_common(httplib::Server& server) {
  server.set_default_headers({{"Cache-Control", "no-store"}, {"X-Content-Type-Options", "nosniff"}});
  server.set_error_handler([](const Request& request, Response& response) {
    if (!response.body.empty()) return;
    answer(response, response.status,
           response.status == 404 ? "unknown path " + request.path : "request refused");
  });
  server.set_exception_handler([](const Request&, Response& response, std::exception_ptr) {
    answer(response, 500, "the viewer could not answer");
  });
}

std::optional<std::string> header(const Request& request, const char* name) {
  return request.has_header(name) ? std::optional(request.get_header_value(name)) : std::nullopt;
}

RequestOrigin origin_of(const Request& request) {
  RequestOrigin origin{.hosts = {},
                       .origin = header(request, "Origin"),
                       .fetch_site = header(request, "Sec-Fetch-Site"),
                       .served_address = request.local_addr};
  const auto hosts = request.headers.equal_range("Host");
  for (auto host = hosts.first; host != hosts.second; ++host) origin.hosts.push_back(host->second);
  return origin;
}

/// Returns a part of a motion JPEG. It ends with the next boundary, because browsers show a picture only once
/// they have its end.
std::string jpeg_part(const std::string& jpeg) {
  return "Content-Type: image/jpeg\r\nContent-Length: " + std::to_string(jpeg.size()) + "\r\n\r\n" + jpeg +
         "\r\n--picture\r\n";
}

/// Returns the host of an authority with another port, as it stands in a URL.
std::string with_port(const Authority& authority, const std::string& port) {
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
  std::string text = web::kIndexHtml;
  fill(text, "{stream_port}", stream_port);
  fill(text, "{texts}",
       std::string("{\"en\": ") + web::kEnglishTexts + ", \"de\": " + web::kGermanTexts + "}");
  return text;
}

std::string event_of(const std::string& json) { return "data: " + json + "\n\n"; }

}  // namespace

struct WebServer::Impl {
  using Source = Broadcast<std::string>;

  PageConfig config;
  PageContent& content;
  OnCommand on_command;
  OnViewRequest on_view_request;
  OnCarryRequest on_carry_request;
  SceneFeed* const scene;
  std::atomic<bool> stopping{false};
  std::atomic<int> snapshots{0}, followers{0};
  const std::string scheme{config.tls ? "https" : "http"};
  OriginRule origins{config.host_names, scheme};
  PageAccess access{config.secrets, config.tls != nullptr};
  RequestGate page{"page", limits_of(config, false), is_stop, config.tls.get()};
  RequestGate streams{"page_streams", limits_of(config, true), nullptr, config.tls.get()};

  Impl(const PageConfig& page_config, PageContent& page_content, OnCommand command,
       OnViewRequest view_request, OnCarryRequest carry_request, SceneFeed* scene_feed)
      : config(page_config),
        content(page_content),
        on_command(std::move(command)),
        on_view_request(std::move(view_request)),
        on_carry_request(std::move(carry_request)),
        scene(scene_feed) {
    check_readers();
    add_files();
    add_pictures();
    add_fluid();
    add_states();
    add_requests();
    if (content.review != nullptr) add_review();
    if (content.calibration != nullptr) add_calibration();
    access.add_to(page.server(), [this](const Request& request) { return refusal(request); });
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
  void add_pictures();
  void add_fluid();
  void add_states();
  void add_requests();
  void add_review();
  void add_calibration();
  template <class Parse, class RoleNeeded, class CarryOut>
  void take(const char* path, Parse parse, RoleNeeded role_needed, CarryOut carry_out);
  void add_streams();
  void add_scene();
  /// Takes a place among the followers; null: all are taken, and the response says so.
  std::shared_ptr<const void> follower_place(Response& response);
  /// Returns why a request that changes something is refused, whoever makes it; empty if it is not.
  std::string refusal(const Request& request) const;
  void follow(const Request& request, Response& response, const char* type, Source& source,
              std::string opening, std::string (*packed)(const std::string&));
};

/// Lets no request pass to the handlers whose host is not this page's, or that a page from elsewhere makes.
void WebServer::Impl::check_readers() {
  for (RequestGate* served : {&page, &streams}) {
    set_common(served->server());
    served->server().set_pre_routing_handler([this, served](const Request& request, Response& response) {
      using enum httplib::Server::HandlerResponse;
      if (request.method == "POST") return Unhandled;  // refusal() decides, once the body has been read
      const RequestOrigin origin = origin_of(request);
      Authority own = origins.host_of(origin).value_or(Authority());
      const bool usual = page.port() == (config.tls ? kHttpsPort : kHttpPort);
      if (served == &streams) own.port = usual ? "" : std::to_string(page.port());
      const std::string refused = origins.read_refusal(origin, own, request.path != "/");
      if (!refused.empty()) return answer(response, 403, refused), Handled;
      const bool for_all = served == &page && is_for_all(request.path);
      return for_all || access.may(request, response, Role::kWatch) ? Unhandled : Handled;
    });
  }
}

void WebServer::Impl::add_files() {
  // The page comes with the address of its streams, and with a policy that allows the browser to load from
  // there and nowhere else.
  page.server().Get("/", [this](const Request& request, Response& response) {
    const std::string port = std::to_string(streams.port());
    const auto asked = origins.host_of(origin_of(request));
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
    if (web::kSceneBundleBytes == 0) return answer(response, 404, "built without the browser's scene");
    response.set_header("Content-Encoding", "gzip");
    // Of this name, the library does not compress it once more.
    response.set_content(reinterpret_cast<const char*>(web::kSceneBundle), web::kSceneBundleBytes,
                         "application/x-javascript");
  });
}

void WebServer::Impl::add_pictures() {
  page.server().Get("/snapshot/main.png", [this](const Request&, Response& response) {
    const SnapshotPlace place{snapshots};
    if (!place.free) return answer(response, kUnavailable, kTooManyPictures);
    const std::string png = content.main_png ? content.main_png() : std::string();
    if (png.empty()) return answer(response, kUnavailable, "there is no picture yet");
    response.set_content(png, "image/png");
  });
  page.server().Get(R"(/hits/(\d{1,9})\.jpg)", [this](const Request& request, Response& response) {
    const auto alert = static_cast<std::uint32_t>(std::stoul(request.matches[1].str()));
    const std::string jpeg = content.hit_picture ? content.hit_picture(alert) : std::string();
    if (jpeg.empty()) return answer(response, 404, "there is no picture of alert " + std::to_string(alert));
    response.set_content(jpeg, "image/jpeg");
  });
}

/// The fluid is made when it is asked for; who has it already is told so.
void WebServer::Impl::add_fluid() {
  page.server().Get(FluidStore::kPaths, [this](const Request& request, Response& response) {
    if (content.fluid == nullptr)
      return answer(response, 404, "nothing is known of the fluid here: only a live viewer follows it");
    const FluidStore::Answer found = content.fluid->find(request.path);
    if (!found) {
      const core::ErrorCode code = found.status().code();
      const bool too_large = code == core::ErrorCode::kResourceExhausted;
      return answer(response,
                    code == core::ErrorCode::kNotFound ? 404
                    : too_large                        ? kTooLarge
                                                       : kUnavailable,
                    found.status().message());
    }
    let_keep(response, "private, no-cache");
    response.set_header("ETag", found->tag);
    if (request.get_header_value("If-None-Match") == found->tag)
      response.status = kNotModified;
    else
      send_packed(response, found->octets, found->type);
  });
}

void WebServer::Impl::add_states() {
  page.server().Get("/stop", [this](const Request&, Response& response) {
    response.set_content(stop_json(content.stops ? content.stops() : StopView()), "application/json");
  });
  page.server().Get("/state", [this](const Request&, Response& response) {
    content.ask_state(core::monotonic_ns());
    const auto newest = content.state_json.newest();
    if (!newest) return answer(response, kUnavailable, "there is no state yet");
    response.set_content(*newest, "application/json");
  });
}

/// Takes what is posted to a path, from the page itself and by who may: `parse` makes a request of it,
/// `role_needed` says which role it needs, and `carry_out` answers it.
template <class Parse, class RoleNeeded, class CarryOut>
void WebServer::Impl::take(const char* path, Parse parse, RoleNeeded role_needed, CarryOut carry_out) {
  page.server().Post(path, [=, this](const Request& request, Response& response) {
    if (const std::string reason = refusal(request); !reason.empty()) return answer(response, 403, reason);
    if (!config.allow_commands)
      return answer(response, 403,
                    "this viewer only shows: page.allow_commands is false in its configuration");
    const auto parsed = parse(request.body);
    if (!parsed) return answer(response, 400, parsed.status().message());
    const std::optional<Role> role = role_needed(*parsed);
    if (role && !access.may(request, response, *role)) return;
    carry_out(*parsed, response);
  });
}

void WebServer::Impl::add_review() {
  const Review& review = *content.review;
  page.server().Get("/review", [&review](const Request&, Response& response) {
    response.set_content(review_json(review), "application/json");
  });
  page.server().Get("/review/series", [&review](const Request& request, Response& response) {
    const auto value = [&request](const char* name) { return request.get_param_value(name); };
    const auto parsed = parse_series_request(value("names"), value("from"), value("to"), value("columns"));
    if (!parsed) return answer(response, 400, parsed.status().message());
    const auto series = series_json(review, *parsed);
    if (!series) return answer(response, 404, series.status().message());
    response.set_content(*series, "application/json");
  });
  // Everybody who looks is shown the same moment, as the cameras are everybody's.
  const auto needed = [](const ReviewRequest&) { return std::optional(Role::kOperate); };
  take("/review", parse_review_request, needed, [this](const ReviewRequest& request, Response& response) {
    const core::Status done = content.review->control(request, core::monotonic_ns());
    if (done && content.wake) content.wake();
    answer(response, done ? 200 : 400, done ? "done" : done.message());
  });
}

/// The page calibrates a real camera's pose by picks.
void WebServer::Impl::add_calibration() {
  PoseCalibration& poses = *content.calibration;
  page.server().Get("/calibration", [&poses](const Request&, Response& response) {
    response.set_content(poses.state_json(core::monotonic_ns()), "application/json");
  });
  page.server().Get("/calibration/still.jpg", [this, &poses](const Request&, Response& response) {
    const SnapshotPlace place{snapshots};
    if (!place.free) return answer(response, kUnavailable, kTooManyPictures);
    const auto jpeg = poses.still(core::monotonic_ns());
    if (!jpeg) return answer(response, kUnavailable, jpeg.status().message());
    response.set_content(*jpeg, "image/jpeg");
  });
  page.server().Get("/calibration/overlay.jpg", [this](const Request&, Response& response) {
    const auto jpeg = content.view(View::kCamera).jpeg.newest();
    if (!jpeg) return answer(response, kUnavailable, "the camera's view is not followed");
    response.set_content(*jpeg, "image/jpeg");
  });
  const auto needed = [](const CalibrationRequest&) { return std::optional(Role::kOperate); };
  take("/calibration", parse_calibration_request, needed,
       [this, &poses](const CalibrationRequest& request, Response& response) {
         const auto done = poses.carry_out(request);
         if (done && content.wake) content.wake();
         if (done) return answer(response, 200, *done);
         const bool cannot = done.status().code() == core::ErrorCode::kUnavailable;
         answer(response, cannot ? 409 : 400, done.status().message());
       });
}

void WebServer::Impl::add_requests() {
  const auto answer_outcome = [](Response& response, const CommandOutcome& outcome) {
    answer(response, kStatusOfOutcome[static_cast<std::size_t>(outcome.kind)], outcome.message);
  };
  const auto needed_for_command = [](const Command& command) { return role_for(command.kind); };
  const auto needed_for_view = [](const ViewRequest&) { return std::optional(Role::kOperate); };
  take("/command", parse_command, needed_for_command, [=, this](const Command& command, Response& response) {
    if (content.review != nullptr && !is_for_views(command.kind))
      return answer(response, 403, kRecordingTakesNoCommands);
    answer_outcome(response, on_command(command));
  });
  const auto needed_to_carry = [](const CarryRequest&) { return std::optional(Role::kOperate); };
  take("/carry", parse_carry_request, needed_to_carry,
       [=, this](const CarryRequest& request, Response& response) {
         if (content.review != nullptr) return answer(response, 403, kRecordingTakesNoCommands);
         if (!on_carry_request) return answer(response, kUnavailable, "nothing is taken here");
         answer_outcome(response, on_carry_request(request));
       });
  take("/view", parse_view_request, needed_for_view, [this](const ViewRequest& request, Response& response) {
    const core::Status done = on_view_request(request);
    answer(response, done ? 200 : kUnavailable, done ? "done" : done.message());
  });
}

std::string WebServer::Impl::refusal(const Request& request) const {
  // A page from elsewhere cannot send this content type without a preflight request.
  if (request.get_header_value("Content-Type").rfind("application/json", 0) != 0)
    return "the content type must be application/json";
  return origins.command_refusal(origin_of(request));
}

void WebServer::Impl::add_streams() {
  for (const View view : kViews) {
    streams.server().Get(std::string("/stream/") + name_of(view),
                         [this, view](const Request& request, Response& response) {
                           follow(request, response, "multipart/x-mixed-replace; boundary=picture",
                                  content.view(view).jpeg, "--picture\r\n", jpeg_part);
                         });
  }
  streams.server().Get("/events", [this](const Request& request, Response& response) {
    follow(request, response, "text/event-stream", content.state_json, ": phantom\n\n", event_of);
  });
}

/// Sends `opening`, and then each new content of `source` as `packed` returns it, for as long as the follower
/// is connected and its session lasts.
void WebServer::Impl::follow(const Request& request, Response& response, const char* type, Source& source,
                             std::string opening, std::string (*packed)(const std::string&)) {
  const auto place = follower_place(response);
  if (!place) return;
  // The page's port is another origin; only that one may read streams, and others were refused.
  if (const auto origin = header(request, "Origin")) {
    response.set_header("Access-Control-Allow-Origin", *origin);
    response.set_header("Access-Control-Allow-Credentials", "true");  // the session's cookie
    response.set_header("Vary", "Origin");
  }
  source.followers.fetch_add(1);
  response.set_content_provider(
      type,
      [this, place, &source, packed, token = access.token_of(request), text = std::move(opening),
       last = Source::Content(), seen = std::uint64_t{0},
       idle = 0](std::size_t, httplib::DataSink& sink) mutable {
        if (stopping || !access.lasts(token)) {
          sink.done();
          return true;
        }
        if (auto next = source.next(seen, text.empty() ? kPatience : std::chrono::milliseconds(0))) {
          last = std::move(next);
          idle = 0;
          text += packed(*last);
        } else if (text.empty()) {
          if (++idle % kRepeatAfter != 0 || !last) return true;
          text = packed(*last);
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
  answer(response, kUnavailable,
         "all " + std::to_string(config.max_streams) + " streams are taken (page.max_streams)");
  return nullptr;
}

void WebServer::Impl::add_scene() {
  page.server().Get("/shaders.json", [](const Request&, Response& response) {
    response.set_content(shaders_json(), "application/json");
  });
  page.server().Get(R"(/mesh/([0-9a-f]{16}))", [this](const Request& request, Response& response) {
    const auto hash = hash_from_text(request.matches[1].str());
    const MeshStore::Packed mesh = hash ? content.meshes.packed(*hash) : nullptr;
    if (!mesh) return answer(response, 404, "there is no mesh of this hash");
    let_keep(response, "private, max-age=31536000, immutable");
    send_packed(response, mesh, "application/octet-stream");
  });
  streams.server().Get("/scene", [this](const Request& request, Response& response) {
    const auto accept = web_socket_accept(request.get_header_value("Sec-WebSocket-Key"));
    const bool asked =
        asks_for_web_socket(request.get_header_value("Upgrade"), request.get_header_value("Connection"),
                            request.get_header_value("Sec-WebSocket-Version"));
    if (!asked || !accept) {
      response.set_header("Sec-WebSocket-Version", "13");
      return answer(response, kUpgradeRequired, "a WebSocket (RFC 6455, version 13) is expected");
    }
    if (scene == nullptr) return answer(response, kUnavailable, "no scene is served here");
    auto place = follower_place(response);
    if (!place) return;
    auto lasts = [this, token = access.token_of(request)] { return access.lasts(token); };
    RequestGate::switch_protocol(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Accept: " +
            *accept + "\r\n\r\n",
        [this, lasts = std::move(lasts), place = std::move(place)](Channel channel) mutable {
          scene->take({std::move(channel), std::move(lasts), std::move(place)});
        });
  });
}

WebServer::WebServer(const PageConfig& config, PageContent& content, OnCommand on_command,
                     OnViewRequest on_view_request, OnCarryRequest on_carry_request, SceneFeed* scene)
    : impl_(std::make_unique<Impl>(config, content, std::move(on_command), std::move(on_view_request),
                                   std::move(on_carry_request), scene)) {}

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
