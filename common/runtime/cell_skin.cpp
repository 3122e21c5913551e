
#include "common/core/units.hpp"
#include "common/runtime/cell_parts.hpp"

namespace phantom::runtime {
namespace {

std::optional<int> read_auto_count(const ConfigReader& reader, const char* key, Range range) {
  if (!reader.has(key) || reader.text(key) == "auto") return std::nullopt;
  return reader.integer(key, range);
}

std::optional<robot::ClusterSpec> read_cluster(const ConfigReader& reader) {
  if (!reader.has("cluster")) return std::nullopt;
  const ConfigReader section = reader.section("cluster");
  robot::ClusterSpec cluster;
  cluster.reach_vox = section.integer("reach_vox", {1, 15, "voxels"});
  const std::string shape = section.choice("shape", "sphere", {"cube", "sphere", "fraction"});
  cluster.shape = shape == "cube"     ? robot::ClusterShape::kCube
                  : shape == "sphere" ? robot::ClusterShape::kSphere
                                      : robot::ClusterShape::kFraction;
  return cluster;
}

/// Reads corners from two lists of the same length: {r_m: [...], psi_deg: [...]}.
std::vector<robot::PolygonPoint> read_polygon(const ConfigReader& reader, const char* key) {
  if (!reader.has(key)) return {};
  const ConfigReader section = reader.section(key);
  const auto r_m = section.numbers("r_m", {1e-6, 10, "m"});
  const auto psi_deg = section.numbers("psi_deg", {-360, 360, "degrees"});
  if (r_m.size() != psi_deg.size() || r_m.size() < 3) {
    throw section.error("psi_deg", "has " + std::to_string(psi_deg.size()) + " values for " +
                                       std::to_string(r_m.size()) + " of r_m; allowed: as many, 3 or more");
  }
  std::vector<robot::PolygonPoint> polygon;
  for (std::size_t i = 0; i < r_m.size(); ++i) polygon.push_back({r_m[i], psi_deg[i] * core::kRadPerDegree});
  return polygon;
}

void check_ends(const ConfigReader& reader, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  if ((to_m - from_m).norm() < 1e-6) throw reader.error("to_m", "is the same point as from_m");
}

void read_ends(const ConfigReader& reader, SkinSegmentConfig& segment) {
  if (!reader.has("offset_m") && !reader.has("length_m")) {
    segment.from_m = reader.vector3("from_m");
    segment.to_m = reader.vector3("to_m");
    return check_ends(reader, segment.from_m, segment.to_m);
  }
  segment.along_axis_m = {reader.number("offset_m", 0.0, {-100, 100, "m"}),
                          reader.number("length_m", {1e-6, 100, "m"})};
  if (reader.has("from_m") || reader.has("to_m"))
    throw reader.error("length_m", "stands beside from_m or to_m; allowed: one way to place a segment");
}

void read_section(const ConfigReader& reader, SkinSegmentConfig& segment) {
  segment.from_polygon = read_polygon(reader, "from_polygon");
  segment.to_polygon = read_polygon(reader, "to_polygon");
  if (segment.from_polygon.empty()) {
    if (!segment.to_polygon.empty())
      throw reader.error("to_polygon", "stands without from_polygon; allowed: both, or from_polygon alone");
    segment.from_radius_m = reader.number("from_radius_m", {0, 10, "m"});
    segment.to_radius_m = reader.number("to_radius_m", segment.from_radius_m, {0, 10, "m"});
    return;
  }
  if (reader.has("from_radius_m") || reader.has("to_radius_m"))
    throw reader.error("from_polygon", "stands beside a radius; allowed: polygons, or radii");
  if (!segment.to_polygon.empty() && segment.to_polygon.size() != segment.from_polygon.size()) {
    throw reader.error("to_polygon", "has " + std::to_string(segment.to_polygon.size()) +
                                         " corners; allowed: " + std::to_string(segment.from_polygon.size()) +
                                         ", as from_polygon");
  }
}

SkinSegmentConfig read_segment(const ConfigReader& reader) {
  SkinSegmentConfig segment;
  read_ends(reader, segment);
  read_section(reader, segment);
  segment.sides = read_auto_count(reader, "sides", {3, 10000, "sensors"});
  segment.rings = read_auto_count(reader, "rings", {2, 10000, "rings"});
  segment.spin_rad = reader.number("spin_deg", 0.0, {-360, 360, "degrees"}) * core::kRadPerDegree;
  segment.gain = reader.number("gain", 1.0, {0, 1000, ""});
  segment.cluster = read_cluster(reader);
  return segment;
}

AxisSensorsConfig read_axis(const ConfigReader& reader) {
  AxisSensorsConfig axis;
  axis.along_link_axis = !reader.has("from_m") && !reader.has("to_m");
  if (!axis.along_link_axis) {
    axis.from_m = reader.vector3("from_m");
    axis.to_m = reader.vector3("to_m");
    check_ends(reader, axis.from_m, axis.to_m);
  }
  axis.count = read_auto_count(reader, "count", {1, 100000, "sensors"});
  axis.cluster = read_cluster(reader);
  if (reader.has("tip_reach_vox")) {
    if (!axis.cluster) throw reader.error("tip_reach_vox", "needs a cluster; allowed: with cluster only");
    axis.tip_reach_vox =
        reader.integer("tip_reach_vox", {1, static_cast<double>(axis.cluster->reach_vox), "voxels"});
  }
  if (reader.has("radius_m")) axis.radius_m = reader.number("radius_m", {1e-6, 10, "m"});
  axis.gain = reader.number("gain", 1.0, {0, 1000, ""});
  return axis;
}

MeshSensorsConfig read_mesh_sensors(const ConfigReader& reader) {
  MeshSensorsConfig sensors;
  if (reader.has("mesh")) {
    sensors.mesh = reader.path("mesh");
    if (!std::filesystem::is_regular_file(sensors.mesh))
      throw reader.error("mesh", "is not a file (" + sensors.mesh.string() + ")");
    sensors.mesh_scale = reader.number("mesh_scale", 1.0, {1e-6, 1e3, "m per mesh unit"});
    sensors.X_LM = reader.pose("pose");
  }
  sensors.gain = reader.number("gain", 1.0, {0, 1000, ""});
  sensors.cluster = read_cluster(reader);
  return sensors;
}

}  // namespace

LinkSkinConfig read_link_skin(const ConfigReader& reader) {
  LinkSkinConfig skin;
  skin.link = reader.text("link");
  for (const auto& segment : reader.sections("segments")) skin.segments.push_back(read_segment(segment));
  for (const auto& axis : reader.sections("axes")) skin.axes.push_back(read_axis(axis));
  for (const auto& mesh : reader.sections("meshes")) skin.meshes.push_back(read_mesh_sensors(mesh));
  if (skin.segments.empty() && skin.axes.empty() && skin.meshes.empty())
    throw reader.error("segments", "is empty; allowed: at least one of segments, axes, meshes");
  return skin;
}

}  // namespace phantom::runtime
