#pragma once

#include <array>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "common/core/health.hpp"
#include "common/core/histogram.hpp"
#include "components/synthetic_viewer/drawing.hpp"
#include "components/synthetic_viewer/page_content.hpp"
#include "components/synthetic_viewer/recorder.hpp"
#include "components/synthetic_viewer/view_painter.hpp"

namespace phantom::synthetic_viewer {

/// Hands out what is drawn and known: the views to those who follow them, each alert's first picture, the
/// main view to whoever asks once, recordings, and to other threads how the viewer is. Of the drawing's
/// thread but for what says otherwise.
class Publisher {
 public:
  /// Fills in `page`'s callbacks for pictures. Both must outlive this.
  Publisher(const ViewerConfig& config, PageContent& page);

  /// A raised alert, whose first picture is to be made.
  void take(const HitSample& alert) { unseen_.push_back(alert); }
  /// Begins or ends a recording, if that is asked for.
  void take(const ViewRequest& request);

  /// First pictures of some alerts, and the hit zone's view: what the operator waits for. Never given up.
  void show_threats(Drawing& drawing);
  /// The views that may wait. False if `give_up` said yes on the way; what came before that is handed out.
  bool show_views(Drawing& drawing, bool arm_known, const GiveUp& give_up);

  RecordingState recording() const { return recorder_.state(); }
  void end_recording() { recorder_.end(); }
  /// From when an alert came until its first picture was made.
  const core::DurationHistogram& alert_to_picture() const { return alert_to_picture_; }
  core::Nanoseconds last_alert_to_picture_ns() const { return last_alert_to_picture_ns_; }

  /// For the other threads, from now on.
  void publish(core::Health health, const ViewSwitches& switches);
  void publish(const ViewPoseSample& pose);
  /// Nobody needs to wait for a picture any more.
  void end();

  // What was published last. Any thread.
  core::Health health() const;
  ViewSwitches switches() const;
  ViewPoseSample view_pose() const;

 private:
  void show_first(Drawing& drawing, const HitSample& hit);
  bool show(Drawing& drawing, View view, bool drawn, const GiveUp& give_up);
  std::string snapshot();
  ViewPainter& painter(View view) { return painters_[static_cast<std::size_t>(view)]; }

  const ViewerConfig& config_;
  PageContent& page_;
  std::array<ViewPainter, kViews.size()> painters_;
  std::deque<HitSample> unseen_;  // alerts of which there is no picture yet
  Recorder recorder_;
  core::DurationHistogram alert_to_picture_;
  core::Nanoseconds last_alert_to_picture_ns_ = 0;

  mutable std::mutex mutex_;  // of all that follows
  std::condition_variable snapshot_made_;
  core::Health health_;
  ViewSwitches switches_;
  ViewPoseSample view_pose_;
  std::uint64_t snapshots_wanted_ = 0, snapshots_made_ = 0;
  std::shared_ptr<const Image> snapshot_;
  std::map<std::uint32_t, std::string> hit_jpegs_;  // by alert
  bool ended_ = false;
};

}  // namespace phantom::synthetic_viewer
