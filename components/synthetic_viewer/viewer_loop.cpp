#include "components/synthetic_viewer/viewer_loop.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/core/thread_config.hpp"
#include "common/messages/living.hpp"
#include "components/synthetic_viewer/page/page_state.hpp"

namespace phantom::synthetic_viewer {
namespace {

// Meshes are unpacked between pictures, within this time per round: many meshes must not stop the pictures
// for seconds.
constexpr core::Nanoseconds kEventBudget_ns = 60 * core::kNsPerMillisecond;
// How long the higher rate lasts after a camera was moved.
constexpr core::Nanoseconds kInteractive_ns = core::kNsPerSecond;
constexpr double kInteractiveRate_hz = 30.0;

}  // namespace

ViewerLoop::ViewerLoop(const ViewerConfig& config, const runtime::CellConfig& cell, robot::SerialArm arm,
                       std::vector<LinkMeshData> arm_meshes, Inbox& inbox, PageContent& page,
                       const std::filesystem::path& report_dir, Review* review)
    : config_(config),
      cell_(cell),
      inbox_(inbox),
      page_(page),
      review_(review),
      publisher_(config_, config_, page),
      report_(report_dir, config_.report_pictures, start_ns_),
      arm_(std::move(arm)),
      arm_meshes_(std::move(arm_meshes)) {
  for (const runtime::OtherArmConfig& other : config_.other_arms) state_.others.push_back({other.arm, {}});
  if (!config_.camera_view.camera || review_ != nullptr) return;
  const PictureFormat& format = config_.camera_view.format;
  pose_calibration_ =
      std::make_unique<PoseCalibration>(*config_.camera_view.camera, format.width_px, format.height_px);
  page_.calibration = pose_calibration_.get();
}

void ViewerLoop::start() {
  thread_ = std::thread([this] { run(); });
}

void ViewerLoop::end() {
  stop_ = true;
  inbox_.wake();
  if (thread_.joinable()) thread_.join();
}

void ViewerLoop::finish(const std::string& page_url) {
  end();
  const double seconds = core::seconds(core::monotonic_ns() - start_ns_);
  report_.finish(
      {{"frames", rounds_.whole},
       {"seconds", seconds},
       {"fps", static_cast<double>(rounds_.whole) / seconds},
       {"frame_p50_ms", 1e-6 * static_cast<double>(rounds_.work.quantile_ns(0.5))},
       {"frame_max_ms", 1e-6 * static_cast<double>(rounds_.work.max_ns())},
       {"alerts", state_.total_hits},
       {"alert_to_picture_max_ms", 1e-6 * static_cast<double>(publisher_.alert_to_picture().max_ns())},
       {"page", page_url},
       {"graphics", state_.graphics}});
  if (problem_) std::rethrow_exception(problem_);
}

core::Health ViewerLoop::health() const {
  core::Health health = health_.newest_or_default();
  // Valid also while the loop hangs and before its first turn.
  core::LoopStatistics loop = progress_.statistics();
  if (!health.loops.empty()) {
    const core::LoopStatistics& measured = health.loops.front();
    loop.wakeup_p50_us = measured.wakeup_p50_us;
    loop.wakeup_p99_us = measured.wakeup_p99_us;
    loop.wakeup_max_us = measured.wakeup_max_us;
    loop.work_p50_us = measured.work_p50_us;
    loop.work_max_us = measured.work_max_us;
  }
  health.loops = {loop};
  return health;
}

void ViewerLoop::run() {
  core::apply_thread_config(core::ThreadRole::kViewer);
  progress_.begin();
  // Set before the driver starts its own threads, which inherit it.
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), config_.niceness);
  try {
    work();
  } catch (...) {
    problem_ = std::current_exception();
  }
  drawing_.reset();
  camera_view_.reset();
  if (pose_calibration_) pose_calibration_->attach(nullptr);
  video_.reset();
  progress_.end();
  ended_ = true;
  publisher_.end();
}

