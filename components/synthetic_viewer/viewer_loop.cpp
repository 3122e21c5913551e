#include "components/synthetic_viewer/viewer_loop.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <functional>

#include "common/core/thread_place.hpp"

namespace phantom::synthetic_viewer {
namespace {

// Meshes are unpacked between pictures; a cell full of them must not stop the pictures for seconds.
constexpr core::Nanoseconds kNewsBudget_ns = 60 * core::kNsPerMillisecond;

}  // namespace

ViewerLoop::ViewerLoop(const ViewerConfig& config, const runtime::CellConfig& cell, robot::SerialArm arm,
                       std::vector<LinkMeshData> arm_meshes, Inbox& inbox, PageContent& page, Report report)
    : config_(config),
      cell_name_(cell.name),
      arm_meshes_(std::move(arm_meshes)),
      inbox_(inbox),
      page_(page),
      scene_(std::move(arm), cell.min_m, cell.max_m),
      compositor_(config_, cell.name, scene_),
      viewer_(config.hit_view.rule),
      report_(std::move(report)),
      recorder_(config.recording) {
  page_.main_png = [this] { return page_snapshot(); };
  page_.hit_picture = [this](std::uint32_t alert) {
    const std::lock_guard lock(shared_mutex_);
    const auto found = hit_jpegs_.find(alert);
    return found == hit_jpegs_.end() ? std::string() : found->second;
  };
}

ViewerLoop::~ViewerLoop() {
  stop_ = true;
  inbox_.wake();
  if (thread_.joinable()) thread_.join();
}

void ViewerLoop::start() {
  start_ns_ = core::monotonic_ns();
  thread_ = std::thread([this] { run(); });
}

void ViewerLoop::finish(const std::string& page_url) {
  stop_ = true;
  inbox_.wake();
  if (thread_.joinable()) thread_.join();
  Report::Summary summary;
  summary.frames = frames_;
  summary.seconds = core::seconds(core::monotonic_ns() - start_ns_);
  summary.frame_p50_s = core::seconds(work_.quantile_ns(0.5));
  summary.frame_max_s = core::seconds(work_.max_ns());
  summary.alerts = state_.total_hits;
  summary.alert_to_picture_max_s = core::seconds(alert_to_picture_.max_ns());
  summary.page = page_url;
  summary.graphics = graphics_;
  report_.finish(summary);
  if (problem_) std::rethrow_exception(problem_);
}

core::Health ViewerLoop::health() {
  core::Health health;
  {
    const std::lock_guard lock(shared_mutex_);
    health = health_;
  }
  core::LoopStatistics loop = progress_.statistics();  // also while the loop hangs, and before its first turn
  if (!health.loops.empty()) {
    const core::LoopStatistics& told = health.loops.front();
    loop.wakeup_p50_us = told.wakeup_p50_us;
    loop.wakeup_p99_us = told.wakeup_p99_us;
    loop.wakeup_max_us = told.wakeup_max_us;
    loop.work_p50_us = told.work_p50_us;
    loop.work_max_us = told.work_max_us;
  }
  health.loops = {loop};
  return health;
}

ViewSwitches ViewerLoop::switches() {
  const std::lock_guard lock(shared_mutex_);
  return switches_;
}

ViewPoseSample ViewerLoop::view_pose() {
  const std::lock_guard lock(shared_mutex_);
  return view_pose_;
}

void ViewerLoop::run() {
  core::take_place(core::ThreadRole::kViewer);
  progress_.begin();
  // Before the driver starts threads of its own, which inherit it.
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), config_.niceness);
  try {
    work();
  } catch (...) {
    problem_ = std::current_exception();
  }
  renderer_.reset();
  progress_.end();
  ended_ = true;
}

void ViewerLoop::work() {
  set_up();
  if (config_.recording.at_start) take_request({.view = *config_.recording.at_start, .record = true});
  core::Nanoseconds due_ns = core::monotonic_ns();
  now_ns_ = due_ns;
  while (!stop_) {
    if (backlog_.empty()) inbox_.wait_until(due_ns);
    const core::Nanoseconds begin_ns = core::monotonic_ns();
    lateness_.record(std::max<core::Nanoseconds>(0, begin_ns - due_ns));
    const double dt_s = core::seconds(begin_ns - now_ns_);
    now_ns_ = begin_ns;
    take_news();
    const bool whole = tick(dt_s);
    broken_off_ += whole ? 0 : 1;
    work_.record(core::monotonic_ns() - begin_ns);
    progress_.tick();
    publish_health();
    due_ns = std::max(whole ? due_ns + period_ns() : begin_ns, core::monotonic_ns());
    // A round that was broken off for an alert is followed by one whose views are not: a flood stops none.
    views_give_up_ = whole ? more_urgent_ : GiveUp();
  }
  recorder_.end();
  finish_photographs();
  if (report_.wanted()) report_.save("main", *photograph(compositor_.main_picture(moment(), hit_), {}));
}

