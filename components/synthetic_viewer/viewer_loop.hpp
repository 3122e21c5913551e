#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/histogram.hpp"
#include "common/core/progress.hpp"
#include "common/runtime/cell.hpp"
#include "components/synthetic_viewer/arm_meshes.hpp"
#include "components/synthetic_viewer/compositor.hpp"
#include "components/synthetic_viewer/inbox.hpp"
#include "components/synthetic_viewer/mesh_assembler.hpp"
#include "components/synthetic_viewer/page_content.hpp"
#include "components/synthetic_viewer/page_state.hpp"
#include "components/synthetic_viewer/recorder.hpp"
#include "components/synthetic_viewer/report.hpp"
#include "components/synthetic_viewer/view_painter.hpp"

namespace phantom::synthetic_viewer {

/// The viewer's own thread: takes what came in, decides what to show, draws, and hands the pictures out. It
/// owns the OpenGL context and runs at low priority.
class ViewerLoop {
 public:
  /// Fills in `page`'s callbacks. `inbox` and `page` must outlive the loop.
  ViewerLoop(const ViewerConfig& config, const runtime::CellConfig& cell, robot::SerialArm arm,
             std::vector<LinkMeshData> arm_meshes, Inbox& inbox, PageContent& page, Report report);
  /// Ends the thread, if need be.
  ~ViewerLoop();

  void start();
  /// Ends the thread and completes the report, in which `page_url` is named; then throws what ended the
  /// thread before, if anything did.
  void finish(const std::string& page_url);
  /// False once the thread has ended by itself.
  bool running() const { return !ended_.load(); }
  /// For component_status. Any thread.
  core::Health health();
  /// Any thread.
  ViewSwitches switches();
  /// How the view stands that the operator looks at: the hit zone's while one is shown, else the main view.
  /// Any thread.
  ViewPoseSample view_pose();

 private:
  void run();
  void work();
  void set_up();
  void take_news();
  void take(Event& event);
  void take_chunk(MeshChunkSample chunk);
  void take_skin(SkinSample skin);
  void take_request(const ViewRequest& request);
  bool tick(double dt_s);
  core::Nanoseconds period_ns() const;
  Compositor::Moment moment() const { return {state_, objects_, bodies_, now_ns_}; }
  void choose_hit_view(double dt_s);
  struct AlertMoment;
  AlertMoment at_alert(const HitSample& hit) const;
  HitView view_of(const HitSample& hit, const RayScene& bodies) const;
  void show_first(const HitSample& hit);
  void show_hit();
  bool show_main();
  bool show_tool();
  bool photograph_alert();
  bool photograph_milestones();
  void finish_photographs();
  std::optional<Image> photograph(Compositor::Picture picture, const GiveUp& give_up);
  void publish_state();
  void publish_view_pose();
  void publish_health();
  std::string words() const;
  std::string page_snapshot();

  ViewerConfig config_;
  std::string cell_name_;
  std::vector<LinkMeshData> arm_meshes_;
  Inbox& inbox_;
  PageContent& page_;

  // The viewer thread's own.
  CellScene scene_;
  Compositor compositor_;
  ViewerState state_;
  SyntheticViewer viewer_;
  MeshAssembler assembler_;
  std::deque<Event> backlog_;
  std::unique_ptr<Renderer> renderer_;
  Report report_;
  HitView hit_;
  RayScene objects_, bodies_;  // where they stand now, without and with the arm
  std::array<ViewPainter, kViews.size()> painters_;
  std::vector<geometry::BoundingBox> link_boxes_;
  Recorder recorder_;
  const GiveUp more_urgent_ = [this] { return inbox_.urgent(); };
  GiveUp views_give_up_;                  // null in a round whose views must not wait again
  std::deque<HitSample> unseen_;          // alerts of which there is no picture yet
  std::deque<HitSample> unphotographed_;  // alerts for the report
  core::Nanoseconds lively_until_ns_ = 0, first_object_ns_ = 0;
  bool saved_start_ = false, saved_hit_ = false, saved_contact_ = false;
  core::Nanoseconds start_ns_ = 0, now_ns_ = 0;
  std::uint64_t frames_ = 0, broken_off_ = 0, refused_meshes_ = 0;
  double frames_per_s_ = 0.0;
  core::DurationHistogram work_, lateness_, alert_to_picture_;
  core::Nanoseconds last_alert_to_picture_ns_ = 0;
  std::string graphics_;

  // Shared with other threads.
  std::mutex shared_mutex_;
  std::condition_variable snapshot_made_;
  core::Health health_;
  ViewSwitches switches_;
  ViewPoseSample view_pose_;
  std::uint64_t snapshots_wanted_ = 0, snapshots_made_ = 0;
  std::shared_ptr<const Image> snapshot_;
  std::map<std::uint32_t, std::string> hit_jpegs_;

  // A picture drawn without a graphics card takes long, and so does the driver's start.
  static constexpr double kHangsAfter_s = 20.0;
  core::Progress progress_{"render", 1.0 / config_.frame_rate_hz, kHangsAfter_s};
  std::atomic<bool> stop_{false}, ended_{false};
  std::exception_ptr problem_;
  std::thread thread_;
};

}  // namespace phantom::synthetic_viewer
