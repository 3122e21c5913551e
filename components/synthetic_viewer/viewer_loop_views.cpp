// What ViewerLoop shows in each round.

#include <algorithm>
#include <chrono>
#include <cmath>

#include "components/synthetic_viewer/viewer_loop.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr std::size_t kHitJpegs = ViewerState::kMaxHits;
constexpr int kFirstPicturesARound = 3;
constexpr double kHitZone_m = 0.02;  // radius of what a view of a hit zone should see

/// Of a hit zone, seen from where the camera will stand: a node inside a wall counts by its nearest free
/// place.
VisibleShare visible_among(const RayScene& bodies) {
  return [&bodies](const ViewSituation& situation, const Eigen::Vector3d& eye_m) {
    Camera camera;
    camera.eye_m = eye_m;
    camera.target_m = situation.look_at_m;
    return bodies.visible_share(situation.look_at_m, situation.pgv, kHitZone_m,
                                settled(camera, bodies).camera.eye_m);
  };
}

}  // namespace

/// What was known when an alert came.
struct ViewerLoop::AlertMoment {
  ViewerState state;
  RayScene bodies;
  core::Nanoseconds at_ns;
};

/// While somebody moves a camera, pictures follow the hand.
core::Nanoseconds ViewerLoop::period_ns() const {
  constexpr double kLivelyRate_hz = 30.0;
  const bool lively = now_ns_ < lively_until_ns_;
  return core::from_seconds(
      1.0 / (lively ? std::max(kLivelyRate_hz, config_.frame_rate_hz) : config_.frame_rate_hz));
}

void ViewerLoop::choose_hit_view(double dt_s) {
  // A view that the operator has turned keeps its node: what he looks at must not be taken from under him.
  const bool turned = hit_.alert != 0 && !state_.cameras.offset(View::kHit).at_home();
  const ViewNode chosen = turned && state_.chosen == ViewNode::kAutomatic ? hit_.node : state_.chosen;
  const std::uint32_t before = hit_.alert;
  hit_ = viewer_.step(state_.hold, chosen, visible_among(bodies_), dt_s);
  if (hit_.alert != before) state_.cameras.home(View::kHit);
}

/// One round of pictures. False if it was broken off because an alert waits for its picture.
bool ViewerLoop::tick(double dt_s) {
  objects_ = scene_.obstacles(state_, false);
  bodies_ = scene_.obstacles(state_, true);
  state_.recording = recorder_.state();
  choose_hit_view(dt_s);
  if (dt_s > 0) frames_per_s_ += (1 - std::exp(-dt_s)) * (1 / dt_s - frames_per_s_);
  // What threatens comes first: it is what the operator waits for.
  show_hit();
  publish_view_pose();
  publish_state();
  const bool whole = show_main() && show_tool() && photograph_alert() && photograph_milestones();
  if (whole) ++frames_;
  return whole;
}

/// The arm moves on while a busy host has other work than to draw.
ViewerLoop::AlertMoment ViewerLoop::at_alert(const HitSample& hit) const {
  AlertMoment moment{state_, {}, hit.received_ns};
  moment.state.arm = hit.arm;
  moment.state.percept = hit.percept;
  // The paint is on the graphics card, in its newest state only.
  const double since_s = std::abs(core::seconds(state_.skin.received_ns - hit.received_ns));
  if (since_s > config_.staleness.percept_s) moment.state.skin.valid = false;
  moment.bodies = scene_.obstacles(moment.state, true);
  return moment;
}

void ViewerLoop::publish_view_pose() {
  ViewPoseSample pose;
  pose.made_ns = now_ns_;
  pose.hit_zone = hit_.alert != 0;
  const View view = pose.hit_zone ? View::kHit : View::kMain;
  const Camera camera =
      pose.hit_zone ? compositor_.hit_camera(moment(), hit_) : compositor_.main_camera(moment());
  if (pose.hit_zone && state_.cameras.offset(view).at_home()) {
    pose.node = static_cast<int>(hit_.node);
    pose.automatic = state_.chosen == ViewNode::kAutomatic;
  }
  const Eigen::Matrix3d axes = percept::view_axes((camera.eye_m - camera.target_m).normalized());
  pose.X_WC = {axes.transpose(), camera.eye_m};
  pose.look_at_m = {camera.target_m.x(), camera.target_m.y(), camera.target_m.z()};
  const std::lock_guard lock(shared_mutex_);
  view_pose_ = pose;
}

/// From where an alert's zone is seen: as it is shown, or from the node that suits it while another is shown.
HitView ViewerLoop::view_of(const HitSample& hit, const RayScene& bodies) const {
  if (hit_.alert == hit.alert) return hit_;
  SyntheticViewer alone(config_.hit_view.rule);
  alone.take({hit.alert, false, eigen(hit.look_at_m), eigen(hit.pgv)});
  return alone.step(false, state_.chosen, visible_among(bodies), 0.0);
}

/// Every alert gets its first picture at once, also while another alert's zone is shown.
void ViewerLoop::show_first(const HitSample& hit) {
  ViewPainter alone;
  ViewPainter& painter = hit.alert == hit_.alert ? painters_[static_cast<std::size_t>(View::kHit)] : alone;
  const AlertMoment then = at_alert(hit);
  painter.draw(
      *renderer_,
      compositor_.hit_picture({then.state, objects_, then.bodies, then.at_ns}, view_of(hit, then.bodies)),
      config_.hit_view.format);
  const std::string encoded = *painter.jpeg(config_.jpeg_quality);
  last_alert_to_picture_ns_ = core::monotonic_ns() - hit.received_ns;
  alert_to_picture_.record(last_alert_to_picture_ns_);
  const std::lock_guard lock(shared_mutex_);
  hit_jpegs_[hit.alert] = encoded;
  while (hit_jpegs_.size() > kHitJpegs) hit_jpegs_.erase(hit_jpegs_.begin());
}

