#include "components/synthetic_viewer/stream_server.hpp"

#include <chrono>

namespace phantom::synthetic_viewer {
namespace {

constexpr int kSpareThreads = 4;  // for refusing further followers
constexpr std::chrono::milliseconds kPatience{200};
// After this many times kPatience a still picture is sent again, so that a dead connection is noticed.
constexpr int kRepeatAfter = 5;

}  // namespace

StreamServer::StreamServer(const PageConfig& config, int page_port, PageContent& content)
    : config_(config), content_(content), http_(config.max_streams + kSpareThreads) {
  if (page_port != 80) page_port_.append(":").append(std::to_string(page_port));
  for (const View view : kViews) {
    http_.server.Get(std::string("/stream/") + name_of(view),
                     [this, view](const httplib::Request&, httplib::Response& response) {
                       motion_jpeg(response, content_.view(view).jpeg);
                     });
  }
  http_.server.Get("/events", [this](const httplib::Request& request, httplib::Response& response) {
    events(request, response);
  });
  http_.bind(config_.address, config_.stream_port, "page.stream_port");
  http_.start();
}

StreamServer::~StreamServer() {
  stopping_ = true;
  http_.stop();
}

void StreamServer::follow(httplib::Response& response, const char* type, Source& source, std::string opening,
                          WriteItem write) {
  if (streams_.fetch_add(1) >= config_.max_streams) {
    streams_.fetch_sub(1);
    return answer(response, 503,
                  "all " + std::to_string(config_.max_streams) + " streams are taken (page.max_streams)");
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
        if (stopping_) {
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
        streams_.fetch_sub(1);
      });
}

void StreamServer::motion_jpeg(httplib::Response& response, Source& source) {
  // Each part ends with the next boundary, because browsers show a picture only once they have its end.
  follow(response, "multipart/x-mixed-replace; boundary=picture", source, "--picture\r\n",
         [](httplib::DataSink& sink, const Source::Content& jpeg) {
           std::string part =
               "Content-Type: image/jpeg\r\nContent-Length: " + std::to_string(jpeg->size()) + "\r\n\r\n";
           part += *jpeg;
           part += "\r\n--picture\r\n";
           return sink.write(part.data(), part.size());
         });
}

void StreamServer::events(const httplib::Request& request, httplib::Response& response) {
  // The page's port is another origin; only that one may read the events.
  std::string page = "http://";
  page.append(host_name_of(request.get_header_value("Host"))).append(page_port_);
  if (request.get_header_value("Origin") == page) {
    response.set_header("Access-Control-Allow-Origin", page);
    response.set_header("Vary", "Origin");
  }
  follow(response, "text/event-stream", content_.state_json, ": phantom\n\n",
         [](httplib::DataSink& sink, const Source::Content& json) {
           const std::string event = "data: " + *json + "\n\n";
           return sink.write(event.data(), event.size());
         });
}

}  // namespace phantom::synthetic_viewer
