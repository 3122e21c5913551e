#include "components/synthetic_viewer/viewer_loop.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

namespace phantom::synthetic_viewer {
namespace {

constexpr std::size_t kHitJpegs = ViewerState::kMaxHits;
constexpr double kHitZone_m = 0.02;  // radius of what a view of a hit zone should see
// Meshes are unpacked between pictures; a cell full of them must not stop the pictures for seconds.
constexpr core::Nanoseconds kNewsBudget_ns = 60 * core::kNsPerMillisecond;

Eigen::Vector3d eigen(const Vector3& v) { return {v[0], v[1], v[2]}; }

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
      report_(std::move(report)) {
  page_.main_png = [this] {
    std::shared_ptr<const Image> image;
    {
      const std::lock_guard lock(shared_mutex_);
      image = newest_main_;
    }
    return image ? encode_png(*image) : std::string();
  };
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
  summary.alert_to_picture_max_s = core::seconds(alert_to_picture_max_ns_);
  summary.page = page_url;
  summary.graphics = graphics_;
  report_.finish(summary);
  if (problem_) std::rethrow_exception(problem_);
}

core::Health ViewerLoop::health() {
  const std::lock_guard lock(shared_mutex_);
  return health_;
}

void ViewerLoop::run() {
  // Before the driver starts threads of its own, which inherit it.
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), config_.niceness);
  try {
    work();
  } catch (...) {
    problem_ = std::current_exception();
  }
  renderer_.reset();
  ended_ = true;
}

void ViewerLoop::work() {
  set_up();
  const core::Nanoseconds period_ns = core::from_seconds(1.0 / config_.frame_rate_hz);
  core::Nanoseconds due_ns = core::monotonic_ns();
  now_ns_ = due_ns;
  while (!stop_) {
    if (backlog_.empty()) inbox_.wait_until(due_ns);
    const core::Nanoseconds begin_ns = core::monotonic_ns();
    lateness_.record(std::max<core::Nanoseconds>(0, begin_ns - due_ns));
    const double dt_s = core::seconds(begin_ns - now_ns_);
    now_ns_ = begin_ns;
    take_news();
    tick(dt_s);
    work_.record(core::monotonic_ns() - begin_ns);
    publish_health();
    due_ns = std::max(due_ns + period_ns, core::monotonic_ns());
  }
  if (report_.wanted()) report_.save("main", main_photograph());
}

void ViewerLoop::set_up() {
  renderer_ = std::make_unique<Renderer>(config_.graphics);
  graphics_ = renderer_->description();
  spdlog::info("rendering with {}", graphics_);
  for (const LinkMeshData& part : arm_meshes_) {
    scene_.links.push_back({part.link,
                            part.X_link_mesh,
                            part.colour,
                            {renderer_->upload(part.mesh), std::make_shared<RayMesh>(part.mesh)}});
  }
  arm_meshes_.clear();
}

void ViewerLoop::take_news() {
  inbox_.arm.read(state_.arm);
  inbox_.percept.read(state_.percept);
  inbox_.master.read(state_.master);
  std::deque<Event> news = inbox_.take_events();
  std::move(news.begin(), news.end(), std::back_inserter(backlog_));
  while (!backlog_.empty() && !stop_ && core::monotonic_ns() - now_ns_ < kNewsBudget_ns) {
    take(backlog_.front());
    backlog_.pop_front();
  }
}