void ViewerLoop::show_hit() {
  // A flood of alerts must not stop the live views: some a round, and those that nobody would see any more
  // not at all.
  while (unseen_.size() > ViewerState::kMaxHits) unseen_.pop_front();
  bool just_drawn = false;  // the alert that is shown, as it is
  for (int k = 0; k < kFirstPicturesARound && !unseen_.empty(); ++k) {
    const HitSample& hit = unseen_.front();
    show_first(hit);
    just_drawn = just_drawn || (hit.alert == hit_.alert &&
                                age_s(hit.received_ns, core::monotonic_ns()) <= config_.staleness.slave_s);
    unseen_.pop_front();
  }
  ViewOutput& output = page_.view(View::kHit);
  if (hit_.alert == 0) {
    output.jpeg.clear();
    output.image.clear();
    return;
  }
  ViewPainter& painter = painters_[static_cast<std::size_t>(View::kHit)];
  if (output.followed() && !just_drawn)
    painter.draw(*renderer_, compositor_.hit_picture(moment(), hit_), config_.hit_view.format);
  painter.publish(output, config_.jpeg_quality);
}

bool ViewerLoop::show_main() {
  ViewOutput& output = page_.view(View::kMain);
  std::uint64_t wanted = 0;
  {
    const std::lock_guard lock(shared_mutex_);
    if (snapshots_made_ != snapshots_wanted_) wanted = snapshots_wanted_;
  }
  ViewPainter& painter = painters_[static_cast<std::size_t>(View::kMain)];
  if (output.followed() || wanted != 0) {
    if (!painter.draw(*renderer_, compositor_.main_picture(moment(), hit_), config_.main_view.format,
                      views_give_up_)) {
      return false;
    }
    if (wanted != 0) {
      const std::lock_guard lock(shared_mutex_);
      snapshot_ = painter.image();
      snapshots_made_ = wanted;
      snapshot_made_.notify_all();
    }
  }
  painter.publish(output, config_.jpeg_quality);
  return true;
}

bool ViewerLoop::show_tool() {
  ViewOutput& output = page_.view(View::kTool);
  ViewPainter& painter = painters_[static_cast<std::size_t>(View::kTool)];
  if (!config_.tool_view.enabled || state_.arm.received_ns == 0) return true;
  if (output.followed() && !painter.draw(*renderer_, compositor_.tool_picture(moment()),
                                         config_.tool_view.format, views_give_up_)) {
    return false;
  }
  painter.publish(output, config_.jpeg_quality);
  return true;
}

/// One a round: fine pictures for the report must not hold up the live ones.
bool ViewerLoop::photograph_alert() {
  if (unphotographed_.empty()) return true;
  const HitSample& hit = unphotographed_.front();
  const AlertMoment then = at_alert(hit);
  const HitView view = view_of(hit, then.bodies);
  auto image = photograph(compositor_.hit_picture({then.state, objects_, then.bodies, then.at_ns}, view),
                          more_urgent_);
  if (!image) return false;
  report_.save_hit(hit.alert, percept::node_name(view.node), core::seconds(hit.received_ns - start_ns_),
                   hit.utc_ns, std::move(*image));
  unphotographed_.pop_front();
  return true;
}

std::optional<Image> ViewerLoop::photograph(Compositor::Picture picture, const GiveUp& give_up) {
  PictureFormat format = config_.main_view.format;
  format.samples = config_.report_samples;
  picture.hud.recording = false;
  auto image = renderer_->render_unless(picture.frame, format, give_up);
  if (image) draw_hud(*image, picture.hud);
  return image;
}

bool ViewerLoop::photograph_milestones() {
  if (!report_.wanted()) return true;
  const auto once = [this](bool& saved, bool now, const char* name) {
    if (saved || !now) return true;
    auto image = photograph(compositor_.main_picture(moment(), hit_), more_urgent_);
    if (!image) return false;
    report_.save(name, std::move(*image));
    saved = true;
    return true;
  };
  return once(saved_start_, scene_.complete(state_) && state_.arm.received_ns != 0, "main_start") &&
         once(saved_hit_, hit_.alert != 0, "main_first_hit") &&
         once(saved_contact_, state_.arm.contact, "main_first_contact");
}

/// At the session's end, what alerts have kept from being drawn, as far as that takes not too long.
void ViewerLoop::finish_photographs() {
  constexpr core::Nanoseconds kPatience_ns = core::kNsPerSecond;
  const core::Nanoseconds until_ns = core::monotonic_ns() + kPatience_ns;
  while (!unphotographed_.empty() && core::monotonic_ns() < until_ns) {
    inbox_.take_events();  // nobody waits for these any more
    photograph_alert();
  }
}

/// Asks for a picture and waits for it. On a server thread.
std::string ViewerLoop::page_snapshot() {
  std::shared_ptr<const Image> image;
  {
    std::unique_lock lock(shared_mutex_);
    const std::uint64_t mine = ++snapshots_wanted_;
    snapshot_made_.wait_for(lock, std::chrono::seconds(2), [&] { return snapshots_made_ >= mine || ended_; });
    image = snapshot_;
  }
  return image ? encode_png(*image) : std::string();
}

}  // namespace phantom::synthetic_viewer
