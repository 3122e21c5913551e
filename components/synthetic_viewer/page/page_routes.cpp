#include "components/synthetic_viewer/page/page_routes.hpp"

#include <httplib.h>
#undef _res  // a macro of resolv.h, which httplib.h includes: a name of Eigen's

#include <array>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/core/clock.hpp"
#include "common/web/page_access.hpp"
#include "components/synthetic_viewer/page/commands.hpp"
#include "components/synthetic_viewer/page/page_review.hpp"
#include "components/synthetic_viewer/page/page_state.hpp"
#include "components/synthetic_viewer/render/shaders_json.hpp"
#include "components/synthetic_viewer/scene/pose_calibration.hpp"
#include "components/synthetic_viewer/stream/fluid_store.hpp"

namespace phantom::synthetic_viewer {
namespace {

using httplib::Request;
using httplib::Response;

constexpr int kSnapshotsAtOnce = 4;  // each occupies a thread until its picture is made
constexpr int kNotModified = 304, kTooLarge = 413;
constexpr std::array kStatusOfOutcome{200, 409, 504};  // by CommandOutcome::Kind

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

}  // namespace

void PageRoutes::add_to(httplib::Server& server) {
  add_pictures(server);
  add_meshes(server);
  add_fluid(server);
  add_states(server);
  add_requests(server);
  if (content.review != nullptr) add_review(server);
  if (content.calibration != nullptr) add_calibration(server);
}

void PageRoutes::add_pictures(httplib::Server& server) {
  server.Get("/snapshot/main.png", [this](const Request&, Response& response) {
    const SnapshotPlace place{snapshots};
    if (!place.free) return web::answer(response, kUnavailable, kTooManyPictures);
    const std::string png = content.main_png ? content.main_png() : std::string();
    if (png.empty()) return web::answer(response, kUnavailable, "there is no picture yet");
    response.set_content(png, "image/png");
  });
  server.Get(R"(/hits/(\d{1,9})\.jpg)", [this](const Request& request, Response& response) {
    const auto alert = static_cast<std::uint32_t>(std::stoul(request.matches[1].str()));
    const std::string jpeg = content.hit_picture ? content.hit_picture(alert) : std::string();
    if (jpeg.empty())
      return web::answer(response, 404, "there is no picture of alert " + std::to_string(alert));
    response.set_content(jpeg, "image/jpeg");
  });
}

/// The fluid is made when it is asked for; who has it already is told so.
void PageRoutes::add_fluid(httplib::Server& server) {
  server.Get(FluidStore::kPaths, [this](const Request& request, Response& response) {
    if (content.fluid == nullptr)
      return web::answer(response, 404, "nothing is known of the fluid here: only a live viewer follows it");
    const FluidStore::Answer found = content.fluid->find(request.path);
    if (!found) {
      const core::ErrorCode code = found.status().code();
      const bool too_large = code == core::ErrorCode::kResourceExhausted;
      return web::answer(response,
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

void PageRoutes::add_states(httplib::Server& server) {
  server.Get("/stop", [this](const Request&, Response& response) {
    response.set_content(stop_json(content.stops ? content.stops() : StopView()), "application/json");
  });
  server.Get("/state", [this](const Request&, Response& response) {
    // While nobody asks none is made: the first who asks after a while waits for a round of the viewer.
    constexpr std::chrono::milliseconds kPatience{1000};
    content.ask_state(core::monotonic_ns());
    if (content.wake && !content.state.newest()) content.wake();
    std::uint64_t seen = 0;
    const auto newest = content.state.next(seen, kPatience);
    if (!newest) return web::answer(response, kUnavailable, "there is no state yet");
    response.set_content(newest->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
                         "application/json");
  });
}

/// Takes what is posted to a path, from the page itself and by who may: `parse` makes a request of it,
/// `role_needed` says which role it needs, and `carry_out` answers it.
template <class Parse, class RoleNeeded, class CarryOut>
void PageRoutes::take(httplib::Server& server, const char* path, Parse parse, RoleNeeded role_needed,
                      CarryOut carry_out) {
  server.Post(path, [=, this](const Request& request, Response& response) {
    if (const std::string reason = refusal(request); !reason.empty())
      return web::answer(response, 403, reason);
    if (!allow_commands)
      return web::answer(response, 403,
                         "this viewer only shows: page.allow_commands is false in its configuration");
    const auto parsed = parse(request.body);
    if (!parsed) return web::answer(response, 400, parsed.status().message());
    const std::optional<web::Role> role = role_needed(*parsed);
    if (role && !access.may(request, response, *role)) return;
    carry_out(*parsed, response);
  });
}

void PageRoutes::add_review(httplib::Server& server) {
  const Review& review = *content.review;
  server.Get("/review", [&review](const Request&, Response& response) {
    response.set_content(review_json(review), "application/json");
  });
  server.Get("/review/series", [&review](const Request& request, Response& response) {
    const auto value = [&request](const char* name) { return request.get_param_value(name); };
    const auto parsed = parse_series_request(value("names"), value("from"), value("to"), value("columns"));
    if (!parsed) return web::answer(response, 400, parsed.status().message());
    const auto series = series_json(review, *parsed);
    if (!series) return web::answer(response, 404, series.status().message());
    response.set_content(*series, "application/json");
  });
  // Everybody who looks is shown the same moment, as the cameras are everybody's.
  const auto needed = [](const ReviewRequest&) { return std::optional(web::Role::kOperate); };
  take(server, "/review", parse_review_request, needed,
       [this](const ReviewRequest& request, Response& response) {
         const core::Status done = content.review->control(request, core::monotonic_ns());
         if (done && content.wake) content.wake();
         web::answer(response, done ? 200 : 400, done ? "done" : done.message());
       });
}

/// The page calibrates a real camera's pose by picks.
void PageRoutes::add_calibration(httplib::Server& server) {
  PoseCalibration& poses = *content.calibration;
  server.Get("/calibration", [&poses](const Request&, Response& response) {
    response.set_content(poses.state_json(core::monotonic_ns()), "application/json");
  });
  server.Get("/calibration/still.jpg", [this, &poses](const Request&, Response& response) {
    const SnapshotPlace place{snapshots};
    if (!place.free) return web::answer(response, kUnavailable, kTooManyPictures);
    const auto jpeg = poses.still(core::monotonic_ns());
    if (!jpeg) return web::answer(response, kUnavailable, jpeg.status().message());
    response.set_content(*jpeg, "image/jpeg");
  });
  server.Get("/calibration/overlay.jpg", [this](const Request&, Response& response) {
    const auto jpeg = content.view(View::kCamera).jpeg.newest();
    if (!jpeg) return web::answer(response, kUnavailable, "the camera's view is not followed");
    response.set_content(*jpeg, "image/jpeg");
  });
  const auto needed = [](const CalibrationRequest&) { return std::optional(web::Role::kOperate); };
  take(server, "/calibration", parse_calibration_request, needed,
       [this, &poses](const CalibrationRequest& request, Response& response) {
         const auto done = poses.carry_out(request);
         if (done && content.wake) content.wake();
         if (done) return web::answer(response, 200, *done);
         const bool cannot = done.status().code() == core::ErrorCode::kUnavailable;
         web::answer(response, cannot ? 409 : 400, done.status().message());
       });
}

void PageRoutes::add_requests(httplib::Server& server) {
  const auto answer_outcome = [](Response& response, const CommandOutcome& outcome) {
    web::answer(response, kStatusOfOutcome[static_cast<std::size_t>(outcome.kind)], outcome.message);
  };
  const auto needed_for_command = [](const Command& command) { return role_for(command.kind); };
  const auto needed_for_view = [](const ViewRequest&) { return std::optional(web::Role::kOperate); };
  take(server, "/command", parse_command, needed_for_command,
       [=, this](const Command& command, Response& response) {
         if (content.review != nullptr && !is_for_views(command.kind))
           return web::answer(response, 403, kRecordingTakesNoCommands);
         answer_outcome(response, on_command(command));
       });
  const auto needed_to_carry = [](const CarryRequest&) { return std::optional(web::Role::kOperate); };
  take(server, "/carry", parse_carry_request, needed_to_carry,
       [=, this](const CarryRequest& request, Response& response) {
         if (content.review != nullptr) return web::answer(response, 403, kRecordingTakesNoCommands);
         if (!on_workspace_request) return web::answer(response, kUnavailable, "nothing is taken here");
         answer_outcome(response, on_workspace_request(request));
       });
  const auto needed_to_correct = [](const CorrectionRequest&) {
    return std::optional(web::Role::kConfigure);
  };
  take(server, "/model", parse_correction_request, needed_to_correct,
       [=, this](const CorrectionRequest& request, Response& response) {
         if (content.review != nullptr) return web::answer(response, 403, kRecordingTakesNoCommands);
         if (!on_workspace_request) return web::answer(response, kUnavailable, "nothing is corrected here");
         answer_outcome(response, on_workspace_request(request));
       });
  take(server, "/view", parse_view_request, needed_for_view,
       [this](const ViewRequest& request, Response& response) {
         const core::Status done = on_view_request(request);
         web::answer(response, done ? 200 : kUnavailable, done ? "done" : done.message());
       });
}

void PageRoutes::add_meshes(httplib::Server& server) {
  server.Get("/shaders.json", [](const Request&, Response& response) {
    response.set_content(shaders_json(), "application/json");
  });
  server.Get(R"(/mesh/([0-9a-f]{16}))", [this](const Request& request, Response& response) {
    const auto hash = hash_from_text(request.matches[1].str());
    const MeshStore::Packed mesh = hash ? content.meshes.packed(*hash) : nullptr;
    if (!mesh) return web::answer(response, 404, "there is no mesh of this hash");
    let_keep(response, "private, max-age=31536000, immutable");
    send_packed(response, mesh, "application/octet-stream");
  });
}

}  // namespace phantom::synthetic_viewer
