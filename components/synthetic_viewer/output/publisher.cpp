#include "components/synthetic_viewer/output/publisher.hpp"

#include <algorithm>
#include <chrono>

namespace phantom::synthetic_viewer {
constexpr int kFirstPicturesARound = 3;

bool ViewPainter::draw(Renderer& renderer, const Compositor::Picture& picture, const PictureFormat& format,
                       const CancelCheck& give_up) {
  const bool other = !last_ || !same_picture(last_->frame, picture.frame);
  if (other) {
    auto drawn = renderer.render_unless(picture.frame, format, give_up);
    if (!drawn) return false;
    bare_ = std::move(*drawn);
  }
  if (!other && last_->hud == picture.hud && last_->inset == picture.inset) return true;
  Image image = bare_.clone();
  if (picture.inset) draw_inset(image, *picture.inset);
  draw_hud(image, picture.hud);
  image_ = std::make_shared<Image>(std::move(image));
  jpeg_.reset();
  // Compares with the frame last drawn, so that small steps cannot add up unseen.
  if (other) last_ = picture;
  last_->hud = picture.hud;
  last_->inset = picture.inset;
  return true;
}

const std::shared_ptr<const std::string>& ViewPainter::jpeg(int quality) {
  if (!jpeg_ && image_) jpeg_ = std::make_shared<const std::string>(encode_jpeg(*image_, quality));
  return jpeg_;
}

void ViewPainter::publish(ViewOutput& output, int quality) {
  if (!image_) return;
  if (output.image.followers == 0) {
    output.image.clear();
  } else if (output.image.newest() != image_) {
    output.image.publish(image_);
  }
  if (output.jpeg.followers == 0) {
    output.jpeg.clear();
  } else if (output.jpeg.newest() != jpeg(quality)) {
    output.jpeg.publish(jpeg(quality));
  }
}

Publisher::Publisher(const SceneConfig& config, const OutputConfig& output, PageContent& page)
    : config_(config), output_(output), page_(page), recorder_(output.recording) {
  page_.main_png = [this] { return snapshot(); };
  page_.hit_picture = [this](std::uint32_t alert) {
    const std::lock_guard lock(mutex_);
    const auto found = hit_jpegs_.find(alert);
    return found == hit_jpegs_.end() ? std::string() : found->second.jpeg;
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
  const std::string encoded = *used.jpeg(output_.jpeg_quality);
  last_alert_to_picture_ns_ = core::monotonic_ns() - hit.received_ns;
  alert_to_picture_.record(last_alert_to_picture_ns_);
  const std::lock_guard lock(mutex_);
  hit_jpegs_[hit.alert] = {hit.received_ns, encoded};
  while (hit_jpegs_.size() > ViewerState::kMaxHits) hit_jpegs_.erase(hit_jpegs_.begin());
}

void Publisher::show_listed(Drawing& drawing, const std::deque<HitRecord>& listed) {
  const HitSample* missing = nullptr;
  {
    const std::lock_guard lock(mutex_);
    const auto is_of = [this](const HitRecord& record) {
      const auto found = hit_jpegs_.find(record.raised.alert);
      return found != hit_jpegs_.end() && found->second.received_ns == record.raised.received_ns;
    };
    for (auto record = listed.rbegin(); record != listed.rend() && missing == nullptr; ++record) {
      if (!is_of(*record)) missing = &record->raised;
    }
    std::erase_if(hit_jpegs_, [&listed](const auto& picture) {
      return std::ranges::none_of(listed, [&picture](const HitRecord& record) {
        return record.raised.alert == picture.first &&
               record.raised.received_ns == picture.second.received_ns;
      });
    });
  }
  if (missing == nullptr) return;
  ViewPainter alone;
  alone.draw(drawing.renderer(), drawing.picture(*missing).picture, drawing.format(View::kHit));
  const std::string encoded = *alone.jpeg(output_.jpeg_quality);
  const std::lock_guard lock(mutex_);
  hit_jpegs_[missing->alert] = {missing->received_ns, encoded};
}

void Publisher::show_threats(Drawing& drawing) {
  // A burst of alerts must not stop the live views: a round draws only some of them, and skips those that
  // have left the page's list.
  while (unpictured_.size() > ViewerState::kMaxHits) unpictured_.pop_front();
  const std::uint32_t shown = drawing.hit_view().alert;
  bool just_drawn = false;  // whether the present state of the shown alert has just been drawn
  for (int k = 0; k < kFirstPicturesARound && !unpictured_.empty(); ++k) {
    const HitSample& hit = unpictured_.front();
    show_first(drawing, hit);
    just_drawn = just_drawn || (hit.alert == shown &&
                                age_s(hit.received_ns, core::monotonic_ns()) <= config_.staleness.slave_s);
    unpictured_.pop_front();
  }
  ViewOutput& output = page_.view(View::kHit);
  if (shown == 0) {
    output.jpeg.clear();
    return output.image.clear();
  }
  const bool inset = config_.camera_view.inset == View::kHit && page_.view(View::kCamera).followed();
  show(drawing, View::kHit, (output.followed() || inset) && !just_drawn, {});
}

/// Publishes a view's newest picture, after drawing it if `drawn`. Returns false if drawing was given up.
bool Publisher::show(Drawing& drawing, View view, bool drawn, const CancelCheck& give_up) {
  if (drawn &&
      !painter(view).draw(drawing.renderer(), drawing.picture(view), drawing.format(view), give_up)) {
    return false;
  }
  painter(view).publish(page_.view(view), output_.jpeg_quality);
  return true;
}

/// Publishes a real camera's picture, with another view in its corner. Returns false if drawing was given up.
bool Publisher::show_camera(Drawing& drawing, const CancelCheck& give_up) {
  ViewOutput& output = page_.view(View::kCamera);
  if (output.followed() && drawing.take_video(core::monotonic_ns())) {
    Compositor::Picture picture = drawing.picture(View::kCamera);
    const auto& inset = config_.camera_view.inset;
    if (inset && (*inset != View::kHit || drawing.hit_view().alert != 0))
      picture.inset = painter(*inset).image();
    if (!painter(View::kCamera).draw(drawing.renderer(), picture, drawing.format(View::kCamera), give_up))
      return false;
  }
  painter(View::kCamera).publish(output, output_.jpeg_quality);
  return true;
}

bool Publisher::show_views(Drawing& drawing, bool arm_known, const CancelCheck& give_up) {
  const bool inset = config_.camera_view.inset == View::kMain && page_.view(View::kCamera).followed();
  return show(drawing, View::kMain, page_.view(View::kMain).followed() || inset, give_up) &&
         show_camera(drawing, give_up) &&
         (!config_.tool_view.enabled || !arm_known ||
          show(drawing, View::kTool, page_.view(View::kTool).followed(), give_up));
}

/// Follows the main view until it has a picture. Called on a server thread.
std::string Publisher::snapshot() {
  constexpr int kTries = 20;
  web::Broadcast<Image>& main = page_.view(View::kMain).image;
  main.followers.fetch_add(1);
  std::uint64_t seen = 0;
  web::Broadcast<Image>::Content image;
  for (int k = 0; k < kTries && !image && (k == 0 || !ended_); ++k)
    image = main.next(seen, std::chrono::milliseconds(100));
  main.followers.fetch_sub(1);
  return image ? encode_png(*image) : std::string();
}

void Publisher::end() {
  ended_ = true;
  if (const auto& last = painter(View::kMain).image()) page_.view(View::kMain).image.publish(last);
}

}  // namespace phantom::synthetic_viewer