/// Opens the real camera, if there is one, on a thread of its own.
void ViewerLoop::open_camera() {
  if (!config_.camera_view.camera) return;
  const VideoCamera& camera = *config_.camera_view.camera;
  VideoFeed::Open open = [&camera] {
    const camera::Lens& lens = *camera.calibration.lens;
    return open_video(camera, lens.width_px, lens.height_px);
  };
  if (camera.kind == VideoKind::kSimulated)
    open = [this, &camera,
            world = std::make_shared<const SimulatedWorld>(SimulatedWorld{
                cell_, arm_, arm_meshes_, load_other_arms(cell_, config_.arm, config_.other_arms)})] {
      return open_simulated_camera(camera, config_.graphics, *world, inbox_.past);
    };
  if (camera.kind == VideoKind::kTopic)
    open = [this, &camera] {
      const camera::Lens& lens = *camera.calibration.lens;
      return open_topic(camera.name, inbox_.video, lens.width_px, lens.height_px);
    };
  // A topic needs no time to be there again.
  const core::Nanoseconds retry_ns =
      camera.kind == VideoKind::kTopic ? core::kNsPerMillisecond : 2 * core::kNsPerSecond;
  video_ = std::make_unique<VideoFeed>(std::move(open), retry_ns);
  camera_view_ = std::make_unique<CameraView>(camera, config_.camera_view.format,
                                              config_.camera_view.staleness, *video_, inbox_.past);
  if (pose_calibration_) pose_calibration_->attach(video_.get());
}

/// Draws by the pose that is in force, and tells the corners that are known while the page asks for them.
void ViewerLoop::serve_calibration() {
  if (!pose_calibration_) return;
  bool on_trial = false;
  const Calibration calibration = pose_calibration_->in_force(on_trial);
  camera_view_->stand(calibration, on_trial);
  if (pose_calibration_->open(now_ns_))
    pose_calibration_->show(drawing_->known_corners(), drawing_->bodies());
}

void ViewerLoop::work() {
  open_camera();
  drawing_ =
      std::make_unique<Drawing>(config_, cell_, std::move(arm_), arm_meshes_, state_, Drawing::kMaxTriangles,
                                config_.page.enabled ? &page_.meshes : nullptr);
  arm_meshes_.clear();
  if (camera_view_) drawing_->attach(*camera_view_);
  state_.graphics = drawing_->renderer().description();
  spdlog::info("rendering with {}", state_.graphics);
  if (config_.recording.at_start) publisher_.take({.view = *config_.recording.at_start, .record = true});
  core::Nanoseconds due_ns = core::monotonic_ns();
  now_ns_ = due_ns;
  while (!stop_) {
    if (backlog_.empty()) inbox_.wait_until(due_ns);
    const core::Nanoseconds begin_ns = core::monotonic_ns();
    rounds_.lateness.record(std::max<core::Nanoseconds>(0, begin_ns - due_ns));
    const double dt_s = core::seconds(begin_ns - now_ns_);
    now_ns_ = shown_ns_ = begin_ns;
    shown_dt_s_ = dt_s;
    take_events();
    const bool whole = round(dt_s);
    ++(whole ? rounds_.whole : rounds_.broken_off);
    rounds_.work.record(core::monotonic_ns() - begin_ns);
    progress_.tick();
    health_.publish(health_now());
    page_.switches.publish({state_.hold, state_.recording.running});
    due_ns = std::max(whole ? due_ns + period_ns() : begin_ns, core::monotonic_ns());
    // After a round that was given up for an alert, the next round's views are drawn to the end, so that a
    // burst of alerts cannot stop them. At the end nobody waits for them.
    views_give_up_ = [this, whole] { return stop_ || (whole && inbox_.urgent()); };
  }
  publisher_.end_recording();
  report_.make_remaining_pictures(*drawing_);
}

void ViewerLoop::take_events() {
  if (review_ != nullptr) return take_recorded();
  if (inbox_.arm.read(state_.arm)) state_.link_quality.take(state_.arm, now_ns_);
  inbox_.percept.read(state_.percept);
  inbox_.master.read(state_.master);
  inbox_.gripper.read(state_.gripper);
  for (std::size_t i = 0; i < state_.others.size(); ++i) inbox_.others[i].read(state_.others[i].arm);
  state_.stops = inbox_.stops.at(now_ns_);
  // Alerts are taken before meshes.
  for (Event& hit : inbox_.take_hits()) take(hit);
  take_queued();
  inbox_.live_matter =
      std::ranges::any_of(state_.objects, [](const auto& entry) { return messages::is_live(entry.first); });
  if (const auto shapes = inbox_.take_live_shapes()) drawing_->show_live(*shapes);
  if (now_ns_ - meshes_looked_ns_ < core::kNsPerSecond) return;
  meshes_looked_ns_ = now_ns_;
  drawing_->drop_meshes_of_removed_objects(now_ns_);
}

