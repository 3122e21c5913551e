#pragma once

#include <array>
#include <atomic>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "common/core/histogram.hpp"
#include "components/synthetic_viewer/output/output_config.hpp"
#include "components/synthetic_viewer/scene/drawing.hpp"
#include "components/synthetic_viewer/stream/page_content.hpp"

namespace phantom::synthetic_viewer {

/// Makes the pictures of one view, and only those that differ from the last: an unchanged picture is drawn,
/// annotated and encoded once, however often and by however many followers it is requested. One thread, that
/// of the renderer.
class ViewPainter {
 public:
  /// Makes the newest picture, with its HUD. Returns false and changes nothing if `give_up` returned true
  /// meanwhile.
  bool draw(Renderer& renderer, const Compositor::Picture& picture, const PictureFormat& format,
            const CancelCheck& give_up = {});
  /// Returns the newest picture; null: none yet.
  const std::shared_ptr<const Image>& image() const { return image_; }
  /// Returns the newest picture as JPEG; null: none yet.
  const std::shared_ptr<const std::string>& jpeg(int quality);
  /// Publishes the newest picture to its followers; does nothing if they have it.
  void publish(ViewOutput& output, int quality);

 private:
  std::optional<Compositor::Picture> last_;
  Image bare_;  // without HUD
  std::shared_ptr<const Image> image_;
  std::shared_ptr<const std::string> jpeg_;  // of image_
};

/// Distributes pictures: the views to their followers, each alert's first picture, and recordings. Use it on
/// the drawing's thread unless stated otherwise.
class Publisher {
 public:
  /// Sets `page`'s callbacks for pictures. Both arguments must outlive this.
  Publisher(const SceneConfig& config, const OutputConfig& output, PageContent& page);

  /// Queues a raised alert for its first picture.
  void take(const HitSample& alert) { unpictured_.push_back(alert); }
  /// Starts or ends a recording, if the request says so.
  void take(const ViewRequest& request);

  /// Makes the first pictures of some alerts, and the hit zone's view, which the operator waits for. Never
  /// given up.
  void show_threats(Drawing& drawing);
  /// Makes the views that can wait. Returns false if `give_up` returned true meanwhile; views completed
  /// before that are published.
  bool show_views(Drawing& drawing, bool arm_known, const CancelCheck& give_up);

  /// Makes the first picture of the newest alert of a list that has none yet, if there is such a one, and
  /// forgets those of alerts that are not in it. For alerts that are not taken when they come.
  void show_listed(Drawing& drawing, const std::deque<HitRecord>& listed);

  RecordingState recording() const { return recorder_.state(); }
  void end_recording() { recorder_.end(); }
  /// Returns the times from the arrival of an alert until its first picture was made.
  const core::DurationHistogram& alert_to_picture() const { return alert_to_picture_; }
  core::Nanoseconds last_alert_to_picture_ns() const { return last_alert_to_picture_ns_; }

  /// Wakes all threads that wait for a picture; none will come any more.
  void end();

 private:
  void show_first(Drawing& drawing, const HitSample& hit);
  bool show(Drawing& drawing, View view, bool drawn, const CancelCheck& give_up);
  bool show_camera(Drawing& drawing, const CancelCheck& give_up);
  std::string snapshot();
  ViewPainter& painter(View view) { return painters_[static_cast<std::size_t>(view)]; }

  const SceneConfig& config_;
  const OutputConfig& output_;
  PageContent& page_;
  std::array<ViewPainter, kViews.size()> painters_;
  std::deque<HitSample> unpictured_;  // alerts without a picture yet
  Recorder recorder_;
  core::DurationHistogram alert_to_picture_;
  core::Nanoseconds last_alert_to_picture_ns_ = 0;
  std::atomic<bool> ended_{false};
  std::mutex mutex_;
  struct FirstPicture {
    core::Nanoseconds received_ns = 0;  // of the alert: numbers begin anew with each phantom
    std::string jpeg;
  };
  std::map<std::uint32_t, FirstPicture> hit_jpegs_;  // by alert; guarded by mutex_
};

}  // namespace phantom::synthetic_viewer
