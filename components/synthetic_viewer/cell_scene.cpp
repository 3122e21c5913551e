#include "components/synthetic_viewer/cell_scene.hpp"

#include <algorithm>
#include <set>

#include "components/synthetic_viewer/aids.hpp"

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

}  // namespace

MeshBody uploaded(const geometry::TriangleMesh& mesh, Renderer& renderer, bool with_edges) {
  return {renderer.upload(mesh), std::make_shared<RayMesh>(mesh), mesh.triangles.size(), 0,
          with_edges ? std::make_shared<EdgeMesh>(edges_of(mesh)) : nullptr};
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
  geometry::Pose pose = part.X_link_mesh;
  if (gripper.received_ns == 0 || !gripper.sense.known) return pose;
  pose.translation_m +=
      (1.0 - std::clamp(gripper.sense.width_m / gripper.widest_m, 0.0, 1.0)) * part.closing_m;
  return pose;
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

/// Returns where an object is now: in the cell, or in the hand. None: an arm carries it whose pose is not
/// known.
std::optional<geometry::Pose> CellScene::pose_of(const ObjectSample& object, const ViewerState& state) const {
  const messages::CarriedObject* carried = state.carried(object.id);
  if (carried == nullptr) return object.X_WO;
  const auto frame = arm_.find_frame(carried->frame);
  if (carried->arm != arm_name_ || !frame || state.arm.received_ns == 0) return std::nullopt;
  robot::LinkPoses X_WL;
  arm_.link_poses(state.arm.position, X_WL);
  return X_WL[frame->first] * frame->second * carried->X_FO;
}

Frame CellScene::frame(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) const {
  Frame frame;
  frame.floor_min_m = min_m_.cast<float>();
  frame.floor_max_m = max_m_.cast<float>();
  add_box_outline(frame, frame.floor_min_m, frame.floor_max_m);
  const bool known = age_s(state.arm.received_ns, now_ns) <= staleness.slave_s;
  for (const auto& [id, object] : state.objects) {
    const auto mesh = meshes.find(object.mesh_hash);
    const auto X_WO = pose_of(object, state);
    if (mesh == meshes.end() || !X_WO) continue;
    const float opacity = known || state.carried(id) == nullptr ? 1.0F : 0.4F;
    frame.items.push_back({mesh->second.picture, matrix_of(*X_WO), object.colour, opacity, 0.0F, true});
  }
  if (state.arm.received_ns == 0) return frame;
  const bool felt = state.skin.valid && age_s(state.skin.received_ns, now_ns) <= staleness.percept_s;
  frame.paint_number = felt ? paint_number : 0;
  frame.paint_ramp = {closeness_colour(0.0), closeness_colour(0.5), closeness_colour(1.0)};
  robot::LinkPoses X_WL;
  arm_.link_poses(state.arm.position, X_WL);
  for (const LinkBody& part : links) {
    DrawItem item{part.body.picture,
                  matrix_of(X_WL[part.link] * pose_in_link(part, state.gripper)),
                  part.colour,
                  1.0F,
                  0.0F,
                  true};
    if (felt) {
      item.paint = static_cast<PaintHandle>(part.link);
      item.paint_from_mesh = matrix_of(part.X_link_mesh);
    }
    if (!known) item.opacity = 0.4F;
    frame.items.push_back(item);
  }
  return frame;
}

Frame CellScene::frame_over_video(const ViewerState& state, const Staleness& staleness,
                                  core::Nanoseconds now_ns, const Eigen::Vector3d& eye_m) const {
  ViewerState shown = state;
  if (age_s(state.arm.received_ns, now_ns) > staleness.slave_s) shown.arm = {};
  Frame frame = this->frame(shown, staleness, now_ns);
  frame.floor_max_m = frame.floor_min_m;
  frame.lines.clear();
  frame.line_colour = {0.10F, 0.95F, 0.75F};
  frame.bold_lines = true;
  for (DrawItem& item : frame.items) {
    item.over_video = true;
    if (item.paint != kNoPaint) item.paint += kPaintOverVideo;
  }
  const auto add = [&](const MeshBody& body, const geometry::Pose& X_WM) {
    if (body.edges) add_edges(*body.edges, X_WM, eye_m, frame.lines);
  };
  for (const auto& [id, object] : shown.objects) {
    const auto mesh = meshes.find(object.mesh_hash);
    const auto X_WO = pose_of(object, shown);
    if (mesh != meshes.end() && X_WO) add(mesh->second, *X_WO);
  }
  if (shown.arm.received_ns == 0) return frame;
  robot::LinkPoses X_WL;
  arm_.link_poses(shown.arm.position, X_WL);
  for (const LinkBody& part : links) add(part.body, X_WL[part.link] * pose_in_link(part, shown.gripper));
  return frame;
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
    const auto X_WO = pose_of(object, state);
    if (mesh != meshes.end() && mesh->second.obstacle && X_WO)
      scene.bodies.push_back({mesh->second.obstacle, *X_WO, {id, 0}});
  }
  if (!with_arm || state.arm.received_ns == 0) return scene;
  robot::LinkPoses X_WL;
  arm_.link_poses(state.arm.position, X_WL);
  for (const LinkBody& part : links) {
    if (part.body.obstacle)
      scene.bodies.push_back(
          {part.body.obstacle, X_WL[part.link] * pose_in_link(part, state.gripper), {0, part.link}});
  }
  return scene;
}

std::string CellScene::link_name(std::size_t link) const {
  return link < arm_.links().size() ? arm_.links()[link].name : "link " + std::to_string(link);
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
Words some_of(const std::vector<std::string>& names) {
  constexpr std::size_t kNamed = 4;
  std::string text;
  for (std::size_t i = 0; i < names.size() && i < kNamed; ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (names.size() <= kNamed) return {"missing.names", {{"names", text}}};
  return {"missing.names_more", {{"names", text}, {"more", static_cast<double>(names.size() - kNamed)}}};
}

}  // namespace

Words missing_words(const ViewerState& state, const CellScene& scene, const Staleness& staleness,
                    core::Nanoseconds now_ns) {
  if (state.arm.received_ns == 0) return {"missing.slave", {}};
  if (age_s(state.arm.received_ns, now_ns) > staleness.slave_s) return {"missing.slave_silent", {}};
  if (state.objects.empty()) return {"missing.objects", {}};
  const std::vector<std::string> missing = scene.missing(state);
  if (missing.empty()) {
    const std::string& problem = state.recording.problem;
    return problem.empty() ? Words() : Words{"missing.recording", {{"problem", problem}}};
  }
  const bool awaited = core::seconds(now_ns - state.first_object_ns) < staleness.meshes_s;
  return {awaited ? "missing.meshes_awaited" : "missing.meshes", {{"names", some_of(missing)}}};
}

}  // namespace phantom::synthetic_viewer