void ViewerLoop::take_queued() {
  if (backlog_.empty()) backlog_ = inbox_.take_events();
  while (!backlog_.empty() && !stop_ && core::monotonic_ns() - now_ns_ < kEventBudget_ns) {
    take(backlog_.front());
    backlog_.pop_front();
  }
}

/// Brings everything to the moment of the recording that is to be shown.
void ViewerLoop::take_recorded() {
  inbox_.take_hits();  // a request to go elsewhere is urgent, as an alert is
  for (MeshChunkSample& chunk : review_->take_meshes()) backlog_.emplace_back(std::move(chunk));
  take_queued();
  const core::Nanoseconds before_ns = recorded_ns_;
  const SkinSample painted = std::move(state_.skin);
  const Review::Shown shown = review_->advance(now_ns_, state_);
  SkinSample skin = std::exchange(state_.skin, painted);
  if (skin.received_ns != state_.skin.received_ns) drawing_->paint(skin);
  state_.skin = std::move(skin);
  if (shown.jumped) drawing_->resume(shown.at_ns);
  for (const HitSample& hit : shown.hits) drawing_->take(hit);
  shown_ns_ = recorded_ns_ = shown.at_ns;
  shown_dt_s_ = shown.jumped ? 0.0 : core::seconds(shown.at_ns - before_ns);
}

void ViewerLoop::take(Event& event) {
  if (auto* hit = std::get_if<HitSample>(&event)) {
    state_.take(*hit);
    drawing_->take(*hit);
    if (hit->cleared) return;
    if (shows_hits(state_, config_.staleness, shown_ns_)) publisher_.take(*hit);
    report_.take(*hit);
  } else if (auto* object = std::get_if<ObjectSample>(&event)) {
    state_.take(std::move(*object), shown_ns_);
  } else if (auto* chunk = std::get_if<MeshChunkSample>(&event)) {
    const core::Status status = drawing_->take(std::move(*chunk));
    refused_meshes_ += status ? 0 : 1;
    if (!status) mesh_refusals_.refused(status.message());
  } else if (auto* component = std::get_if<ComponentSample>(&event)) {
    state_.take(std::move(*component));
  } else if (auto* workspace = std::get_if<WorkspaceSample>(&event)) {
    state_.workspace = std::move(*workspace);
    state_.model_history.forget(state_.workspace.carried);
  } else if (auto* skin = std::get_if<SkinSample>(&event)) {
    drawing_->paint(*skin);
    state_.skin = std::move(*skin);
  } else if (const auto* uncertainty = std::get_if<UncertaintySample>(&event)) {
    state_.uncertainties[uncertainty->id] = *uncertainty;
  } else if (auto* finding = std::get_if<FindingSample>(&event)) {
    state_.take(std::move(*finding));
  } else if (auto* thing = std::get_if<LiveObjectSample>(&event)) {
    state_.take(std::move(*thing));
  } else if (auto* doubt = std::get_if<DoubtSample>(&event)) {
    state_.take(std::move(*doubt));
  } else if (auto* command = std::get_if<Command>(&event)) {
    state_.take(*command);
  } else if (auto* request = std::get_if<ViewRequest>(&event)) {
    state_.cameras.take(*request);
    if (request->approach) state_.approach = *request->approach;
    interactive_until_ns_ = now_ns_ + kInteractive_ns;
    publisher_.take(*request);
  }
}

/// Returns the period of the rounds, shorter while the operator moves a camera, or a recording is played for
/// browsers that draw it by themselves.
core::Nanoseconds ViewerLoop::period_ns() const {
  const bool played = review_ != nullptr && page_.scene.followers > 0 && review_->position(now_ns_).playing;
  const bool interactive = played || now_ns_ < interactive_until_ns_;
  return core::from_seconds(
      1.0 / (interactive ? std::max(kInteractiveRate_hz, config_.frame_rate_hz) : config_.frame_rate_hz));
}

