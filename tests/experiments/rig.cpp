#include "tests/experiments/rig.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "common/layers/live_workspace.hpp"

namespace phantom::experiments {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();

/// Joints along x, y and z of W, in this order; the tip is at (q_0, q_1, q_2).
robot::SerialArm cartesian_arm() {
  // With Craig's convention a joint moves along z of its own row's frame: its α turns the frame before it.
  const double quarter = 0.5 * std::numbers::pi;
  std::vector<robot::DhRow> rows(3);
  const std::array<const char*, 3> names{"x_stage", "y_stage", "z_stage"};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].link = names[i];
    rows[i].type = robot::JointType::kPrismatic;
    rows[i].lower = -kEndless;
    rows[i].upper = kEndless;
    rows[i].max_speed = rows[i].max_effort = 1e6;
  }
  // The base is turned so that its z is the x of W, and each row turns the next z to the next axis.
  rows[1].alpha_rad = -quarter;
  rows[1].theta_rad = -quarter;
  rows[2].alpha_rad = quarter;
  geometry::Pose X_WB;
  X_WB.rotation = geometry::rotation_from_rpy(0.0, quarter, 0.0);
  return must(robot::SerialArm::from_dh(rows, robot::DhConvention::kModified, X_WB));
}

robot::SkinLayout tip_sensor(const robot::SerialArm& arm, double voxel_size_m,
                             const std::optional<robot::ClusterSpec>& cluster) {
  robot::AxisSensors sensor;
  sensor.from_m = {0.0, 0.0, -voxel_size_m};
  sensor.count = 1;  // at to_m: the tip
  sensor.cluster = cluster;
  robot::LinkSkin skin;
  skin.link = "z_stage";
  skin.axes = {sensor};
  return must(robot::lay_out_skin(
      arm, {skin}, {.voxel_size_m = voxel_size_m, .normalisation = robot::Normalisation::kNone}));
}

}  // namespace

workspace::ShapingElement sabotaged(workspace::ShapingElement element, Sabotage sabotage) {
  return sabotage == Sabotage::kCubicElements ? workspace::ShapingElement::kCube : element;
}

workspace::LayerProfile sabotaged(workspace::LayerProfile profile, Sabotage sabotage) {
  profile.element = sabotaged(profile.element, sabotage);
  if (sabotage == Sabotage::kConstantMu) {
    float mu = profile.mu_Pa_s_per_m.front();
    for (float& layer : profile.mu_Pa_s_per_m) {
      layer = mu;
      mu = std::nextafter(mu, 0.0F);
    }
  }
  if (sabotage == Sabotage::kLayersOffByOne) ++profile.thickness_vox.front();
  return profile;
}

double sabotaged(double speed, Sabotage sabotage) {
  if (sabotage != Sabotage::kIgnoredSpeed || speed == 0.0) return speed;
  return std::copysign(kIgnoredSpeed, speed);
}

core::JointArray sabotaged(core::JointArray speeds, Sabotage sabotage) {
  for (double& speed : speeds) speed = sabotaged(speed, sabotage);
  return speeds;
}

teleop::JointMappingParameters sabotaged(teleop::JointMappingParameters mapping, Sabotage sabotage) {
  if (sabotage != Sabotage::kUnitRatio) return mapping;
  for (teleop::LedJoint& led : mapping.led) led.ratio = 1.0;
  return mapping;
}

geometry::TriangleMesh sabotaged(geometry::TriangleMesh mesh, double voxel_size_m, Sabotage sabotage) {
  if (sabotage != Sabotage::kGrownBodies) return mesh;
  const auto bounds = mesh.bounding_box();
  const Eigen::Array3f extent_m = (bounds.max_m - bounds.min_m).array();
  const Eigen::Array3f factor = 1.0F + 2.0F * static_cast<float>(voxel_size_m) / extent_m;
  const Eigen::Array3f middle_m = 0.5F * (bounds.max_m + bounds.min_m).array();
  for (auto& vertex_m : mesh.vertices_m)
    vertex_m = (middle_m + factor * (vertex_m.array() - middle_m)).matrix();
  return mesh;
}

survey::RangeHead sabotaged(survey::RangeHead head, Sabotage sabotage) {
  if (sabotage == Sabotage::kIgnoredOffset) head.beam_offset_m = 0.0;
  return head;
}

robot::ClusterSpec sabotaged(robot::ClusterSpec cluster, Sabotage sabotage) {
  if (sabotage == Sabotage::kCubicClusters) cluster.shape = robot::ClusterShape::kCube;
  return cluster;
}

robot::MemoryWeights sabotaged(robot::MemoryWeights weights, Sabotage sabotage) {
  if (sabotage == Sabotage::kNoMemory) weights.clear();
  return weights;
}

workspace::LayerProfile layers(const std::vector<float>& mu_Pa_s_per_m, int thickness_vox,
                               float mu_skin_Pa_s_per_m) {
  workspace::LayerProfile profile;
  profile.mu_Pa_s_per_m = mu_Pa_s_per_m;
  profile.thickness_vox.assign(mu_Pa_s_per_m.size(), thickness_vox);
  profile.mu_skin_Pa_s_per_m = mu_skin_Pa_s_per_m;
  return profile;
}

workspace::Workspace activate(std::vector<layers::Body> bodies, const workspace::GridSpec& grid,
                              const Settings& settings, layers::MergeLaw law) {
  std::vector<layers::LiveBody> live;
  std::uint16_t id = 0;
  for (layers::Body& body : bodies) {
    body.id = ++id;
    body.profile = sabotaged(std::move(body.profile), settings.sabotage);
    body.mesh_W = sabotaged(std::move(body.mesh_W), grid.voxel_size_m.reference_m(), settings.sabotage);
    live.push_back({&body, std::int64_t{id}});
  }
  layers::LiveWorkspace workspace(grid, law);
  must(workspace.add(live, 1));
  return std::move(workspace).take();
}

Probe::Probe(const workspace::Workspace& workspace, const Settings& settings,
             const robot::SensingOptions& options, const std::optional<robot::ClusterSpec>& cluster)
    : workspace_(workspace),
      sabotage_(settings.sabotage),
      arm_(cartesian_arm()),
      layout_(tip_sensor(arm_, workspace.grid().voxel_size_m.reference_m(), cluster)),
      sensing_(layout_, options) {}

Felt Probe::at(const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& v_W_m_per_s) {
  core::JointArray q{}, v{};
  for (int i = 0; i < 3; ++i) {
    q[static_cast<std::size_t>(i)] = p_W_m[i];
    v[static_cast<std::size_t>(i)] = v_W_m_per_s[i];
  }
  robot::LinkPoses X_WL;
  arm_.link_poses(q, X_WL);
  sensing_.sense(X_WL, 3, workspace_);
  v = sabotaged(v, sabotage_);
  robot::drag_coefficients(arm_, X_WL, sensing_.sums(), {}, v, drag_);
  const core::JointArray force = robot::drag_torque(drag_, robot::DragMode::kSeparable, v, 3);
  return {sensing_.sums()[3].mu, {force[0], force[1], force[2]}};
}

}  // namespace phantom::experiments
