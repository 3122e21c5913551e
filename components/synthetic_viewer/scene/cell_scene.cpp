#include "components/synthetic_viewer/scene/cell_scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <ranges>
#include <set>

#include "common/core/text.hpp"
#include "common/messages/living.hpp"
#include "components/synthetic_viewer/scene/aids.hpp"

namespace phantom::synthetic_viewer {
namespace {

void add_box_outline(Frame& frame, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int corner = 0; corner < 4; ++corner) {
      Eigen::Vector3f from = low, to = high;
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      from[u] = to[u] = (corner & 1) != 0 ? high[u] : low[u];
      from[v] = to[v] = (corner & 2) != 0 ? high[v] : low[v];
      frame.lines.push_back({from, to});
    }
  }
}

constexpr float kBoundOpacity = 0.22F;
constexpr float kZoneOpacity = 0.35F;
constexpr float kFaded = 0.4F;  // opacity of what may have moved on

constexpr std::size_t kPartsOfArm = 65'536;  // in an item's number

/// Returns another arm as it was last heard of; received_ns 0: it never was.
const ArmSample& sample_of(const ViewerState& state, std::size_t other) {
  static const ArmSample never;
  return other < state.others.size() ? state.others[other].arm : never;
}

/// Returns whether a part moves in its link.
bool is_finger(const LinkBody& part) { return !part.closing_m.isZero(); }

/// Returns the way of a part in its link, with the gripper as it was last heard of; none while it was not.
geometry::Pose shift_of(const LinkBody& part, const GripperSample& gripper) {
  geometry::Pose shift;
  if (gripper.received_ns == 0 || !gripper.sense.known) return shift;
  shift.translation_m =
      (1.0 - std::clamp(gripper.sense.width_m / gripper.widest_m, 0.0, 1.0)) * part.closing_m;
  return shift;
}

}  // namespace

std::set<std::uint16_t> zones_of(const runtime::CellConfig& cell) {
  std::set<std::uint16_t> zones;
  for (const runtime::ObjectConfig& object : cell.objects)
    if (object.is_zone()) zones.insert(object.id);
  return zones;
}

MeshBody uploaded(const geometry::TriangleMesh& mesh, Renderer& renderer, bool with_edges) {
  return {renderer.upload(mesh), std::make_shared<RayMesh>(mesh),
          mesh.triangles.size(), 0,
          mesh.content_hash(),   with_edges ? std::make_shared<EdgeMesh>(edges_of(mesh)) : nullptr,
          thickness_of(mesh),    mesh.bounding_box()};
}

double thickness_of(const geometry::TriangleMesh& mesh) {
  double area_m2 = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f& at = mesh.vertices_m[a];
    area_m2 += 0.5 * static_cast<double>((mesh.vertices_m[b] - at).cross(mesh.vertices_m[c] - at).norm());
  }
  return area_m2 > 0.0 ? std::max(0.0, 4.0 * geometry::enclosed_volume_m3(mesh) / area_m2) : 0.0;
}

double CellScene::thickness_m(const ViewerState& state, std::uint16_t object) const {
  const auto found = state.objects.find(object);
  if (found == state.objects.end()) return 0.0;
  const auto mesh = meshes.find(found->second.mesh_hash);
  return mesh != meshes.end() ? mesh->second.thickness_m : 0.0;
}

Eigen::Matrix4d placement_of(const SceneItem& item, const geometry::Pose& X_M) {
  Eigen::Affine3d placed = Eigen::Affine3d::Identity();
  placed.linear() = X_M.rotation;
  placed.translation() = X_M.translation_m;
  if (item.grown_m <= 0.0 || item.mesh->box.empty()) return placed.matrix();
  constexpr double kThinnest_m = 1e-3;  // of a flat mesh's box
  const Eigen::Vector3d min_m = item.mesh->box.min_m.cast<double>(),
                        max_m = item.mesh->box.max_m.cast<double>();
  const Eigen::Vector3d middle_m = 0.5 * (min_m + max_m),
                        half_m = (0.5 * (max_m - min_m)).cwiseMax(kThinnest_m);
  const Eigen::Vector3d scale = (half_m.array() + item.grown_m) / half_m.array();
  placed.translate(middle_m).scale(scale).translate(-middle_m);
  return placed.matrix();
}

