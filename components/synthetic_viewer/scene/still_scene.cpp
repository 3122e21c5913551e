#include "components/synthetic_viewer/scene/still_scene.hpp"

#include <algorithm>

#include "common/core/errors.hpp"
#include "common/layers/live_workspace.hpp"
#include "common/percept/closeness.hpp"
#include "common/percept/motion_class.hpp"
#include "common/percept/principal_gradient.hpp"
#include "common/robot/sensing/skin_patches.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "components/synthetic_viewer/scene/arm_meshes.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr int kClusterReach_vox = 3;  // reach of the gradient's zone, as in the shipped phantom_sensing.yaml

template <class T>
T value_or_throw(core::Expected<T> expected, const std::string& place) {
  if (!expected) throw core::ConfigError(place + expected.status().message());
  return std::move(expected).value();
}

core::JointArray joints_of(const std::vector<double>& values, std::size_t joints, const char* what) {
  if (values.size() != joints) {
    throw core::ConfigError(std::string(what) + ": " + std::to_string(values.size()) +
                            " values; allowed: " + std::to_string(joints) + ", one for each joint");
  }
  core::JointArray array{};
  std::copy(values.begin(), values.end(), array.begin());
  return array;
}

workspace::Workspace activate(const runtime::CellConfig& cell, const std::vector<runtime::CellBody>& bodies) {
  std::vector<layers::LiveBody> live;
  for (const auto& loaded : bodies)
    live.push_back({&loaded.body, cell.objects[loaded.body.id - 1U].priority});
  layers::LiveWorkspace workspace(runtime::grid_of(cell), cell.merge);
  value_or_throw(workspace.add(live, 1), cell.file.string() + ": objects: ");
  return std::move(workspace).take();
}

/// Fills in the percept that the phantom would publish for this pose.
void perceive(const robot::SerialArm& arm, const robot::SkinLayout& skin,
              const workspace::Workspace& workspace, const core::JointArray& velocity, ViewerState& state) {
  const double greatest_mu = percept::greatest_neighbour_mu(workspace);
  robot::LinkPoses X_WL;
  arm.link_poses(state.arm.position, X_WL);
  robot::SkinSensing sensing(skin, {});
  sensing.sense(X_WL, arm.joint_count(), workspace);
  const robot::WorstSensor& worst = sensing.worst();
  PerceptSample& percept = state.percept;
  percept.received_ns = StillScene::kNow_ns;
  percept.valid = true;
  if (worst.found) {
    const auto gradient =
        percept::ClusterZone(kClusterReach_vox, percept::ZoneShape::kSphere).gradient(workspace, worst.voxel);
    const Eigen::Vector3d speed_m_s = arm.point_velocity_W(worst.link, worst.position_W_m, X_WL, velocity);
    percept.mu_Pa_s_per_m = static_cast<double>(worst.mu);
    percept.closeness = percept::closeness(percept.mu_Pa_s_per_m, greatest_mu);
    percept.speed_m_s = speed_m_s.norm();
    percept.position_m = messages::vector_of(worst.position_W_m);
    percept.velocity_m_s = messages::vector_of(speed_m_s);
    percept.pgv = messages::vector_of(gradient.pgv_W_m);
    percept.pgs = gradient.strength;
    percept.motion = percept::classify_motion(gradient.pgv_W_m, speed_m_s, {});
    percept.link = static_cast<std::uint32_t>(worst.link);
    percept.object = worst.object;
  }
  robot::SkinPatches patches(arm, skin, workspace.grid().voxel_size_m.reference_m());
  state.skin.received_ns = StillScene::kNow_ns;
  state.skin.valid = greatest_mu > 0;
  state.skin.patch_m = patches.edge_m();
  for (const auto& patch : patches.sense(state.arm.position, workspace)) {
    const Eigen::Vector3f middle_m = patch.middle_m.cast<float>();
    const double closeness = percept::closeness(static_cast<double>(patch.mu), greatest_mu);
    state.skin.felt.push_back(
        {patch.link, {middle_m.x(), middle_m.y(), middle_m.z()}, static_cast<float>(closeness)});
  }
}

}  // namespace

HitSample StillScene::hit() const {
  HitSample hit;
  hit.received_ns = kNow_ns;
  hit.alert = 1;
  hit.rule = HitRule::kVeryClose;
  hit.link = state.percept.link;
  hit.link_name = scene.link_name(hit.link);
  hit.object = state.percept.object;
  hit.look_at_m = state.percept.position_m;
  hit.pgv = state.percept.pgv;
  hit.speed_m_s = state.percept.speed_m_s;
  hit.mu_Pa_s_per_m = state.percept.mu_Pa_s_per_m;
  hit.arm = state.arm;
  hit.percept = state.percept;
  return hit;
}

StillScene make_still_scene(const runtime::CellConfig& cell, const StillPose& pose, Renderer& renderer) {
  const runtime::ArmConfig& arm_config = cell.arm(pose.arm);
  robot::SerialArm arm = runtime::load_arm(arm_config);
  const std::vector<robot::LinkSkin> parts = runtime::load_skin(arm_config, arm);
  const std::vector<LinkMeshData> meshes = load_arm_meshes(arm, parts);
  const std::vector<runtime::CellBody> bodies = runtime::load_bodies(cell);
  const std::string place = cell.file.string() + ": arm '" + arm_config.name + "': ";
  const auto skin =
      value_or_throw(robot::lay_out_skin(arm, parts, {.voxel_size_m = cell.voxel_size_m}), place);
  const std::size_t joints = arm.joint_count();
  const auto& home = arm_config.home;

  StillScene still{CellScene(std::move(arm), cell.min_m, cell.max_m), {}, 0};
  still.scene.zones = zones_of(cell);
  ViewerState& state = still.state;
  state.arm.received_ns = state.master.received_ns = StillScene::kNow_ns;
  state.arm.state = LinkState::kCoupled;
  state.arm.position = joints_of(pose.position.empty() ? home : pose.position, joints, "joints");
  const core::JointArray velocity =
      joints_of(pose.velocity.empty() ? std::vector<double>(joints, 0.0) : pose.velocity, joints, "velocity");
  for (const LinkMeshData& part : meshes) {
    still.triangles += part.mesh.triangles.size();
    still.scene.links.push_back(uploaded(part, renderer));
  }
  for (const runtime::CellBody& loaded : bodies) {
    const runtime::ObjectConfig& object = cell.objects[loaded.body.id - 1U];
    const std::uint64_t name = loaded.body.id;
    still.triangles += loaded.mesh_O.triangles.size();
    still.scene.meshes[name] = uploaded(loaded.mesh_O, renderer);
    state.objects[loaded.body.id] = {loaded.body.id, object.name, name, object.X_WO, object.colour};
  }
  state.workspace = {1, cell.voxel_size_m.half_diagonal_m()};
  still.workspace = std::make_shared<const workspace::Workspace>(activate(cell, bodies));
  perceive(still.scene.arm(), skin, *still.workspace, velocity, state);
  const auto boxes = still.scene.link_boxes();
  for (std::size_t link = 0; link < boxes.size(); ++link)
    renderer.paint(static_cast<PaintHandle>(link),
                   paint_link(boxes[link], state.skin.patch_m, state.skin.felt, link));
  still.scene.paint_number = 1;
  state.take(still.hit());
  return still;
}

}  // namespace phantom::synthetic_viewer
