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

/// Distributes pictures and states: the views to their followers, each alert's first picture, single
/// snapshots of the main view, recordings, and the viewer's status to other threads. Use it on the drawing's
/// thread unless stated otherwise.
class Publisher {
 public:
  /// Sets `page`'s callbacks for pictures. Both arguments must outlive this.
  Publisher(const ViewerConfig& config, PageContent& page);

  /// Queues a raised alert for its first picture.
  void take(const HitSample& alert) { unseen_.push_back(alert); }
  /// Starts or ends a recording, if the request says so.
  void take(const ViewRequest& request);

  /// Makes the first pictures of some alerts, and the hit zone's view, which the operator waits for. Never
  /// given up.
  void show_threats(Drawing& drawing);
  /// Makes the views that can wait. Returns false if `give_up` returned true meanwhile; views completed
  /// before that are published.
  bool show_views(Drawing& drawing, bool arm_known, const GiveUp& give_up);

  RecordingState recording() const { return recorder_.state(); }
  void end_recording() { recorder_.end(); }
  /// Returns the times from the arrival of an alert until its first picture was made.
  const core::DurationHistogram& alert_to_picture() const { return alert_to_picture_; }
  core::Nanoseconds last_alert_to_picture_ns() const { return last_alert_to_picture_ns_; }

  /// Sets what health(), switches() and view_pose() return.
  void publish(core::Health health, const ViewSwitches& switches);
  void publish(const ViewPoseSample& pose);
  /// Wakes all threads that wait for a picture; none will come any more.
  void end();

  // The values that were published last. Any thread.
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
  std::deque<HitSample> unseen_;  // alerts without a picture yet
  Recorder recorder_;
  core::DurationHistogram alert_to_picture_;
  core::Nanoseconds last_alert_to_picture_ns_ = 0;

  mutable std::mutex mutex_;  // guards all members below
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