LinkBody uploaded(const LinkMeshData& part, Renderer& renderer, bool with_edges) {
  return {part.link,
          part.X_link_mesh,
          part.colour,
          uploaded(part.mesh, renderer, with_edges),
          part.mesh.bounding_box(),
          part.closing_m};
}

geometry::Pose pose_in_link(const LinkBody& part, const GripperSample& gripper) {
  return shift_of(part, gripper) * part.X_link_mesh;
}

std::map<std::uint64_t, MeshBody>::iterator CellScene::oldest_unnamed(const ViewerState& state) {
  std::set<std::uint64_t> named;
  for (const auto& [id, object] : state.objects) named.insert(object.mesh_hash);
  auto oldest = meshes.end();
  for (auto mesh = meshes.begin(); mesh != meshes.end(); ++mesh) {
    if (named.contains(mesh->first)) continue;
    if (oldest == meshes.end() || mesh->second.order < oldest->second.order) oldest = mesh;
  }
  return oldest;
}

/// Says what an object rides on: the cell, or the hand. Returns false if that is not known: an arm carries it
/// whose pose is not known.
bool CellScene::place(const ObjectSample& object, const ViewerState& state, SceneItem& item) const {
  item.body = SceneItem::kWorld;
  item.X_BM = object.X_WO;
  const messages::CarriedObject* carried = state.carried(object.id);
  if (carried == nullptr) return true;
  const auto frame = arm_.find_frame(carried->frame);
  if (carried->arm != arm_name_ || !frame || state.arm.received_ns == 0) return false;
  item.body = static_cast<int>(frame->first);
  item.X_BM = frame->second * carried->X_FO;
  return true;
}

std::optional<geometry::Pose> CellScene::pose_of(const ObjectSample& object, const ViewerState& state) const {
  SceneItem item;
  if (!place(object, state, item)) return std::nullopt;
  if (item.body == SceneItem::kWorld) return item.X_BM;
  robot::LinkPoses X_WL;
  arm_.link_poses(state.arm.position, X_WL);
  return X_WL[static_cast<std::size_t>(item.body)] * item.X_BM;
}

std::vector<std::size_t> CellScene::body_links() const {
  std::vector<std::size_t> bodies;
  for (std::size_t link = 0; link < arm_.links().size(); ++link) bodies.push_back(link);
  for (const LinkBody& part : links)
    if (is_finger(part)) bodies.push_back(part.link);
  return bodies;
}

std::vector<geometry::Pose> CellScene::body_poses(const ViewerState& state) const {
  if (state.arm.received_ns == 0) return {};
  robot::LinkPoses X_WL;
  arm_.link_poses(state.arm.position, X_WL);
  std::vector<geometry::Pose> poses(X_WL.begin(),
                                    X_WL.begin() + static_cast<std::ptrdiff_t>(arm_.links().size()));
  for (const LinkBody& part : links) {
    if (is_finger(part)) poses.push_back(X_WL[part.link] * shift_of(part, state.gripper));
  }
  for (std::size_t o = 0; o < others.size(); ++o) {
    const ArmSample& heard = sample_of(state, o);
    robot::LinkPoses X_WO;
    if (heard.received_ns != 0) others[o].arm.link_poses(heard.position, X_WO);
    poses.insert(poses.end(), X_WO.begin(),
                 X_WO.begin() + static_cast<std::ptrdiff_t>(others[o].arm.links().size()));
  }
  return poses;
}

std::vector<std::string> CellScene::other_bodies() const {
  std::vector<std::string> names;
  for (const OtherArm& other : others)
    for (const robot::Link& link : other.arm.links()) names.push_back(other.name + ": " + link.name);
  return names;
}

void CellScene::add_others(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns,
                           std::vector<SceneItem>& items) const {
  std::size_t first_body = body_links().size();
  for (std::size_t o = 0; o < others.size(); ++o) {
    const core::Nanoseconds heard_ns = sample_of(state, o).received_ns;
    for (std::size_t i = 0; heard_ns != 0 && i < others[o].links.size(); ++i) {
      const LinkBody& part = others[o].links[i];
      SceneItem item;
      item.kind = SceneItem::Kind::kOtherPart;
      item.number = o * kPartsOfArm + i;
      item.mesh = &part.body;
      item.body = static_cast<int>(first_body + part.link);
      item.X_BM = part.X_link_mesh;
      item.colour = part.colour;
      item.opacity = age_s(heard_ns, now_ns) <= staleness.slave_s ? 1.0F : kFaded;
      item.link = part.link;
      items.push_back(item);
    }
    first_body += others[o].arm.links().size();
  }
}