/// Makes one round of pictures. Returns false if it was given up because an alert waits for its picture.
bool ViewerLoop::round(double dt_s) {
  state_.recording = publisher_.recording();
  if (drawing_->advance(shown_ns_, shown_dt_s_)) state_.cameras.home(View::kHit);
  serve_calibration();
  if (dt_s > 0) rounds_.per_s += (1 - std::exp(-dt_s)) * (1 / dt_s - rounds_.per_s);
  // Threats come first: the operator waits for them.
  publisher_.show_threats(*drawing_);
  page_.view_pose.publish(drawing_->view_pose());
  publish_scene();
  publish_state();
  if (!publisher_.show_views(*drawing_, state_.arm.received_ns != 0, views_give_up_)) return false;
  if (review_ != nullptr) {
    publisher_.show_listed(*drawing_, state_.hits);
    return true;
  }
  return report_.make_pictures(*drawing_, state_.arm, drawing_->scene().complete(state_),
                               [this] { return inbox_.urgent(); });
}

void ViewerLoop::publish_scene() {
  if (page_.scene.followers == 0) return;
  SceneBase base = drawing_->scene_base();
  if (review_ != nullptr) {
    base.recorded_ns = shown_ns_;
    base.state.stops = state_.stops;
  }
  page_.scene.publish(std::move(base));
}

void ViewerLoop::publish_state() {
  if (!page_.state_wanted(now_ns_)) return page_.state.clear();
  const CellScene& scene = drawing_->scene();
  PageFacts facts{cell_.name,
                  config_.page.allow_commands,
                  config_.tool_view.enabled,
                  rounds_.per_s,
                  state_.graphics,
                  review_ == nullptr ? start_ns_ : review_->begin_ns(),
                  missing_words(state_, scene, config_.staleness, shown_ns_),
                  {},
                  config_.camera_view.camera ? config_.camera_view.camera->name : "",
                  config_.main_view.azimuth_rad,
                  gauges_share(config_.main_view.format.height_px)};
  if (review_ != nullptr) facts.review = review_->position(now_ns_);
  page_.state.publish(page_state(state_, scene, drawing_->hit_view(), config_.staleness, facts, shown_ns_));
}

core::Health ViewerLoop::health_now() const {
  core::Health health;
  const CellScene& scene = drawing_->scene();
  const bool fresh = age_s(state_.arm.received_ns, shown_ns_) <= config_.staleness.slave_s;
  health.state =
      scene.complete(state_) && fresh ? core::ComponentState::kRunning : core::ComponentState::kReady;
  if (state_.arm.received_ns != 0 && !fresh) health.state = core::ComponentState::kDegraded;
  health.message = english_text(missing_words(state_, scene, config_.staleness, shown_ns_));
  const auto us = [](core::Nanoseconds ns) { return static_cast<double>(ns) / 1e3; };
  const auto ms = [](core::Nanoseconds ns) { return static_cast<double>(ns) / 1e6; };
  const core::DurationHistogram& alert_to_picture = publisher_.alert_to_picture();
  health.loops.push_back({.name = "render",
                          .wakeup_p50_us = us(rounds_.lateness.quantile_ns(0.5)),
                          .wakeup_p99_us = us(rounds_.lateness.quantile_ns(0.99)),
                          .wakeup_max_us = us(rounds_.lateness.max_ns()),
                          .work_p50_us = us(rounds_.work.quantile_ns(0.5)),
                          .work_max_us = us(rounds_.work.max_ns())});
  health.figures = {
      {"objects", static_cast<double>(state_.objects.size()), ""},
      {"meshes", static_cast<double>(scene.meshes.size()), ""},
      {"meshes_refused", static_cast<double>(refused_meshes_ + drawing_->meshes_given_up()), ""},
      {"events_lost", static_cast<double>(inbox_.lost()), ""},
      {"forgotten", static_cast<double>(state_.forgotten + inbox_.stops.forgotten()), ""},
      {"alerts", static_cast<double>(state_.total_hits), ""},
      {"alerts_pictured", static_cast<double>(alert_to_picture.count()), ""},
      {"video_pictures", video_ ? static_cast<double>(video_->status().number) : 0.0, ""},
      {"video_refused", video_ ? static_cast<double>(video_->status().refused) : 0.0, ""},
      {"rounds_broken_off", static_cast<double>(rounds_.broken_off), ""},
      {"alert_to_picture_last", ms(publisher_.last_alert_to_picture_ns()), "ms"},
      {"alert_to_picture_p50", ms(alert_to_picture.quantile_ns(0.5)), "ms"},
      {"alert_to_picture_max", ms(alert_to_picture.max_ns()), "ms"}};
  return health;
}

}  // namespace phantom::synthetic_viewer