void ViewerLoop::set_up() {
  renderer_ = std::make_unique<Renderer>(config_.graphics);
  graphics_ = renderer_->description();
  spdlog::info("rendering with {}", graphics_);
  for (const LinkMeshData& part : arm_meshes_) {
    scene_.links.push_back({part.link,
                            part.X_link_mesh,
                            part.colour,
                            {renderer_->upload(part.mesh), std::make_shared<RayMesh>(part.mesh)},
                            part.mesh.bounding_box()});
  }
  arm_meshes_.clear();
  link_boxes_ = scene_.link_boxes();
}

void ViewerLoop::take_news() {
  if (inbox_.arm.read(state_.arm)) state_.link_quality.take(state_.arm, now_ns_);
  inbox_.percept.read(state_.percept);
  inbox_.master.read(state_.master);
  state_.stops = inbox_.stops.at(now_ns_);
  std::deque<Event> news = inbox_.take_events();
  // Alerts do not queue behind meshes.
  const auto others = std::stable_partition(
      news.begin(), news.end(), [](const Event& event) { return std::holds_alternative<HitSample>(event); });
  std::for_each(news.begin(), others, [this](Event& hit) { take(hit); });
  std::move(others, news.end(), std::back_inserter(backlog_));
  while (!backlog_.empty() && !stop_ && core::monotonic_ns() - now_ns_ < kNewsBudget_ns) {
    take(backlog_.front());
    backlog_.pop_front();
  }
}

void ViewerLoop::take(Event& event) {
  if (auto* hit = std::get_if<HitSample>(&event)) {
    state_.take(*hit);
    viewer_.take({hit->alert, hit->cleared, eigen(hit->look_at_m), eigen(hit->pgv)});
    if (hit->cleared) return;
    unseen_.push_back(*hit);
    if (report_.wants_hit_pictures()) unphotographed_.push_back(*hit);
  } else if (auto* object = std::get_if<ObjectSample>(&event)) {
    if (first_object_ns_ == 0) first_object_ns_ = now_ns_;
    const std::uint16_t id = object->id;
    state_.objects[id] = std::move(*object);
  } else if (auto* gone = std::get_if<ObjectGone>(&event)) {
    state_.objects.erase(gone->id);
  } else if (auto* chunk = std::get_if<MeshChunkSample>(&event)) {
    take_chunk(std::move(*chunk));
  } else if (auto* component = std::get_if<ComponentSample>(&event)) {
    state_.take(std::move(*component));
  } else if (auto* workspace = std::get_if<WorkspaceSample>(&event)) {
    state_.workspace = *workspace;
  } else if (auto* skin = std::get_if<SkinSample>(&event)) {
    take_skin(std::move(*skin));
  } else if (auto* command = std::get_if<Command>(&event)) {
    state_.take(*command);
  } else if (auto* request = std::get_if<ViewRequest>(&event)) {
    take_request(*request);
  }
}

/// Paints the links of which any patch feels, or felt until now.
void ViewerLoop::take_skin(SkinSample skin) {
  std::vector<char> felt(link_boxes_.size(), 0);
  for (const SkinSample* sample : {&state_.skin, &skin}) {
    for (const SkinPatchSample& patch : sample->felt) felt[patch.link] = 1;
  }
  for (std::size_t link = 0; link < felt.size(); ++link) {
    if (felt[link] == 0) continue;
    renderer_->paint(static_cast<PaintHandle>(link),
                     paint_link(link_boxes_[link], skin.patch_m, skin.felt, link));
  }
  const auto differs = [](const SkinPatchSample& a, const SkinPatchSample& b) {
    return a.link != b.link || a.closeness != b.closeness || a.middle_m != b.middle_m;
  };
  const auto& before = state_.skin.felt;
  const bool changed =
      before.size() != skin.felt.size() ||
      std::mismatch(before.begin(), before.end(), skin.felt.begin(), std::not_fn(differs)).first !=
          before.end();
  if (changed) ++scene_.paint_number;
  state_.skin = std::move(skin);
}

