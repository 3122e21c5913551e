#include "components/synthetic_viewer/web_server.hpp"

#include <arpa/inet.h>
#include <dirent.h>
#include <httplib.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/core/errors.hpp"
#include "components/synthetic_viewer/commands.hpp"
#include "components/synthetic_viewer/web_files.hpp"

namespace phantom::synthetic_viewer {
namespace {

using std::chrono::milliseconds;

constexpr int kSpareThreads = 8;  // for what is no stream, so that a command never queues behind pictures
constexpr milliseconds kPatience{200};
constexpr int kRepeatAfter =
    5;  // patiences: a still picture is sent again, so that a dead connection is noticed

bool is_loopback_name(std::string name) {
  if (const auto colon = name.rfind(':');
      colon != std::string::npos && name.find(']', colon) == std::string::npos) {
    name.resize(colon);
  }
  return name == "localhost" || name == "[::1]" || name.rfind("127.", 0) == 0;
}

bool is_loopback_address(const std::string& address) {
  return address == "localhost" || address == "::1" || address.rfind("127.", 0) == 0;
}

/// Local TCP port of a socket; 0 if the descriptor is none.
int local_port(int descriptor) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  if (address.ss_family == AF_INET) return ntohs(reinterpret_cast<sockaddr_in*>(&address)->sin_port);
  if (address.ss_family == AF_INET6) return ntohs(reinterpret_cast<sockaddr_in6*>(&address)->sin6_port);
  return 0;
}

/// The HTTP library waits out the patience of idle connections before it ends. Closing them from this side
/// spares that.
void shut_connections(int port) {
  DIR* folder = opendir("/proc/self/fd");
  if (folder == nullptr) return;
  while (const dirent* entry = readdir(folder)) {
    const int descriptor = std::atoi(entry->d_name);
    int type = 0;
    socklen_t size = sizeof type;
    if (descriptor <= 2 || getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) != 0) continue;
    if (type == SOCK_STREAM && local_port(descriptor) == port) shutdown(descriptor, SHUT_RDWR);
  }
  closedir(folder);
}

void answer(httplib::Response& response, int status, const std::string& message) {
  response.status = status;
  response.set_content(nlohmann::json{{"ok", status == 200}, {"message", message}}.dump(),
                       "application/json");
}

}  // namespace

struct WebServer::Impl {
  PageConfig config;
  PageContent& content;
  OnCommand on_command;
  OnViewRequest on_view_request;
  httplib::Server server;
  int port = 0;
  std::atomic<bool> stopping{false};
  std::atomic<int> streams{0};
  std::thread thread;

  Impl(const PageConfig& page, PageContent& page_content, OnCommand command, OnViewRequest view_request)
      : config(page),
        content(page_content),
        on_command(std::move(command)),
        on_view_request(std::move(view_request)) {}

  void set_up();
  void bind();
  void add_files();
  void add_pictures();
  void add_streams();
  /// `write` sends what is new (or repeats, if null) and returns whether the follower is still there.
  using Source = Broadcast<std::string>;
  using WriteItem = std::function<bool(httplib::DataSink&, const Source::Content&)>;
  void stream(httplib::Response& response, const char* type, Source& source, std::string opening,
              WriteItem write);
  void motion_jpeg(httplib::Response& response, Source& source);
  void command(const httplib::Request& request, httplib::Response& response);
  void view_request(const httplib::Request& request, httplib::Response& response);
  /// Whether a request that may change something may be carried out; if not, it is answered.
  bool permitted(const httplib::Request& request, httplib::Response& response) const;
  /// Why a request that may change something is not the page's own; empty if it is.
  std::string foreign(const httplib::Request& request) const;
};