std::vector<SceneItem> CellScene::items(const ViewerState& state, const Staleness& staleness,
                                        core::Nanoseconds now_ns) const {
  std::vector<SceneItem> items;
  const bool known = age_s(state.arm.received_ns, now_ns) <= staleness.slave_s;
  for (const auto& [id, object] : state.objects) {
    const auto mesh = meshes.find(object.mesh_hash);
    SceneItem item;
    if (mesh == meshes.end() || !place(object, state, item)) continue;
    item.number = id;
    item.mesh = &mesh->second;
    item.colour = object.colour;
    item.opacity = known || item.body == SceneItem::kWorld ? 1.0F : kFaded;
    if (zones.contains(id)) item.opacity = kZoneOpacity, item.casts_shadow = false;
    items.push_back(item);
    const double error_m = state.pose_error_m(id);
    if (error_m < scale_ * kShownError_m || item.body != SceneItem::kWorld) continue;
    item.kind = SceneItem::Kind::kBound;
    item.grown_m = error_m;
    item.opacity = kBoundOpacity;
    item.casts_shadow = false;
    items.push_back(item);
  }
  if (state.arm.received_ns == 0) return items;
  std::size_t next_finger = arm_.links().size();
  for (std::size_t i = 0; i < links.size(); ++i) {
    const LinkBody& part = links[i];
    SceneItem item;
    item.kind = SceneItem::Kind::kPart;
    item.number = i;
    item.mesh = &part.body;
    item.body = static_cast<int>(is_finger(part) ? next_finger++ : part.link);
    item.X_BM = part.X_link_mesh;
    item.colour = part.colour;
    item.opacity = known ? 1.0F : kFaded;
    item.painted = true;
    item.link = part.link;
    items.push_back(item);
  }
  add_others(state, staleness, now_ns, items);
  return items;
}

bool paint_shown(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) {
  return state.skin.valid && age_s(state.skin.received_ns, now_ns) <= staleness.percept_s;
}

std::array<Colour, 3> paint_ramp() {
  return {closeness_colour(0.0), closeness_colour(0.5), closeness_colour(1.0)};
}

Frame CellScene::frame(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) const {
  Frame frame;
  frame.floor_min_m = min_m_.cast<float>();
  frame.floor_max_m = max_m_.cast<float>();
  frame.floor_border_m *= static_cast<float>(scale_);
  frame.floor_pitch_m *= static_cast<float>(std::pow(10.0, std::round(std::log10(scale_))));
  add_box_outline(frame, frame.floor_min_m, frame.floor_max_m);
  const bool painted = state.arm.received_ns != 0 && paint_shown(state, staleness, now_ns);
  if (state.arm.received_ns != 0) frame.paint_ramp = paint_ramp();
  frame.paint_number = painted ? paint_number : 0;
  const std::vector<geometry::Pose> X_WB = body_poses(state);
  for (const SceneItem& item : items(state, staleness, now_ns)) {
    const geometry::Pose X_WM =
        item.body == SceneItem::kWorld ? item.X_BM : X_WB[static_cast<std::size_t>(item.body)] * item.X_BM;
    const auto surface = item.kind == SceneItem::Kind::kObject
                             ? live.find(static_cast<std::uint16_t>(item.number))
                             : live.end();
    const bool is_live = surface != live.end();
    const Eigen::Matrix4f placement =
        is_live ? matrix_of(geometry::Pose()) : Eigen::Matrix4f(placement_of(item, X_WM).cast<float>());
    DrawItem drawn{is_live ? surface->second.picture : item.mesh->picture,
                   placement,
                   item.colour,
                   item.opacity,
                   0.0F,
                   item.casts_shadow};
    if (painted && item.painted) {
      drawn.paint = static_cast<PaintHandle>(item.link);
      drawn.paint_from_mesh = matrix_of(item.X_BM);
    }
    frame.items.push_back(drawn);
  }
  return frame;
}