void ViewerLoop::take_request(const ViewRequest& request) {
  constexpr core::Nanoseconds kLively_ns = core::kNsPerSecond;
  state_.cameras.take(request);
  lively_until_ns_ = now_ns_ + kLively_ns;
  if (!request.record) return;
  if (*request.record) {
    recorder_.begin(request.view, page_.view(request.view).image);
  } else {
    recorder_.end();
  }
}

void ViewerLoop::take_chunk(MeshChunkSample chunk) {
  const std::uint64_t hash = chunk.mesh_hash;
  if (scene_.meshes.count(hash) > 0) return;  // the same again: content does not change under its hash
  auto mesh = assembler_.add(std::move(chunk));
  if (!mesh) {
    ++refused_meshes_;
    spdlog::warn("{}", mesh.status().message());
  } else if (mesh->has_value()) {
    scene_.meshes[hash] = {renderer_->upload(**mesh), std::make_shared<RayMesh>(**mesh)};
  }
}

void ViewerLoop::publish_state() {
  if (!page_.state_wanted(now_ns_)) return page_.state_json.clear();
  const PageFacts facts{
      cell_name_, config_.page.allow_commands, config_.tool_view.enabled, frames_per_s_, graphics_, start_ns_,
      words()};
  page_.state_json.publish(page_state_json(state_, scene_, hit_, config_.staleness, facts, now_ns_));
}

/// One sentence about what is missing; empty if nothing is.
std::string ViewerLoop::words() const {
  constexpr double kPatience_s = 5.0;
  if (state_.arm.received_ns == 0) return "waiting for the slave";
  if (age_s(state_.arm.received_ns, now_ns_) > config_.staleness.slave_s)
    return "the slave is silent: the arm is shown where it was last";
  if (state_.objects.empty()) return "waiting for the cell's objects";
  const std::vector<std::string> missing = scene_.missing(state_);
  if (missing.empty())
    return state_.recording.problem.empty() ? "" : "recording: " + state_.recording.problem;
  std::string text = core::seconds(now_ns_ - first_object_ns_) < kPatience_s
                         ? "waiting for the meshes of "
                         : "shown without what has no mesh: ";
  for (std::size_t i = 0; i < missing.size() && i < 4; ++i) text += (i == 0 ? "" : ", ") + missing[i];
  return missing.size() > 4 ? text + " and " + std::to_string(missing.size() - 4) + " more" : text;
}

void ViewerLoop::publish_health() {
  core::Health health;
  const bool complete = scene_.complete(state_);
  const bool fresh = age_s(state_.arm.received_ns, now_ns_) <= config_.staleness.slave_s;
  health.state = complete && fresh ? core::ComponentState::kRunning : core::ComponentState::kReady;
  if (state_.arm.received_ns != 0 && !fresh) health.state = core::ComponentState::kDegraded;
  health.message = words();
  const auto us = [](core::Nanoseconds ns) { return static_cast<double>(ns) / 1e3; };
  health.loops.push_back({.name = "render",
                          .wakeup_p50_us = us(lateness_.quantile_ns(0.5)),
                          .wakeup_p99_us = us(lateness_.quantile_ns(0.99)),
                          .wakeup_max_us = us(lateness_.max_ns()),
                          .work_p50_us = us(work_.quantile_ns(0.5)),
                          .work_max_us = us(work_.max_ns())});
  health.figures = {
      {"objects", static_cast<double>(state_.objects.size()), ""},
      {"meshes", static_cast<double>(scene_.meshes.size()), ""},
      {"meshes_refused", static_cast<double>(refused_meshes_), ""},
      {"events_lost", static_cast<double>(inbox_.lost()), ""},
      {"alerts", static_cast<double>(state_.total_hits), ""},
      {"alerts_pictured", static_cast<double>(alert_to_picture_.count()), ""},
      {"rounds_broken_off", static_cast<double>(broken_off_), ""},
      {"alert_to_picture_last", static_cast<double>(last_alert_to_picture_ns_) / 1e6, "ms"},
      {"alert_to_picture_p50", static_cast<double>(alert_to_picture_.quantile_ns(0.5)) / 1e6, "ms"},
      {"alert_to_picture_max", static_cast<double>(alert_to_picture_.max_ns()) / 1e6, "ms"}};
  const std::lock_guard lock(shared_mutex_);
  health_ = std::move(health);
  switches_ = {state_.hold, state_.recording.running};
}

}  // namespace phantom::synthetic_viewer
