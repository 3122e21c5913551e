#include "components/synthetic_viewer/scene/drawing.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <set>

namespace phantom::synthetic_viewer {
namespace {

constexpr std::size_t kMaxToolPoints = 200;  // of each of its parts

}  // namespace

Drawing::Drawing(const SceneConfig& config, const runtime::CellConfig& cell, robot::SerialArm arm,
                 const std::vector<LinkMeshData>& arm_meshes, const ViewerState& state,
                 std::size_t most_triangles, MeshStore* kept)
    : config_(config),
      state_(state),
      most_triangles_(most_triangles),
      kept_(kept),
      renderer_(config.graphics, scene_scale(cell.min_m, cell.max_m)),
      scene_(std::move(arm), cell.min_m, cell.max_m, cell.arm(config.arm).name),
      compositor_(config, cell.name, scene_),
      viewer_(at_scale(config.hit_view.rule, scene_.scale())),
      approach_(at_scale(config.hit_view.rule, scene_.scale()).choice, scene_.scale()) {
  const auto upload = [&](const LinkMeshData& part, std::vector<LinkBody>& links) {
    links.push_back(uploaded(part, renderer_, config.camera_view.camera.has_value()));
    if (kept_ != nullptr) kept_->put(links.back().body.hash, part.mesh);
  };
  for (const LinkMeshData& part : arm_meshes) upload(part, scene_.links);
  for (OtherArmData& other : load_other_arms(cell, config.arm, config.other_arms)) {
    CellScene::OtherArm& made =
        scene_.others.emplace_back(CellScene::OtherArm{std::move(other.name), std::move(other.arm), {}});
    for (const LinkMeshData& part : other.meshes) upload(part, made.links);
  }
  scene_.zones = zones_of(cell);
  link_boxes_ = scene_.link_boxes();
}

core::Status Drawing::take(MeshChunkSample chunk) {
  const std::uint64_t hash = chunk.mesh_hash;
  if (const auto known = scene_.meshes.find(hash); known != scene_.meshes.end()) {
    known->second.unnamed_ns = 0;  // it is sent again because an object is about to have it again
    return {};                     // a hash stands for one content
  }
  auto mesh = assembler_.add(std::move(chunk));
  if (!mesh) return mesh.status();
  if (!mesh->has_value()) return {};
  const std::size_t triangles = (*mesh)->triangles.size();
  if (!make_room(triangles))
    return core::Status(
        core::ErrorCode::kResourceExhausted,
        "the meshes of all objects have too many triangles; allowed: " + std::to_string(most_triangles_) +
            " in " + std::to_string(kMaxMeshes) + " meshes");
  MeshBody& body = scene_.meshes[hash] = uploaded(**mesh, renderer_, config_.camera_view.camera.has_value());
  if (kept_ != nullptr) kept_->put(hash, std::move(**mesh));
  scene_copy_.reset();
  body.order = next_order_++;
  triangles_ += triangles;
  return {};
}

/// Returns whether one more mesh of so many triangles has room.
bool Drawing::make_room(std::size_t triangles) {
  while (scene_.meshes.size() >= kMaxMeshes || triangles_ + triangles > most_triangles_) {
    const auto oldest = scene_.oldest_unnamed(state_);
    if (oldest == scene_.meshes.end()) return false;
    drop(oldest);
    ++given_up_;
  }
  return true;
}

Drawing::Meshes::iterator Drawing::drop(Meshes::iterator mesh) {
  renderer_.drop(mesh->second.picture);
  triangles_ -= mesh->second.triangles;
  if (kept_ != nullptr && !scene_.is_of_arm(mesh->first)) kept_->drop(mesh->first);
  scene_copy_.reset();
  return scene_.meshes.erase(mesh);
}

void Drawing::drop_meshes_of_removed_objects(core::Nanoseconds now_ns) {
  std::set<std::uint64_t> named;
  for (const auto& [id, object] : state_.objects) named.insert(object.mesh_hash);
  for (auto mesh = scene_.meshes.begin(); mesh != scene_.meshes.end();) {
    MeshBody& body = mesh->second;
    const bool is_named = named.contains(mesh->first);
    body.was_named = body.was_named || is_named;
    if (is_named || !body.was_named) {
      body.unnamed_ns = 0;
    } else if (body.unnamed_ns == 0) {
      body.unnamed_ns = now_ns;
    }
    const bool out = body.unnamed_ns != 0 && now_ns - body.unnamed_ns > kKeepUnnamed_ns;
    mesh = out ? drop(mesh) : std::next(mesh);
  }
}

void Drawing::take(const HitSample& hit) {
  viewer_.take({hit.alert, hit.cleared, eigen(hit.look_at_m), eigen(hit.pgv), hit.link, hit.object});
}

void Drawing::resume(core::Nanoseconds now_ns) {
  constexpr core::Nanoseconds kStep_ns = core::kNsPerSecond / 10, kMax_ns = 120 * core::kNsPerSecond;
  struct Change {
    core::Nanoseconds at_ns;
    AlertUpdate update;
  };
  std::vector<Change> changes;
  for (const HitRecord& record : state_.hits) {
    const HitSample& hit = record.raised;
    const AlertUpdate raised{hit.alert, false, eigen(hit.look_at_m), eigen(hit.pgv), hit.link, hit.object};
    changes.push_back({hit.received_ns, raised});
    if (record.cleared_after_s < 0) continue;
    changes.push_back({hit.received_ns + core::from_seconds(record.cleared_after_s),
                       {.alert = hit.alert, .cleared = true}});
  }
  std::ranges::stable_sort(changes, {}, &Change::at_ns);
  viewer_ = SyntheticViewer(at_scale(config_.hit_view.rule, scene_.scale()));
  hit_ = {};
  const VisibleShare all = [](const ViewSituation&, const Eigen::Vector3d&) { return 1.0; };
  core::Nanoseconds at_ns = changes.empty() ? now_ns : std::max(changes.front().at_ns, now_ns - kMax_ns);
  auto next = changes.begin();
  // What is shown for how long does not depend on what is visible; the node is chosen at the end.
  for (;; at_ns += kStep_ns) {
    for (; next != changes.end() && next->at_ns <= std::min(at_ns, now_ns); ++next)
      viewer_.take(next->update);
    if (at_ns >= now_ns) break;
    viewer_.step(false, ViewNode::kAutomatic, all, core::seconds(kStep_ns));
  }
  viewer_.choose_anew();
}

void Drawing::paint(const SkinSample& skin) {
  paint_links(skin, state_.skin.felt, 0);
  if (state_.skin.felt != skin.felt) ++scene_.paint_number;
  if (camera_view_ != nullptr) camera_view_->take(skin);
}

/// Repaints the links that feel something or did before; `first`: the handle of the first link's paint.
void Drawing::paint_links(const SkinSample& skin, const std::vector<SkinPatchSample>& before,
                          PaintHandle first) {
  std::vector<char> felt(link_boxes_.size(), 0);
  for (const auto* patches : {&before, &skin.felt}) {
    for (const SkinPatchSample& patch : *patches) felt[patch.link] = 1;
  }
  for (std::size_t link = 0; link < felt.size(); ++link) {
    if (felt[link] == 0) continue;
    renderer_.paint(first + static_cast<PaintHandle>(link),
                    paint_link(link_boxes_[link], skin.patch_m, skin.felt, link));
  }
}

void Drawing::show_live(const std::map<std::uint16_t, geometry::TriangleMesh>& shapes) {
  for (const auto& [id, body] : scene_.live) renderer_.drop(body.picture);
  scene_.live.clear();
  for (const auto& [id, shape] : shapes) scene_.live.emplace(id, uploaded(shape, renderer_));
}

std::vector<KnownCorner> Drawing::known_corners() const {
  std::vector<KnownCorner> corners;
  for (const auto& [id, object] : state_.objects) {
    const auto mesh = scene_.meshes.find(object.mesh_hash);
    if (mesh == scene_.meshes.end() || !mesh->second.edges || state_.carried(id) != nullptr ||
        scene_.zones.contains(id))
      continue;
    add_known_corners(object.name, object.X_WO, *mesh->second.edges, corners);
  }
  return corners;
}

bool Drawing::take_video(core::Nanoseconds now_ns) {
  if (camera_view_ == nullptr) return false;
  video_ = camera_view_->at(now_ns);
  const SkinSample skin = camera_view_->state_at(state_, video_.exposed_ns, config_.staleness).skin;
  if (skin.felt == felt_over_video_) return true;
  paint_links(skin, felt_over_video_, kPaintOverVideo);
  felt_over_video_ = skin.felt;
  ++paint_number_over_video_;
  return true;
}

Compositor::Picture Drawing::camera_picture() const {
  const core::Nanoseconds then_ns = video_.exposed_ns;
  const ViewerState then =
      camera_view_ == nullptr ? state_ : camera_view_->state_at(state_, then_ns, config_.staleness);
  auto picture = compositor_.camera_picture({then, objects_, bodies_, then_ns}, now(), video_, hit_);
  if (picture.frame.paint_number != 0) picture.frame.paint_number = paint_number_over_video_;
  return picture;
}

/// Returns the view *tool to object*; alert 0: it is not shown.
HitView Drawing::tool_view(double dt_s) {
  ToolApproach::Inputs in;
  in.asked = state_.approach;
  in.chosen = state_.chosen;
  const GripperSample& gripper = state_.gripper;
  const bool heard = age_s(gripper.received_ns, now_ns_) <= config_.staleness.gripper_s;
  if (heard && gripper.sense.known && !gripper.holds && !gripper.closed &&
      shows_hits(state_, config_.staleness, now_ns_))
    in.open_m = gripper.sense.width_m;
  const bool known = age_s(state_.arm.received_ns, now_ns_) <= config_.staleness.slave_s;
  if (known && (in.asked || in.open_m))
    in.gap = tool_gap(scene_.tool_points(state_, kMaxToolPoints), objects_,
                      scene_.scale() * ToolApproach::kReach_m);
  return approach_.step(in, visible_among(bodies_, scene_.scale()), dt_s);
}

/// Lets the view of a hit zone move with what threatens there now.
void Drawing::follow_threats() {
  const PerceptSample& percept = state_.percept;
  core::BoundedList<ThreatPlace, messages::kMaxThreats> places;
  if (percept.valid && age_s(percept.received_ns, now_ns_) <= config_.staleness.percept_s)
    for (const messages::Threat& threat : percept.threats)
      places.push_back({threat.link, threat.object, eigen(threat.position_m), eigen(threat.pgv)});
  viewer_.follow({places.begin(), places.size()});
}

bool Drawing::advance(core::Nanoseconds now_ns, double dt_s) {
  now_ns_ = now_ns;
  objects_ = scene_.obstacles(state_, false);
  bodies_ = scene_.obstacles(state_, true);
  // A view that the operator has turned keeps its node, so that it does not change while he looks at it.
  const bool turned = hit_.alert != 0 && !state_.cameras.offset(View::kHit).at_home();
  const ViewNode chosen = turned && state_.chosen == ViewNode::kAutomatic ? hit_.node : state_.chosen;
  const std::uint32_t before = hit_.alert;
  follow_threats();
  hit_ = viewer_.step(state_.hold, chosen, visible_among(bodies_, scene_.scale()), dt_s);
  // Without views only a zone that the operator asks for, by holding it, is shown.
  if (!state_.hold && !shows_hits(state_, config_.staleness, now_ns)) hit_ = {};
  if (hit_.alert == 0) hit_ = tool_view(dt_s);
  return hit_.alert != before;
}

SceneBase Drawing::scene_base() const {
  if (!scene_copy_) scene_copy_ = std::make_shared<const CellScene>(scene_);
  SceneBase base{.state = {}, .scene = scene_copy_, .objects = objects_, .hit = hit_, .homes = {}};
  base.homes = compositor_.homes(now(), hit_);
  ViewerState& state = base.state;
  state.arm = state_.arm;
  state.percept = state_.percept;
  state.master = state_.master;
  state.gripper = state_.gripper;
  state.others = state_.others;
  state.skin = state_.skin;
  state.workspace = state_.workspace;
  state.objects = state_.objects;
  state.uncertainties = state_.uncertainties;
  state.doubts = state_.doubts;
  state.findings = state_.findings;
  state.chosen = state_.chosen;
  state.hold = state_.hold;
  return base;
}

ViewPoseSample Drawing::view_pose() const {
  ViewPoseSample pose;
  pose.made_ns = now_ns_;
  pose.hit_zone = hit_.alert != 0;
  const Camera camera = pose.hit_zone ? compositor_.hit_camera(now(), hit_) : compositor_.main_camera(now());
  if (pose.hit_zone && state_.cameras.offset(View::kHit).at_home()) {
    pose.node = static_cast<int>(hit_.node);
    pose.automatic = state_.chosen == ViewNode::kAutomatic;
  }
  const Eigen::Matrix3d axes = percept::view_axes((camera.eye_m - camera.target_m).normalized());
  pose.X_WC = {axes.transpose(), camera.eye_m};
  pose.look_at_m = {camera.target_m.x(), camera.target_m.y(), camera.target_m.z()};
  return pose;
}

Compositor::Picture Drawing::picture(View view) const {
  return view == View::kMain   ? compositor_.main_picture(now(), hit_)
         : view == View::kHit  ? compositor_.hit_picture(now(), hit_)
         : view == View::kTool ? compositor_.tool_picture(now())
                               : camera_picture();
}

Drawing::AlertPicture Drawing::picture(const HitSample& hit) const {
  // A busy host may draw this late, after the arm has moved on.
  ViewerState then = state_;
  then.arm = hit.arm;
  then.percept = hit.percept;
  // The graphics card holds only the newest paint.
  const double since_s = std::abs(core::seconds(state_.skin.received_ns - hit.received_ns));
  if (since_s > config_.staleness.percept_s) then.skin.valid = false;
  const RayScene bodies = scene_.obstacles(then, true);
  HitView view = hit_;
  if (hit_.alert != hit.alert) {
    SyntheticViewer alone(at_scale(config_.hit_view.rule, scene_.scale()));
    alone.take({hit.alert, false, eigen(hit.look_at_m), eigen(hit.pgv), hit.link, hit.object});
    view = alone.step(false, state_.chosen, visible_among(bodies, scene_.scale()), 0.0);
  }
  return {compositor_.hit_picture({then, objects_, bodies, hit.received_ns}, view), view.node};
}

const PictureFormat& Drawing::format(View view) const {
  return view == View::kMain   ? config_.main_view.format
         : view == View::kHit  ? config_.hit_view.format
         : view == View::kTool ? config_.tool_view.format
                               : config_.camera_view.format;
}

std::optional<Image> Drawing::report_picture(Compositor::Picture picture, const CancelCheck& give_up) {
  PictureFormat format = config_.main_view.format;
  format.samples = config_.report_samples;
  picture.hud.recording = false;
  auto image = renderer_.render_unless(picture.frame, format, give_up);
  if (image) draw_hud(*image, picture.hud);
  return image;
}

}  // namespace phantom::synthetic_viewer
