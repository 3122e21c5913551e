#include "components/synthetic_viewer/publisher.hpp"

#include <chrono>
#include <utility>

namespace phantom::synthetic_viewer {
namespace {

constexpr std::size_t kHitJpegs = ViewerState::kMaxHits;
constexpr int kFirstPicturesARound = 3;

}  // namespace

Publisher::Publisher(const ViewerConfig& config, PageContent& page)
    : config_(config), page_(page), recorder_(config.recording) {
  page_.main_png = [this] { return snapshot(); };
  page_.hit_picture = [this](std::uint32_t alert) {
    const std::lock_guard lock(mutex_);
    const auto found = hit_jpegs_.find(alert);
    return found == hit_jpegs_.end() ? std::string() : found->second;
  };
}

void Publisher::take(const ViewRequest& request) {
  if (!request.record) return;
  if (*request.record) {
    recorder_.begin(request.view, page_.view(request.view).image);
  } else {
    recorder_.end();
  }
}

/// Makes an alert's first picture immediately, also while another alert's zone is shown.
void Publisher::show_first(Drawing& drawing, const HitSample& hit) {
  ViewPainter alone;
  ViewPainter& used = hit.alert == drawing.hit_view().alert ? painter(View::kHit) : alone;
  used.draw(drawing.renderer(), drawing.picture(hit).picture, drawing.format(View::kHit));
  const std::string encoded = *used.jpeg(config_.jpeg_quality);
  last_alert_to_picture_ns_ = core::monotonic_ns() - hit.received_ns;
  alert_to_picture_.record(last_alert_to_picture_ns_);
  const std::lock_guard lock(mutex_);
  hit_jpegs_[hit.alert] = encoded;
  while (hit_jpegs_.size() > kHitJpegs) hit_jpegs_.erase(hit_jpegs_.begin());
}

void Publisher::show_threats(Drawing& drawing) {
  // A burst of alerts must not stop the live views: a round draws only some of them, and skips those that
  // have left the page's list.
  while (unseen_.size() > ViewerState::kMaxHits) unseen_.pop_front();
  const std::uint32_t shown = drawing.hit_view().alert;
  bool just_drawn = false;  // whether the present state of the shown alert has just been drawn
  for (int k = 0; k < kFirstPicturesARound && !unseen_.empty(); ++k) {
    const HitSample& hit = unseen_.front();
    show_first(drawing, hit);
    just_drawn = just_drawn || (hit.alert == shown &&
                                age_s(hit.received_ns, core::monotonic_ns()) <= config_.staleness.slave_s);
    unseen_.pop_front();
  }
  ViewOutput& output = page_.view(View::kHit);
  if (shown == 0) {
    output.jpeg.clear();
    output.image.clear();
    return;
  }
  show(drawing, View::kHit, output.followed() && !just_drawn, {});
}

/// Publishes a view's newest picture, after drawing it if `drawn`. Returns false if drawing was given up.
bool Publisher::show(Drawing& drawing, View view, bool drawn, const GiveUp& give_up) {
  if (drawn &&
      !painter(view).draw(drawing.renderer(), drawing.picture(view), drawing.format(view), give_up)) {
    return false;
  }
  painter(view).publish(page_.view(view), config_.jpeg_quality);
  return true;
}

bool Publisher::show_views(Drawing& drawing, bool arm_known, const GiveUp& give_up) {
  std::uint64_t wanted = 0;  // number of the newest requested snapshot; 0: none is waited for
  {
    const std::lock_guard lock(mutex_);
    if (snapshots_made_ != snapshots_wanted_) wanted = snapshots_wanted_;
  }
  if (!show(drawing, View::kMain, page_.view(View::kMain).followed() || wanted != 0, give_up)) return false;
  if (wanted != 0) {
    const std::lock_guard lock(mutex_);
    snapshot_ = painter(View::kMain).image();
    snapshots_made_ = wanted;
    snapshot_made_.notify_all();
  }
  return !config_.tool_view.enabled || !arm_known ||
         show(drawing, View::kTool, page_.view(View::kTool).followed(), give_up);
}

/// Requests a picture and waits for it. Called on a server thread.
std::string Publisher::snapshot() {
  std::unique_lock lock(mutex_);
  const std::uint64_t mine = ++snapshots_wanted_;
  snapshot_made_.wait_for(lock, std::chrono::seconds(2), [&] { return snapshots_made_ >= mine || ended_; });
  const std::shared_ptr<const Image> image = snapshot_;
  lock.unlock();
  return image ? encode_png(*image) : std::string();
}

void Publisher::publish(core::Health health, const ViewSwitches& switches) {
  const std::lock_guard lock(mutex_);
  health_ = std::move(health);
  switches_ = switches;
}

void Publisher::publish(const ViewPoseSample& pose) {
  const std::lock_guard lock(mutex_);
  view_pose_ = pose;
}

void Publisher::end() {
  const std::lock_guard lock(mutex_);
  ended_ = true;
  snapshot_made_.notify_all();
}

core::Health Publisher::health() const {
  const std::lock_guard lock(mutex_);
  return health_;
}

ViewSwitches Publisher::switches() const {
  const std::lock_guard lock(mutex_);
  return switches_;
}

ViewPoseSample Publisher::view_pose() const {
  const std::lock_guard lock(mutex_);
  return view_pose_;
}

}  // namespace phantom::synthetic_viewer
