#include "components/synthetic_viewer/scene/camera_view.hpp"

#include <algorithm>

namespace phantom::synthetic_viewer {
namespace {

constexpr std::size_t kMaxSkins = 128;  // skin_percept comes at 20 Hz, video is at most 5 s late
constexpr double kDarkened = 0.3;

LocalizedText calibration_words(const Calibration& calibration) {
  if (!calibration.has_figures) return {};
  if (calibration.pose_residual_px > 0.0)
    return {"video.calibrated", {{"px", calibration.pose_residual_px}, {"mm", calibration.pose_residual_mm}}};
  return {"video.lens_calibrated", {{"px", calibration.lens_residual_px}}};
}

}  // namespace

CameraView::CameraView(const VideoCamera& camera, const PictureFormat& format,
                       const VideoStaleness& staleness, const VideoFeed& feed, const RecentSamples& past)
    : camera_(camera),
      calibration_(camera.calibration),
      staleness_(staleness),
      feed_(feed),
      past_(past),
      straight_(camera::straightened(camera::LensModel(*camera.calibration.lens), format.width_px,
                                     format.height_px)),
      warp_(camera::LensModel(*camera.calibration.lens), camera::LensModel(straight_)) {}

void CameraView::stand(const Calibration& calibration, bool on_trial) {
  calibration_ = calibration;
  on_trial_ = on_trial;
}

void CameraView::take(const SkinSample& skin) {
  skins_.push_back(skin);
  if (skins_.size() > kMaxSkins) skins_.pop_front();
}

void CameraView::straighten(const VideoStatus& status) {
  if (!status.newest || status.number == shown_) return;
  shown_ = status.number;
  picture_ = std::make_shared<const Image>(warp_.warped(status.newest->image));
  dark_.reset();
}

/// Returns what is wrong with the video; empty: nothing.
LocalizedText CameraView::fault(const VideoStatus& status, core::Nanoseconds now_ns) const {
  const bool told = !status.problem.empty();
  if (!status.newest) {
    if (!told) return {"video.none", {{"camera", camera_.name}}};
    return {"video.none_because", {{"camera", camera_.name}, {"problem", status.problem}}};
  }
  const double silent_s = core::seconds(now_ns - status.newest->arrived_ns);
  if (silent_s > staleness_.silent_s) {
    const LocalizedText::Value seconds{"seconds", std::max(1.0, silent_s)};
    if (!told) return {"video.lost", {seconds}};
    return {"video.lost_because", {seconds, {"problem", status.problem}}};
  }
  const double stuck_s = core::seconds(now_ns - status.changed_ns);
  if (staleness_.stuck_s > 0.0 && stuck_s > staleness_.stuck_s)
    return {"video.stands_still", {{"seconds", stuck_s}}};
  return {};
}

VideoMoment CameraView::at(core::Nanoseconds now_ns) {
  const VideoStatus status = feed_.status();
  straighten(status);
  // The picture may have come after the caller has looked at the clock.
  if (status.newest) now_ns = std::max(now_ns, status.newest->arrived_ns);
  VideoMoment moment;
  moment.camera = drawing_camera(straight_, *calibration_.X_WC);
  moment.name = camera_.name;
  moment.calibration = calibration_words(calibration_);
  if (on_trial_) moment.calibration = {"video.on_trial", {{"calibration", moment.calibration}}};
  moment.problem = fault(status, now_ns);
  moment.live = moment.problem.empty();
  moment.picture = picture_;
  if (status.newest) {
    const VideoPicture& newest = *status.newest;
    moment.latency_known = newest.exposed_ns.has_value() || camera_.latency_s.has_value();
    moment.exposed_ns =
        newest.exposed_ns.value_or(newest.arrived_ns - core::from_seconds(camera_.latency_s.value_or(0.0)));
    moment.age_s = core::seconds(now_ns - moment.exposed_ns);
  }
  if (!moment.live && picture_) {
    if (!dark_) {
      Image dark;
      picture_->convertTo(dark, -1, kDarkened);
      dark_ = std::make_shared<const Image>(std::move(dark));
    }
    moment.picture = dark_;
  }
  return moment;
}

ViewerState CameraView::state_at(const ViewerState& now, core::Nanoseconds time_ns,
                                 const Staleness& staleness) const {
  ViewerState then = now;
  then.arm = past_.arm_at(time_ns, core::from_seconds(staleness.slave_s));
  for (std::size_t i = 0; i < then.others.size(); ++i)
    then.others[i].arm = past_.other_at(i, time_ns, core::from_seconds(staleness.slave_s));
  then.percept = past_.percept_at(time_ns, core::from_seconds(staleness.percept_s));
  if (now.gripper.received_ns != 0)
    then.gripper = past_.gripper_at(time_ns, core::from_seconds(staleness.gripper_s));
  then.skin = {};
  const auto later = std::ranges::upper_bound(skins_, time_ns, {}, &SkinSample::received_ns);
  if (later != skins_.begin()) then.skin = *std::prev(later);
  return then;
}

}  // namespace phantom::synthetic_viewer
