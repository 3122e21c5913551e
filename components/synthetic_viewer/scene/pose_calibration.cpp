#include "components/synthetic_viewer/scene/pose_calibration.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/camera/pose_fit.hpp"
#include "common/core/errors.hpp"
#include "common/core/units.hpp"
#include "components/synthetic_viewer/scene/hud.hpp"

namespace phantom::synthetic_viewer {
namespace {

using Json = nlohmann::json;

constexpr double kHides_m = 0.01;  // a body so much before a corner hides it
constexpr double kSamePlace_px = 1.0;
constexpr int kStillQuality = 92;
constexpr core::Nanoseconds kOpenFor_ns = 3 * core::kNsPerSecond, kOldStill_ns = core::kNsPerSecond;

core::Status refuse(std::string why) { return core::Status::invalid_argument(std::move(why)); }

core::Expected<CalibrationRequest::Pick> parse_page_pick(const Json& json, std::size_t number) {
  const std::string which = "pick " + std::to_string(number) + ": ";
  if (!json.is_object() || json.size() != 2 || !json.contains("corner") || !json.contains("at"))
    return refuse(which + R"(a JSON object {"corner": …, "at": [u, v]} is expected)");
  const Json &corner = json["corner"], &at = json["at"];
  if (!corner.is_string() || corner.get_ref<const std::string&>().size() > 200)
    return refuse(which + "corner must be the name of a known corner");
  const auto share = [](const Json& value) {
    return value.is_number() && value.get<double>() >= 0.0 && value.get<double>() <= 1.0;
  };
  if (!at.is_array() || at.size() != 2 || !share(at[0]) || !share(at[1]))
    return refuse(which +
                  "lies outside the picture; allowed: at: [u, v], each 0 to 1 of its width and height");
  return CalibrationRequest::Pick{corner.get<std::string>(), at[0].get<double>(), at[1].get<double>()};
}

Json figures_json(const Calibration& calibration) {
  if (!calibration.has_figures || calibration.pose_residual_px <= 0.0) return Json();
  return {{"residual_px", calibration.pose_residual_px},
          {"residual_mm", calibration.pose_residual_mm},
          {"sigma_mm", calibration.pose_sigma_mm},
          {"sigma_deg", calibration.pose_sigma_deg}};
}

}  // namespace

void add_known_corners(const std::string& object, const geometry::Pose& X_WO, const EdgeMesh& mesh,
                       std::vector<KnownCorner>& corners) {
  for (unsigned signs = 0; signs < 8; ++signs) {
    std::array<bool, 3> high{};
    std::string name = object + ":";
    for (unsigned axis = 0; axis < 3; ++axis) {
      high[axis] = (signs >> axis & 1U) != 0;
      name += high[axis] ? '+' : '-';
    }
    if (const auto corner_m = corner_towards(mesh, high))
      corners.push_back({std::move(name), X_WO * corner_m->cast<double>()});
  }
}

core::Expected<CalibrationRequest> parse_calibration_request(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  const char* allowed =
      R"(a JSON object {"try": […]}, {"keep": N} or {"discard": N}, N the pose on trial, is expected)";
  if (!json.is_object() || json.size() != 1) return refuse(allowed);
  CalibrationRequest request;
  for (const auto& [key, act] :
       {std::pair{"keep", CalibrationRequest::Act::kKeep}, {"discard", CalibrationRequest::Act::kDiscard}}) {
    if (!json.contains(key)) continue;
    if (!json[key].is_number_unsigned()) return refuse(allowed);
    request.act = act;
    request.trial = json[key].get<std::uint64_t>();
    return request;
  }
  if (!json.contains("try") || !json["try"].is_array()) return refuse(allowed);
  const Json& picks = json["try"];
  if (picks.size() > CalibrationRequest::kMaxPicks)
    return refuse("there are " + std::to_string(picks.size()) + " picks; allowed: 3 to " +
                  std::to_string(CalibrationRequest::kMaxPicks));
  for (std::size_t i = 0; i < picks.size(); ++i) {
    auto pick = parse_page_pick(picks[i], i + 1);
    if (!pick) return pick.status();
    request.picks.push_back(std::move(*pick));
  }
  return request;
}

PoseCalibration::PoseCalibration(const VideoCamera& camera, int width_px, int height_px)
    : camera_(camera),
      lens_(*camera.calibration.lens),
      straight_(camera::straightened(lens_, width_px, height_px)),
      warp_(lens_, straight_),
      kept_(camera.calibration) {}

void PoseCalibration::attach(const VideoFeed* feed) {
  const std::lock_guard lock(mutex_);
  feed_ = feed;
}

bool PoseCalibration::open(core::Nanoseconds now_ns) const {
  const std::lock_guard lock(mutex_);
  return asked_ns_ != 0 && now_ns - asked_ns_ < kOpenFor_ns;
}

void PoseCalibration::show(std::vector<KnownCorner> corners, const RayScene& obstacles) {
  bool on_trial = false;
  const Eigen::Vector3d eye_m = in_force(on_trial).X_WC->translation_m;
  std::vector<Corner> shown;
  for (KnownCorner& corner : corners) {
    const Eigen::Vector3d way_m = corner.position_W_m - eye_m;
    const double distance_m = way_m.norm();
    const bool hidden =
        distance_m > 2 * kHides_m &&
        obstacles.nearest(eye_m, way_m / distance_m, kHides_m, distance_m - kHides_m).has_value();
    shown.push_back({std::move(corner), !hidden});
  }
  const std::lock_guard lock(mutex_);
  corners_ = std::move(shown);
}

Calibration PoseCalibration::in_force(bool& on_trial) const {
  const std::lock_guard lock(mutex_);
  on_trial = trial_.has_value();
  return standing();
}

std::string PoseCalibration::state_json(core::Nanoseconds now_ns) {
  const std::lock_guard lock(mutex_);
  asked_ns_ = now_ns;
  const geometry::Pose X_CW = standing().X_WC->inverse();
  const camera::Lens& lens = straight_.lens();
  Json corners = Json::array();
  for (const Corner& corner : corners_) {
    const auto pixel = straight_.project(X_CW * corner.known.position_W_m);
    if (!corner.seen || !pixel) continue;
    const double u = (pixel->x() + 0.5) / lens.width_px, v = (pixel->y() + 0.5) / lens.height_px;
    if (u < 0 || v < 0 || u > 1 || v > 1) continue;
    const Eigen::Vector3d& place_m = corner.known.position_W_m;
    corners.push_back(
        {{"name", corner.known.name}, {"at", {u, v}}, {"place_m", {place_m.x(), place_m.y(), place_m.z()}}});
  }
  Json json{{"camera", camera_.name}, {"width_px", lens.width_px},      {"height_px", lens.height_px},
            {"corners", corners},     {"on_trial", trial_.has_value()}, {"pose", figures_json(standing())}};
  if (trial_) {
    json["trial"] = trial_->number;
    json["points"] = trial_->points;
    json["worst_px"] = trial_->worst_px;
    json["moved_mm"] = 1e3 * (trial_->calibration.X_WC->translation_m - kept_.X_WC->translation_m).norm();
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

core::Expected<std::string> PoseCalibration::still(core::Nanoseconds now_ns) const {
  VideoStatus status;
  {
    const std::lock_guard lock(mutex_);
    if (feed_ != nullptr) status = feed_->status();
  }
  if (!status.newest || now_ns - status.newest->arrived_ns > kOldStill_ns)
    return core::Status(core::ErrorCode::kUnavailable,
                        "camera " + camera_.name + " gives no picture" +
                            (status.problem.empty() ? "" : ": " + status.problem));
  return encode_jpeg(warp_.warped(status.newest->image), kStillQuality);
}

core::Expected<std::string> PoseCalibration::carry_out(const CalibrationRequest& request) {
  using Act = CalibrationRequest::Act;
  if (request.act == Act::kTry) return try_pose(request);
  if (request.act == Act::kKeep) return keep(request.trial);
  const std::lock_guard lock(mutex_);
  if (const auto trial = on_trial(request.trial); !trial) return trial.status();
  trial_.reset();
  return std::string("the pose is as it was before");
}

core::Expected<std::string> PoseCalibration::try_pose(const CalibrationRequest& request) {
  std::vector<camera::SeenPoint> points;
  std::optional<geometry::Pose> prior;
  Calibration found;
  {
    const std::lock_guard lock(mutex_);
    found = kept_;
    prior = kept_.X_WC;
    for (std::size_t i = 0; i < request.picks.size(); ++i) {
      const CalibrationRequest::Pick& pick = request.picks[i];
      const std::string which = "pick " + std::to_string(i + 1) + ": ";
      const auto corner =
          std::ranges::find(corners_, pick.corner, [](const Corner& c) { return c.known.name; });
      if (corner == corners_.end())
        return refuse(which + "no corner '" + pick.corner + "' is known; allowed: those of the list");
      const camera::Lens& lens = straight_.lens();
      const auto direction =
          straight_.direction({pick.u * lens.width_px - 0.5, pick.v * lens.height_px - 0.5});
      const auto pixel = direction ? lens_.project(direction->homogeneous()) : std::nullopt;
      if (!pixel) return refuse(which + "the lens sees nothing there");
      for (std::size_t k = 0; k < points.size(); ++k) {
        if (request.picks[k].corner == pick.corner)
          return refuse(which + pick.corner + " was picked already, as pick " + std::to_string(k + 1));
        if ((points[k].pixel - *pixel).norm() < kSamePlace_px)
          return refuse(which + "is at the place of pick " + std::to_string(k + 1));
      }
      points.push_back({corner->known.position_W_m, *pixel});
    }
  }
  camera::PoseFitOptions options;
  options.prior = prior;
  const auto fit = camera::fit_pose(lens_, points, options);
  if (!fit) return fit.status();
  found.X_WC = fit->X_WC;
  found.pose_residual_px = std::max(fit->rms_px, std::numeric_limits<double>::min());
  found.pose_residual_mm = fit->rms_mm;
  found.pose_sigma_mm = 1e3 * fit->position_sigma_m();
  found.pose_sigma_deg = fit->orientation_sigma_rad() / core::kRadPerDegree;
  found.has_figures = true;
  const std::lock_guard lock(mutex_);
  trial_ = Trial{++trials_, found, points.size(), *std::ranges::max_element(fit->residual_px)};
  return fmt::format("{} corners fit to {:.1f} px, {:.1f} mm; the pose is on trial", points.size(),
                     fit->rms_px, fit->rms_mm);
}

// Under mutex_.
core::Expected<PoseCalibration::Trial> PoseCalibration::on_trial(std::uint64_t number) const {
  if (!trial_) return refuse("no pose is on trial; allowed: to find one by picks first");
  if (trial_->number != number)
    return refuse("another pose is on trial by now; allowed: the one that is shown");
  return *trial_;
}

core::Expected<std::string> PoseCalibration::keep(std::uint64_t number) {
  const std::lock_guard one_writes(keep_mutex_);
  const auto trial = [&] {
    const std::lock_guard lock(mutex_);
    return on_trial(number);
  }();
  if (!trial) return trial.status();
  try {
    write_calibration(camera_.calibration_file, trial->calibration);
  } catch (const core::MissingError& problem) {
    return core::Status(core::ErrorCode::kUnavailable, problem.what());
  }
  const std::lock_guard lock(mutex_);
  kept_ = trial->calibration;
  if (trial_ && trial_->number == number) trial_.reset();  // not a newer one that came meanwhile
  std::string words = "written: " + camera_.calibration_file.string();
  if (!camera_.names_calibration)
    words += "; it holds after a restart once the camera's file says calibration: " +
             camera_.calibration_file.filename().string();
  return words;
}

}  // namespace phantom::synthetic_viewer
