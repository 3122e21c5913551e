#include "components/synthetic_viewer/scene/arm_meshes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "common/core/errors.hpp"
#include "common/runtime/cell/arm_model.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr std::array<float, 3> kSkinColour{0.42F, 0.44F, 0.47F};
constexpr int kSides = 32;
constexpr double kThinLink_m = 0.015;  // radius for sensors in a line that give none

[[noreturn]] void fail(const core::Status& status) {
  if (status.code() == core::ErrorCode::kNotFound) throw core::MissingError(status.message());
  throw core::ConfigError(status.message());
}

LinkMeshData load_visual(std::size_t link, const robot::LinkMesh& visual) {
  auto mesh = robot::load_mesh(visual);
  if (!mesh) fail(mesh.status());
  return {link, visual.X_link_mesh, visual.colour, std::move(mesh).value()};
}

std::vector<robot::PolygonPoint> corners_of(const std::vector<robot::PolygonPoint>& given, double radius_m,
                                            int sides) {
  if (!given.empty()) return given;
  std::vector<robot::PolygonPoint> corners;
  for (int side = 0; side < sides; ++side) corners.push_back({radius_m, 2 * std::numbers::pi * side / sides});
  return corners;
}

/// Returns a cylinder around a line of sensors.
robot::SkinSegment around(const robot::AxisSensors& axis) {
  robot::SkinSegment segment;
  segment.from_m = axis.from_m;
  segment.to_m = axis.to_m;
  segment.from_radius_m = segment.to_radius_m = axis.radius_m.value_or(kThinLink_m);
  return segment;
}

geometry::TriangleMesh skin_body(const robot::LinkSkin& skin) {
  geometry::TriangleMesh body;
  for (const robot::SkinSegment& segment : skin.segments) body.append(segment_body(segment));
  for (const robot::AxisSensors& axis : skin.axes) body.append(segment_body(around(axis)));
  for (const robot::MeshSensors& mesh : skin.meshes) body.append(mesh.mesh_m);
  return body;
}

}  // namespace

geometry::TriangleMesh segment_body(const robot::SkinSegment& segment) {
  geometry::TriangleMesh body;
  const Eigen::Vector3d along = segment.to_m - segment.from_m;
  if (!(along.norm() > 0)) return body;
  const Eigen::Vector3d axis = along.normalized();
  // Angles are measured from the axis x, y or z that is farthest from the segment's axis, the first of equals
  // (robot::SkinSegment).
  int farthest = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::abs(axis[i]) < std::abs(axis[farthest]) - 1e-12) farthest = i;
  }
  const Eigen::Vector3d u = (Eigen::Vector3d::Unit(farthest) - axis[farthest] * axis).normalized(),
                        v = axis.cross(u);
  const auto from = corners_of(segment.from_polygon, segment.from_radius_m, segment.sides.value_or(kSides));
  const auto to = corners_of(segment.to_polygon.empty() ? segment.from_polygon : segment.to_polygon,
                             segment.to_radius_m, segment.sides.value_or(kSides));
  const auto n = static_cast<std::uint32_t>(std::min(from.size(), to.size()));
  const auto add = [&](const Eigen::Vector3d& middle_m, const robot::PolygonPoint& corner) {
    const double angle = segment.spin_rad + corner.psi_rad;
    body.vertices_m.push_back(
        (middle_m + corner.r_m * (std::cos(angle) * u + std::sin(angle) * v)).cast<float>());
  };
  for (std::uint32_t i = 0; i < n; ++i) add(segment.from_m, from[i]);
  for (std::uint32_t i = 0; i < n; ++i) add(segment.to_m, to[i]);
  body.vertices_m.push_back(segment.from_m.cast<float>());
  body.vertices_m.push_back(segment.to_m.cast<float>());
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t next = (i + 1) % n;
    body.triangles.push_back({i, next, n + i});
    body.triangles.push_back({n + i, next, n + next});
    body.triangles.push_back({2 * n, next, i});
    body.triangles.push_back({2 * n + 1, n + i, n + next});
  }
  return body;
}

std::vector<OtherArmData> load_other_arms(const runtime::CellConfig& cell, const std::string& own,
                                          const std::vector<runtime::OtherArmConfig>& others) {
  std::vector<OtherArmData> loaded;
  std::set<std::string> names{cell.arm(own).name};
  for (const runtime::OtherArmConfig& other : others) {
    if (!names.insert(other.arm).second)
      throw core::ConfigError("other_arms: '" + other.arm +
                              "' is this arm, or stands twice; allowed: other arms of the cell, each once");
    const runtime::ArmConfig& config = cell.arm(other.arm);
    robot::SerialArm arm = runtime::load_arm(config);
    std::vector<LinkMeshData> meshes = load_arm_meshes(arm, runtime::load_skin(config, arm));
    loaded.push_back({config.name, std::move(arm), std::move(meshes)});
  }
  return loaded;
}

std::vector<OtherArmSource> sources_of(const std::vector<OtherArmData>& arms,
                                       const std::vector<runtime::OtherArmConfig>& configured) {
  std::vector<OtherArmSource> sources;
  for (std::size_t i = 0; i < arms.size(); ++i)
    sources.push_back({arms[i].name,
                       configured[i].partition,
                       {.joint_count = arms[i].arm.joint_count(), .link_count = arms[i].arm.links().size()}});
  return sources;
}

void set_closing(const robot::SerialArm& closed, std::vector<LinkMeshData>& meshes) {
  // load_arm_meshes() has the visuals of all links first, in the arm's order.
  auto mesh = meshes.begin();
  for (const robot::Link& link : closed.links()) {
    for (const robot::LinkMesh& visual : link.meshes) {
      mesh->closing_m = visual.X_link_mesh.translation_m - mesh->X_link_mesh.translation_m;
      ++mesh;
    }
  }
}

std::vector<LinkMeshData> load_arm_meshes(const robot::SerialArm& arm,
                                          const std::vector<robot::LinkSkin>& skin) {
  std::vector<LinkMeshData> meshes;
  for (std::size_t link = 0; link < arm.links().size(); ++link) {
    for (const robot::LinkMesh& visual : arm.links()[link].meshes)
      meshes.push_back(load_visual(link, visual));
  }
  for (const robot::LinkSkin& part : skin) {
    const auto frame = arm.find_frame(part.link);
    if (!frame || !arm.links()[frame->first].meshes.empty()) continue;
    geometry::TriangleMesh body = skin_body(part);
    if (!body.triangles.empty())
      meshes.push_back({frame->first, frame->second, kSkinColour, std::move(body)});
  }
  return meshes;
}

}  // namespace phantom::synthetic_viewer