void WebServer::Impl::set_up() {
  const auto threads = static_cast<std::size_t>(config.max_streams + kSpareThreads);
  server.new_task_queue = [threads] { return new httplib::ThreadPool(threads); };
  server.set_tcp_nodelay(true);
  server.set_keep_alive_max_count(1);  // an idle connection would hold a thread
  server.set_keep_alive_timeout(2);
  server.set_read_timeout(2);
  server.set_write_timeout(2);
  server.set_payload_max_length(4096);
  // Not the library's default, which lets two servers share a port unnoticed.
  server.set_socket_options([](int descriptor) {
    const int yes = 1;
    setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server.set_default_headers(
      {{"Cache-Control", "no-store"},
       {"X-Content-Type-Options", "nosniff"},
       {"Content-Security-Policy", "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'"}});
  server.set_error_handler([](const httplib::Request& request, httplib::Response& response) {
    if (response.body.empty()) {
      answer(response, response.status,
             response.status == 404 ? "unknown path " + request.path : "request refused");
    }
  });
  server.set_exception_handler([](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
    answer(response, 500, "the viewer could not answer");
  });
  add_files();
  add_pictures();
  add_streams();
  server.Post("/command", [this](const httplib::Request& request, httplib::Response& response) {
    command(request, response);
  });
  server.Post("/view", [this](const httplib::Request& request, httplib::Response& response) {
    view_request(request, response);
  });
}

void WebServer::Impl::bind() {
  if (config.port == 0) {
    port = server.bind_to_any_port(config.address);
  } else {
    port = server.bind_to_port(config.address, config.port) ? config.port : -1;
  }
  if (port > 0) return;
  throw core::MissingError(
      "the operator's page cannot be served on " + config.address + ":" + std::to_string(config.port) +
      ": the port is taken or the address is not this host's. Choose another page.port (0: any "
      "free one) or page.address.");
}

void WebServer::Impl::add_files() {
  const auto serve = [this](const char* path, const char* text, const char* type) {
    server.Get(path, [text, type](const httplib::Request&, httplib::Response& response) {
      response.set_content(text, type);
    });
  };
  serve("/", web::kIndexHtml, "text/html; charset=utf-8");
  serve("/page.css", web::kPageCss, "text/css; charset=utf-8");
  serve("/page.js", web::kPageJs, "text/javascript; charset=utf-8");
}

void WebServer::Impl::add_pictures() {
  server.Get("/snapshot/main.png", [this](const httplib::Request&, httplib::Response& response) {
    const std::string png = content.main_png ? content.main_png() : std::string();
    if (png.empty()) return answer(response, 503, "there is no picture yet");
    response.set_content(png, "image/png");
  });
  server.Get(R"(/hits/(\d{1,9})\.jpg)", [this](const httplib::Request& request, httplib::Response& response) {
    const auto alert = static_cast<std::uint32_t>(std::stoul(request.matches[1].str()));
    const std::string jpeg = content.hit_picture ? content.hit_picture(alert) : std::string();
    if (jpeg.empty()) return answer(response, 404, "there is no picture of alert " + std::to_string(alert));
    response.set_content(jpeg, "image/jpeg");
  });
}

void WebServer::Impl::stream(httplib::Response& response, const char* type, Source& source,
                             std::string opening, WriteItem write) {
  if (streams.fetch_add(1) >= config.max_streams) {
    streams.fetch_sub(1);
    return answer(response, 503,
                  "all " + std::to_string(config.max_streams) + " streams are taken (page.max_streams)");
  }
  source.followers.fetch_add(1);
  struct Follower {
    std::uint64_t seen = 0;
    int idle = 0;
    std::string opening;
    Source::Content last;
  };
  auto follower = std::make_shared<Follower>();
  follower->opening = std::move(opening);
  response.set_content_provider(
      type,
      [this, follower, &source, write = std::move(write)](std::size_t, httplib::DataSink& sink) {
        if (!follower->opening.empty() && !sink.write(follower->opening.data(), follower->opening.size()))
          return false;
        follower->opening.clear();
        if (stopping) {
          sink.done();
          return true;
        }
        if (auto next = source.next(follower->seen, kPatience)) {
          follower->last = std::move(next);
          follower->idle = 0;
        } else if (++follower->idle % kRepeatAfter != 0 || !follower->last) {
          return true;
        }
        return write(sink, follower->last);
      },
      [this, &source](bool) {
        source.followers.fetch_sub(1);
        streams.fetch_sub(1);
      });
}

void WebServer::Impl::motion_jpeg(httplib::Response& response, Source& source) {
  // Each part ends with the next boundary: browsers show a picture when they have seen its end.
  stream(response, "multipart/x-mixed-replace; boundary=picture", source, "--picture\r\n",
         [](httplib::DataSink& sink, const Source::Content& jpeg) {
           std::string part =
               "Content-Type: image/jpeg\r\nContent-Length: " + std::to_string(jpeg->size()) + "\r\n\r\n";
           part += *jpeg;
           part += "\r\n--picture\r\n";
           return sink.write(part.data(), part.size());
         });
}

void WebServer::Impl::add_streams() {
  for (const View view : kViews) {
    server.Get(std::string("/stream/") + name_of(view),
               [this, view](const httplib::Request&, httplib::Response& response) {
                 motion_jpeg(response, content.view(view).jpeg);
               });
  }
  server.Get("/events", [this](const httplib::Request&, httplib::Response& response) {
    stream(response, "text/event-stream", content.state_json, ": phantom\n\n",
           [](httplib::DataSink& sink, const Source::Content& json) {
             const std::string event = "data: " + *json + "\n\n";
             return sink.write(event.data(), event.size());
           });
  });
}

std::string WebServer::Impl::foreign(const httplib::Request& request) const {
  const std::string host = request.get_header_value("Host"), origin = request.get_header_value("Origin");
  // A page from elsewhere in the same browser must not steer the arm: it cannot send this type without asking
  // first, its origin differs, and a name that was bent to point at this host is not a loopback name.
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
  const core::Status done = on_command(*parsed);
  answer(response, done.is_ok() ? 200 : 503, done.is_ok() ? "done" : done.message());
}

void WebServer::Impl::view_request(const httplib::Request& request, httplib::Response& response) {
  if (!permitted(request, response)) return;
  const auto parsed = parse_view_request(request.body);
  if (!parsed) return answer(response, 400, parsed.status().message());
  const core::Status done = on_view_request(*parsed);
  answer(response, done.is_ok() ? 200 : 503, done.is_ok() ? "done" : done.message());
}

WebServer::WebServer(const PageConfig& config, PageContent& content, OnCommand on_command,
                     OnViewRequest on_view_request)
    : impl_(std::make_unique<Impl>(config, content, std::move(on_command), std::move(on_view_request))) {
  impl_->set_up();
  impl_->bind();
  impl_->thread = std::thread([impl = impl_.get()] { impl->server.listen_after_bind(); });
  // Only a running server can be stopped.
  while (!impl_->server.is_running()) std::this_thread::sleep_for(milliseconds(1));
}

WebServer::~WebServer() {
  impl_->stopping = true;
  impl_->server.stop();
  shut_connections(impl_->port);
  impl_->thread.join();
}

int WebServer::port() const { return impl_->port; }

std::string WebServer::url() const {
  const bool everywhere = impl_->config.address == "0.0.0.0" || impl_->config.address == "::";
  std::string host = everywhere ? "127.0.0.1" : impl_->config.address;
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  return "http://" + host + ":" + std::to_string(impl_->port) + "/";
}

}  // namespace phantom::synthetic_viewer
