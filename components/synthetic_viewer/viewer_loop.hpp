#pragma once

#include <atomic>
#include <deque>
#include <exception>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/core/progress.hpp"
#include "common/dds/admission/refusal_log.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/output/publisher.hpp"
#include "components/synthetic_viewer/output/report.hpp"
#include "components/synthetic_viewer/review/review.hpp"
#include "components/synthetic_viewer/scene/simulated_camera.hpp"
#include "components/synthetic_viewer/state/inbox.hpp"

namespace phantom::synthetic_viewer {

/// The viewer's own thread: takes new samples, and has pictures drawn, published and put into the report. It
/// owns the OpenGL context and runs at low priority.
class ViewerLoop {
 public:
  /// Sets `page`'s callbacks. `inbox` and `page` must outlive the loop.
  /// Makes its report in `report_dir`, none if that is empty. `review`: a recording to show instead of what
  /// comes over topics; the inbox then brings requests for views alone. It must outlive the loop. Throws
  /// core::MissingError if the report cannot be made.
  ViewerLoop(const ViewerConfig& config, const runtime::CellConfig& cell, robot::SerialArm arm,
             std::vector<LinkMeshData> arm_meshes, Inbox& inbox, PageContent& page,
             const std::filesystem::path& report_dir, Review* review = nullptr);
  /// Ends the thread if it runs.
  ~ViewerLoop() { end(); }

  void start();
  /// Ends the thread and completes the report, which names `page_url`. Then throws the exception that ended
  /// the thread, if there was one.
  void finish(const std::string& page_url);
  /// Returns false once the thread has ended by itself.
  bool running() const { return !ended_.load(); }
  /// Returns the health for component_status. Any thread.
  core::Health health() const;

 private:
  /// Statistics of the thread since its start.
  struct Rounds {
    std::uint64_t whole = 0, broken_off = 0;
    double per_s = 0.0;
    core::DurationHistogram work, lateness;
  };
  void end();
  void run();
  void work();
  void take_events();
  void take_queued();
  void take_recorded();
  void take(Event& event);
  bool round(double dt_s);
  core::Nanoseconds period_ns() const;
  void publish_scene();
  void publish_state();
  void open_camera();
  void serve_calibration();
  core::Health health_now() const;

  const ViewerConfig config_;
  const runtime::CellConfig cell_;
  Inbox& inbox_;
  PageContent& page_;
  Review* const review_;  // null: live
  const core::Nanoseconds start_ns_ = core::monotonic_ns();
  Publisher publisher_;
  Report report_;
  web::Broadcast<core::Health> health_;

  // Used on the viewer's thread only.
  robot::SerialArm arm_;
  std::vector<LinkMeshData> arm_meshes_;  // until they are uploaded
  ViewerState state_;
  std::unique_ptr<PoseCalibration> pose_calibration_;  // any thread; null: no real camera
  std::unique_ptr<VideoFeed> video_;                   // likewise
  std::unique_ptr<CameraView> camera_view_;
  std::unique_ptr<Drawing> drawing_;
  std::deque<Event> backlog_;
  CancelCheck views_give_up_;  // a round that must not be given up again ends with the process only
  core::Nanoseconds interactive_until_ns_ = 0, now_ns_ = 0;
  // The time of what is shown, and how far it has gone since the last round: live those of the round itself.
  core::Nanoseconds shown_ns_ = 0, recorded_ns_ = 0;
  double shown_dt_s_ = 0.0;
  Rounds rounds_;
  std::uint64_t refused_meshes_ = 0;
  core::Nanoseconds meshes_looked_ns_ = 0;  // when it was last looked for those that no object has
  dds::RefusalLog mesh_refusals_{"mesh_chunk"};

  // Drawing a picture without a graphics card takes long, and so does starting the driver.
  static constexpr double kHangsAfter_s = 20.0;
  core::Progress progress_{"render", 1.0 / config_.frame_rate_hz, kHangsAfter_s};
  std::atomic<bool> stop_{false}, ended_{false};
  std::exception_ptr problem_;
  std::thread thread_;
};

}  // namespace phantom::synthetic_viewer
