#include "common/runtime/cell/arm_model.hpp"

#include <spdlog/spdlog.h>

#include <string>

#include "common/core/errors.hpp"
#include "common/geometry/mesh/mesh_io.hpp"

namespace phantom::runtime {
namespace {

std::string place_of(const ArmConfig& config) {
  return config.file.string() + ": arm '" + config.name + "': ";
}

[[noreturn]] void fail(const ArmConfig& config, const core::Status& status) {
  if (status.code() == core::ErrorCode::kNotFound)
    throw core::MissingError(place_of(config) + status.message());
  throw core::ConfigError(place_of(config) + status.message());
}

void check_per_joint(const ArmConfig& config, const char* key, std::size_t count, std::size_t joints) {
  if (count == joints) return;
  throw core::ConfigError(place_of(config) + key + ": has " + std::to_string(count) +
                          " values; allowed: " + std::to_string(joints) + ", one for each moving joint");
}

geometry::TriangleMesh read_mesh(const ArmConfig& config, const std::filesystem::path& file, double scale,
                                 const geometry::Pose& X_LM) {
  geometry::MeshImportOptions options;
  options.scale = scale;
  const auto mesh = geometry::load_mesh(file, options);
  if (!mesh) fail(config, mesh.status());
  return mesh->transformed(X_LM);
}

/// Reads the visual meshes of the moving link that holds the frame called `link`, in that frame.
std::vector<robot::MeshSensors> visual_skin(const ArmConfig& config, const robot::SerialArm& arm,
                                            const std::optional<robot::SerialArm>& closed,
                                            const std::string& link, const MeshSensorsConfig& wanted) {
  std::vector<robot::MeshSensors> skin;
  const auto found = arm.find_frame(link);
  if (!found) return skin;  // lay_out_skin() reports the unknown link
  const auto& [index, X_link_frame] = *found;
  for (std::size_t i = 0; i < arm.links()[index].meshes.size(); ++i) {
    const robot::LinkMesh& visual = arm.links()[index].meshes[i];
    const auto mesh = robot::load_mesh(visual);
    if (!mesh) fail(config, mesh.status());
    Eigen::Vector3d way_m = Eigen::Vector3d::Zero();
    if (closed)
      way_m = closed->links()[index].meshes[i].X_link_mesh.translation_m - visual.X_link_mesh.translation_m;
    skin.push_back({mesh->transformed(X_link_frame.inverse() * visual.X_link_mesh), wanted.gain,
                    wanted.cluster, X_link_frame.rotation.transpose() * way_m});
  }
  if (skin.empty()) {
    throw core::ConfigError(place_of(config) + "skin: link '" + link +
                            "' has no visuals; allowed: meshes with `mesh: FILE`, segments or axes");
  }
  return skin;
}

}  // namespace

robot::SerialArm load_kinematics(const ArmConfig& config) {
  auto arm = config.urdf.empty() ? robot::SerialArm::from_dh(config.dh, config.dh_convention, config.X_WB)
                                 : robot::SerialArm::from_urdf(config.urdf, config.tip_link, config.X_WB,
                                                               config.held_joints, config.limits);
  if (!arm) fail(config, arm.status());
  check_per_joint(config, "home", config.home.size(), arm->joint_count());
  for (std::size_t j = 0; j < arm->joint_count(); ++j) {
    const robot::Joint& joint = arm->joints()[j];
    if (config.home[j] >= joint.lower && config.home[j] <= joint.upper) continue;
    throw core::ConfigError(place_of(config) + "home: '" + std::to_string(config.home[j]) + "' for " +
                            joint.name + " is outside of its limits; allowed: " +
                            std::to_string(joint.lower) + " to " + std::to_string(joint.upper));
  }
  return *std::move(arm);
}

robot::SerialArm load_arm(const ArmConfig& config) {
  robot::SerialArm arm = load_kinematics(config);
  for (const std::string& notice : arm.notices()) spdlog::info("{}{}", place_of(config), notice);
  return arm;
}

robot::SerialArm load_arm_with_closed_gripper(ArmConfig config) {
  for (const auto& [joint, q] : config.gripper_closed) config.held_joints[joint] = q;
  return load_kinematics(config);
}

std::optional<robot::SerialArm> load_closed_arm(const ArmConfig& config) {
  if (config.gripper_closed.empty()) return {};
  return load_arm_with_closed_gripper(config);
}

std::vector<robot::FingerPoint> load_fingers(const ArmConfig& config, const robot::SerialArm& arm,
                                             double pitch_m) {
  const auto closed = load_closed_arm(config);
  if (!closed) return {};
  auto points = robot::finger_points(arm, *closed, pitch_m);
  if (!points) throw core::ConfigError(place_of(config) + points.status().message());
  return *std::move(points);
}

Eigen::Vector3d closing_of_frame(const robot::SerialArm& arm, const std::optional<robot::SerialArm>& closed,
                                 const std::string& frame) {
  const auto open_at = arm.find_frame(frame);
  if (!closed || !open_at) return Eigen::Vector3d::Zero();
  return closed->find_frame(frame)->second.translation_m - open_at->second.translation_m;
}

std::vector<robot::LinkSkin> load_skin(const ArmConfig& config, const robot::SerialArm& arm) {
  const std::optional<robot::SerialArm> closed = load_closed_arm(config);
  std::vector<robot::LinkSkin> skin;
  for (const LinkSkinConfig& link : config.skin) {
    robot::LinkSkin& made = skin.emplace_back();
    made.link = link.link;
    if (const auto found = arm.find_frame(link.link))
      made.closing_m = found->second.rotation.transpose() * closing_of_frame(arm, closed, link.link);
    for (SkinSegmentConfig segment : link.segments) {
      if (segment.along_axis_m) {
        const auto [offset_m, length_m] = *segment.along_axis_m;
        // lay_out_skin() reports an unknown link.
        robot::place_along_link_axis(arm, link.link, offset_m, length_m, segment);
      }
      made.segments.push_back(segment);
    }
    for (AxisSensorsConfig axis : link.axes) {
      if (axis.along_link_axis) {
        if (const auto found = arm.find_frame(link.link)) {
          const auto [from_m, to_m] = arm.link_axis_m(found->first);
          axis.from_m = found->second.inverse() * from_m;
          axis.to_m = found->second.inverse() * to_m;
        }
      }
      made.axes.push_back(axis);
    }
    for (const MeshSensorsConfig& wanted : link.meshes) {
      if (wanted.mesh.empty()) {
        for (auto& sensors : visual_skin(config, arm, closed, link.link, wanted))
          made.meshes.push_back(std::move(sensors));
      } else {
        made.meshes.push_back({read_mesh(config, wanted.mesh, wanted.mesh_scale, wanted.X_LM), wanted.gain,
                               wanted.cluster, made.closing_m});
      }
    }
  }
  return skin;
}

}  // namespace phantom::runtime