Frame CellScene::frame_over_video(const ViewerState& state, const Staleness& staleness,
                                  core::Nanoseconds now_ns, const Eigen::Vector3d& eye_m) const {
  ViewerState shown = state;
  shown.uncertainties.clear();  // what is drawn hides what is behind it
  if (age_s(state.arm.received_ns, now_ns) > staleness.slave_s) shown.arm = {};
  for (OtherArmSample& other : shown.others)
    if (age_s(other.arm.received_ns, now_ns) > staleness.slave_s) other.arm = {};
  Frame frame = this->frame(shown, staleness, now_ns);
  frame.floor_max_m = frame.floor_min_m;
  frame.lines.clear();
  frame.line_colour = {0.10F, 0.95F, 0.75F};
  frame.bold_lines = true;
  for (DrawItem& item : frame.items) {
    item.over_video = item.opacity == 1.0F;  // a zone is not in the picture, and hides nothing
    if (item.paint != kNoPaint) item.paint += kPaintOverVideo;
  }
  const auto add = [&](const MeshBody& body, const geometry::Pose& X_WM) {
    if (body.edges) add_edges(*body.edges, X_WM, eye_m, frame.lines);
  };
  for (const auto& [id, object] : shown.objects) {
    const auto mesh = meshes.find(object.mesh_hash);
    const auto X_WO = pose_of(object, shown);
    if (live.contains(id)) continue;  // voxels' edges would hide the picture
    if (mesh != meshes.end() && X_WO) add(mesh->second, *X_WO);
  }
  if (shown.arm.received_ns == 0) return frame;
  robot::LinkPoses X_WL;
  arm_.link_poses(shown.arm.position, X_WL);
  for (const LinkBody& part : links) add(part.body, X_WL[part.link] * pose_in_link(part, shown.gripper));
  for (std::size_t o = 0; o < others.size(); ++o) {
    if (sample_of(shown, o).received_ns == 0) continue;
    others[o].arm.link_poses(sample_of(shown, o).position, X_WL);
    for (const LinkBody& part : others[o].links) add(part.body, X_WL[part.link] * part.X_link_mesh);
  }
  return frame;
}

bool CellScene::is_of_arm(std::uint64_t hash) const {
  const auto has_it = [hash](const std::vector<LinkBody>& parts) {
    return std::ranges::any_of(parts, [hash](const LinkBody& part) { return part.body.hash == hash; });
  };
  return has_it(links) ||
         std::ranges::any_of(others, [&](const OtherArm& other) { return has_it(other.links); });
}

std::vector<geometry::BoundingBox> CellScene::link_boxes() const {
  std::vector<geometry::BoundingBox> boxes(arm_.links().size());
  for (const LinkBody& part : links) {
    if (part.box.empty()) continue;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d corner =
          corner_of(part.box.min_m.cast<double>(), part.box.max_m.cast<double>(), i);
      boxes[part.link].extend((part.X_link_mesh * corner).cast<float>());
    }
  }
  return boxes;
}

RayScene CellScene::obstacles(const ViewerState& state, bool with_arm) const {
  RayScene scene;
  for (const auto& [id, object] : state.objects) {
    const auto mesh = meshes.find(object.mesh_hash);
    if (!with_arm && state.carried(id) != nullptr) continue;
    if (const auto surface = live.find(id); surface != live.end()) {
      scene.bodies.push_back({surface->second.obstacle, geometry::Pose(), {id, 0}});
      continue;
    }
    const auto X_WO = pose_of(object, state);
    if (mesh != meshes.end() && mesh->second.obstacle && X_WO)
      (zones.contains(id) ? scene.zones : scene.bodies).push_back({mesh->second.obstacle, *X_WO, {id, 0}});
  }
  for (std::size_t o = 0; with_arm && o < others.size(); ++o) {
    if (sample_of(state, o).received_ns == 0) continue;
    robot::LinkPoses X_WO;
    others[o].arm.link_poses(sample_of(state, o).position, X_WO);
    const auto id = static_cast<std::uint16_t>(runtime::kFirstOtherArmId + o);
    for (const LinkBody& part : others[o].links)
      scene.bodies.push_back({part.body.obstacle, X_WO[part.link] * part.X_link_mesh, {id, part.link}});
  }
  if (!with_arm || state.arm.received_ns == 0) return scene;
  const std::vector<geometry::Pose> X_WB = body_poses(state);
  std::size_t next_finger = arm_.links().size();
  for (const LinkBody& part : links) {
    const std::size_t body = is_finger(part) ? next_finger++ : part.link;
    if (part.body.obstacle)
      scene.bodies.push_back({part.body.obstacle, X_WB[body] * part.X_link_mesh, {0, part.link}});
  }
  return scene;
}