void ViewerLoop::take(Event& event) {
  if (auto* hit = std::get_if<HitSample>(&event)) {
    state_.take(*hit);
    viewer_.take({hit->alert, hit->cleared, eigen(hit->look_at_m), eigen(hit->pgv)});
    if (!hit->cleared) unphotographed_.push_back(*hit);
  } else if (auto* object = std::get_if<ObjectSample>(&event)) {
    const std::uint16_t id = object->id;
    state_.objects[id] = std::move(*object);
  } else if (auto* gone = std::get_if<ObjectGone>(&event)) {
    state_.objects.erase(gone->id);
  } else if (auto* chunk = std::get_if<MeshChunkSample>(&event)) {
    take_chunk(std::move(*chunk));
  } else if (auto* component = std::get_if<ComponentSample>(&event)) {
    state_.take(std::move(*component));
  } else if (auto* command = std::get_if<Command>(&event)) {
    state_.take(*command);
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

void ViewerLoop::tick(double dt_s) {
  objects_ = scene_.obstacles(state_, false);
  const RayScene obstacles = scene_.obstacles(state_, true);
  const VisibleShare visible = [&obstacles](const ViewSituation& situation, const Eigen::Vector3d& eye_m) {
    return obstacles.visible_share(situation.look_at_m, situation.pgv, kHitZone_m, eye_m);
  };
  hit_ = viewer_.step(state_.hold, state_.wish, visible, dt_s);
  if (dt_s > 0) frames_per_s_ += (1 - std::exp(-dt_s)) * (1 / dt_s - frames_per_s_);
  // What threatens comes first: it is what the operator waits for.
  show_hit();
  publish_state();
  show_main();
  show_tool();
  photograph_alerts(visible);
  photograph_milestones();
  ++frames_;
}

void ViewerLoop::show_hit() {
  Broadcast& jpeg = page_.hit_jpeg;
  if (hit_.alert == 0) return jpeg.clear();
  const bool unseen = std::any_of(unphotographed_.begin(), unphotographed_.end(),
                                  [this](const HitSample& hit) { return hit.alert == hit_.alert; });
  if (jpeg.followers == 0 && !unseen) return jpeg.clear();
  Image image = renderer_->render(compositor_.hit_frame(moment(), hit_), config_.hit_view.format);
  draw_hud(image, compositor_.hit_hud(moment(), hit_));
  std::string encoded = encode_jpeg(image, config_.jpeg_quality);
  if (unseen) {
    const std::lock_guard lock(shared_mutex_);
    hit_jpegs_[hit_.alert] = encoded;
    while (hit_jpegs_.size() > kHitJpegs) hit_jpegs_.erase(hit_jpegs_.begin());
  }
  jpeg.publish(std::move(encoded));
  for (const HitSample& hit : unphotographed_) {
    alert_to_picture_max_ns_ = std::max(alert_to_picture_max_ns_, core::monotonic_ns() - hit.received_ns);
  }
}

void ViewerLoop::show_main() {
  auto image = std::make_shared<Image>(
      renderer_->render(compositor_.main_frame(moment(), hit_), config_.main_view.format));
  draw_hud(*image, compositor_.main_hud(moment()));
  {
    const std::lock_guard lock(shared_mutex_);
    newest_main_ = image;
  }
  if (page_.main_jpeg.followers == 0) return page_.main_jpeg.clear();
  page_.main_jpeg.publish(encode_jpeg(*image, config_.jpeg_quality));
}

void ViewerLoop::show_tool() {
  if (!config_.tool_view.enabled) return;
  if (page_.tool_jpeg.followers == 0 || state_.arm.received_ns == 0) return page_.tool_jpeg.clear();
  Image image = renderer_->render(compositor_.tool_frame(moment()), config_.tool_view.format);
  draw_hud(image, compositor_.tool_hud(moment()));
  page_.tool_jpeg.publish(encode_jpeg(image, config_.jpeg_quality));
}

void ViewerLoop::photograph_alerts(const VisibleShare& visible) {
  for (const HitSample& hit : std::exchange(unphotographed_, {})) {
    if (!report_.wants_hit_pictures()) continue;
    // An alert that came while another was shown gets its picture all the same, from the node that suits it.
    HitView view = hit_;
    if (view.alert != hit.alert) {
      SyntheticViewer alone(config_.hit_view.rule);
      alone.take({hit.alert, false, eigen(hit.look_at_m), eigen(hit.pgv)});
      view = alone.step(false, state_.wish, visible, 0.0);
    }
    PictureFormat format = config_.main_view.format;
    format.samples = config_.report_samples;
    Image image = renderer_->render(compositor_.hit_frame(moment(), view), format);
    draw_hud(image, compositor_.hit_hud(moment(), view));
    report_.save_hit(hit.alert, node_name(view.node), core::seconds(hit.received_ns - start_ns_), hit.utc_ns,
                     image);
  }
}

Image ViewerLoop::main_photograph() {
  PictureFormat format = config_.main_view.format;
  format.samples = config_.report_samples;
  Image image = renderer_->render(compositor_.main_frame(moment(), hit_), format);
  draw_hud(image, compositor_.main_hud(moment()));
  return image;
}

void ViewerLoop::photograph_milestones() {
  if (!report_.wanted()) return;
  const auto once = [this](bool& saved, bool now, const char* name) {
    if (saved || !now) return;
    saved = true;
    report_.save(name, main_photograph());
  };
  once(saved_start_, scene_.complete(state_) && state_.arm.received_ns != 0, "main_start");
  once(saved_hit_, hit_.alert != 0, "main_first_hit");
  once(saved_contact_, state_.arm.contact, "main_first_contact");
}

void ViewerLoop::publish_state() {
  if (page_.state_json.followers == 0) return page_.state_json.clear();
  const PageFacts facts{
      cell_name_, config_.page.allow_commands, config_.tool_view.enabled, frames_per_s_, graphics_,
      start_ns_};
  page_.state_json.publish(page_state_json(state_, scene_, hit_, config_.staleness, facts, now_ns_));
}

void ViewerLoop::publish_health() {
  core::Health health;
  const bool complete = scene_.complete(state_);
  const bool fresh = age_s(state_.arm.received_ns, now_ns_) <= config_.staleness.slave_s;
  health.state = complete && fresh ? core::ComponentState::kRunning : core::ComponentState::kReady;
  if (state_.arm.received_ns != 0 && !fresh) {
    health.state = core::ComponentState::kDegraded;
    health.message = "the slave is silent: the arm is shown where it was last";
  } else if (state_.arm.received_ns == 0) {
    health.message = "waiting for the slave";
  } else if (!complete) {
    health.message = "waiting for the cell's objects and meshes";
  }
  const double period_s = 1.0 / config_.frame_rate_hz;
  const double seconds = std::max(1e-9, core::seconds(now_ns_ - start_ns_));
  health.loops.push_back({"render", period_s, static_cast<double>(frames_) / seconds,
                          static_cast<double>(lateness_.quantile_ns(0.5)) / 1e3,
                          static_cast<double>(lateness_.quantile_ns(0.99)) / 1e3,
                          static_cast<double>(lateness_.max_ns()) / 1e3,
                          static_cast<double>(work_.quantile_ns(0.5)) / 1e3,
                          static_cast<double>(work_.max_ns()) / 1e3, frames_, 0});
  health.figures = {{"objects", static_cast<double>(state_.objects.size()), ""},
                    {"meshes", static_cast<double>(scene_.meshes.size()), ""},
                    {"meshes_refused", static_cast<double>(refused_meshes_), ""},
                    {"events_lost", static_cast<double>(inbox_.lost()), ""},
                    {"alerts", static_cast<double>(state_.total_hits), ""},
                    {"alert_to_picture_max", core::seconds(alert_to_picture_max_ns_) * 1e3, "ms"}};
  const std::lock_guard lock(shared_mutex_);
  health_ = std::move(health);
}

}  // namespace phantom::synthetic_viewer