std::vector<Eigen::Vector3d> CellScene::tool_points(const ViewerState& state, std::size_t most) const {
  std::vector<Eigen::Vector3d> points_m;
  std::size_t last = 0;
  for (const LinkBody& part : links) last = std::max(last, part.link);
  const auto add = [&](const std::shared_ptr<const RayMesh>& mesh, const geometry::Pose& X_WM) {
    if (!mesh) return;
    for (const Eigen::Vector3d& corner_m : mesh->corners(most)) points_m.push_back(X_WM * corner_m);
  };
  robot::LinkPoses X_WL;
  arm_.link_poses(state.arm.position, X_WL);
  for (const LinkBody& part : links)
    if (part.link == last) add(part.body.obstacle, X_WL[part.link] * pose_in_link(part, state.gripper));
  for (const auto& [id, object] : state.objects) {
    const auto mesh = meshes.find(object.mesh_hash);
    if (state.carried(id) == nullptr || mesh == meshes.end()) continue;
    if (const auto X_WO = pose_of(object, state)) add(mesh->second.obstacle, *X_WO);
  }
  return points_m;
}

std::string CellScene::link_name(std::size_t link) const {
  return link < arm_.links().size() ? arm_.links()[link].name : "link " + std::to_string(link);
}

std::string CellScene::item_name(const ViewerState& state, const SceneItem& item) const {
  if (item.kind == SceneItem::Kind::kObject || item.kind == SceneItem::Kind::kBound)
    return object_name(state, static_cast<std::uint16_t>(item.number));
  if (item.kind == SceneItem::Kind::kPart) return link_name(item.link);
  const OtherArm& other = others[item.number / kPartsOfArm];
  return other.name + ": " + other.arm.links()[item.link].name;
}

std::string CellScene::body_name(const ViewerState& state, const RayScene::BodyName& name) const {
  return name.object != 0 ? object_name(state, name.object) : link_name(name.link);
}

bool CellScene::complete(const ViewerState& state) const {
  return !state.objects.empty() && missing(state).empty();
}

std::vector<std::string> CellScene::missing(const ViewerState& state) const {
  std::vector<std::string> names;
  for (const auto& [id, object] : state.objects) {
    if (meshes.count(object.mesh_hash) == 0) names.push_back(object_name(state, id));
  }
  return names;
}

namespace {

/// Returns the first names: "a, b, c, d and 3 more".
LocalizedText some_of(const std::vector<std::string>& names) {
  constexpr std::size_t kNamed = 4;
  const std::string text = core::listed(names | std::views::take(kNamed));
  if (names.size() <= kNamed) return {"missing.names", {{"names", text}}};
  return {"missing.names_more", {{"names", text}, {"more", static_cast<double>(names.size() - kNamed)}}};
}

}  // namespace

LocalizedText missing_words(const ViewerState& state, const CellScene& scene, const Staleness& staleness,
                            core::Nanoseconds now_ns) {
  if (state.arm.received_ns == 0) return {"missing.slave", {}};
  if (age_s(state.arm.received_ns, now_ns) > staleness.slave_s) return {"missing.slave_silent", {}};
  if (state.objects.empty()) return {"missing.objects", {}};
  const std::vector<std::string> missing = scene.missing(state);
  if (missing.empty()) {
    const std::string& problem = state.recording.problem;
    return problem.empty() ? LocalizedText() : LocalizedText{"missing.recording", {{"problem", problem}}};
  }
  const bool awaited = core::seconds(now_ns - state.first_object_ns) < staleness.meshes_s;
  return {awaited ? "missing.meshes_awaited" : "missing.meshes", {{"names", some_of(missing)}}};
}

}  // namespace phantom::synthetic_viewer
