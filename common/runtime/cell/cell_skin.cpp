#include "common/core/units.hpp"
#include "common/runtime/cell/cell_parts.hpp"

namespace phantom::runtime {
namespace {

void read_auto_count(const Fields& fields, const char* key, std::optional<int>& count) {
  if (fields.has(key) && fields.text(key) != "auto") fields.number(key, count.emplace());
}

void read_cluster(const Fields& fields, std::optional<robot::ClusterSpec>& cluster) {
  if (!fields.has("cluster")) return;
  const Fields section = fields.section("cluster").as("cluster");
  section.number("reach_vox", cluster.emplace().reach_vox);
  using enum robot::ClusterShape;
  section.choice("shape", cluster->shape,
                 {{"cube", kCube},
                  {"sphere", kSphere},
                  {"sphere-contained", kSphereContained},
                  {"fraction", kFraction}});
}

/// Reads corners from two lists of the same length: {r_m: [...], psi_deg: [...]}.
std::vector<robot::PolygonPoint> read_polygon(const Fields& fields, const char* key) {
  if (!fields.has(key)) return {};
  const Fields section = fields.section(key);
  std::vector<double> r_m, psi_deg;
  section.numbers("r_m", r_m);
  section.numbers("psi_deg", psi_deg);
  section.check(r_m.size() == psi_deg.size() && r_m.size() >= 3, "psi_deg",
                "has " + std::to_string(psi_deg.size()) + " values for " + std::to_string(r_m.size()) +
                    " of r_m; allowed: as many, 3 or more");
  std::vector<robot::PolygonPoint> polygon;
  for (std::size_t i = 0; i < r_m.size(); ++i) polygon.push_back({r_m[i], psi_deg[i] * core::kRadPerDegree});
  return polygon;
}

template <class Line>
void read_ends(const Fields& fields, Line& line) {
  fields.vector3("from_m", line.from_m);
  fields.vector3("to_m", line.to_m);
  fields.check((line.to_m - line.from_m).norm() >= 1e-6, "to_m", "is the same point as from_m");
}

void read_sections(const Fields& fields, SkinSegmentConfig& segment) {
  segment.from_polygon = read_polygon(fields, "from_polygon");
  segment.to_polygon = read_polygon(fields, "to_polygon");
  const std::size_t corners = segment.from_polygon.size(), to_corners = segment.to_polygon.size();
  if (corners == 0) {
    fields.check(to_corners == 0, "to_polygon",
                 "stands without from_polygon; allowed: both, or from_polygon alone");
    fields.number("from_radius_m", segment.from_radius_m);
    segment.to_radius_m = fields.value("to_radius_m", segment.from_radius_m);
    return;
  }
  fields.check(!fields.has("from_radius_m") && !fields.has("to_radius_m"), "from_polygon",
               "stands beside a radius; allowed: polygons, or radii");
  fields.check(to_corners == 0 || to_corners == corners, "to_polygon",
               "has " + std::to_string(to_corners) + " corners; allowed: " + std::to_string(corners) +
                   ", as from_polygon");
}

SkinSegmentConfig read_segment(const Fields& fields) {
  SkinSegmentConfig segment;
  if (fields.has("offset_m") || fields.has("length_m")) {
    segment.along_axis_m = {fields.value("offset_m"), fields.value("length_m")};
    fields.check(!fields.has("from_m") && !fields.has("to_m"), "length_m",
                 "stands beside from_m or to_m; allowed: one way to place a segment");
  } else {
    read_ends(fields, segment);
  }
  read_sections(fields, segment);
  read_auto_count(fields, "sides", segment.sides);
  read_auto_count(fields, "rings", segment.rings);
  fields.number("spin_deg", segment.spin_rad, core::kRadPerDegree);
  fields.number("gain", segment.gain);
  read_cluster(fields, segment.cluster);
  return segment;
}

AxisSensorsConfig read_axis(const Fields& fields) {
  AxisSensorsConfig axis;
  axis.along_link_axis = !fields.has("from_m") && !fields.has("to_m");
  if (!axis.along_link_axis) read_ends(fields, axis);
  read_auto_count(fields, "count", axis.count);
  read_cluster(fields, axis.cluster);
  if (fields.has("tip_reach_vox")) {
    fields.check(axis.cluster.has_value(), "tip_reach_vox", "needs a cluster; allowed: with cluster only");
    fields.number("tip_reach_vox", axis.tip_reach_vox.emplace());
    fields.check(
        *axis.tip_reach_vox <= axis.cluster->reach_vox, "tip_reach_vox",
        "is above the cluster's; allowed: 1 to " + std::to_string(axis.cluster->reach_vox) + " voxels");
  }
  fields.number("radius_m", axis.radius_m);
  fields.number("gain", axis.gain);
  return axis;
}

MeshSensorsConfig read_mesh_sensors(const Fields& fields) {
  MeshSensorsConfig sensors;
  if (fields.has("mesh")) {
    sensors.mesh = fields.existing_file("mesh");
    fields.number("mesh_scale", sensors.mesh_scale);
    sensors.X_LM = fields.pose("pose");
  }
  fields.number("gain", sensors.gain);
  read_cluster(fields, sensors.cluster);
  return sensors;
}

}  // namespace

LinkSkinConfig read_link_skin(const Fields& fields) {
  LinkSkinConfig skin;
  fields.text("link", skin.link);
  for (const Fields& segment : fields.sections("segments")) skin.segments.push_back(read_segment(segment));
  for (const Fields& axis : fields.sections("axes")) skin.axes.push_back(read_axis(axis));
  for (const Fields& mesh : fields.sections("meshes")) skin.meshes.push_back(read_mesh_sensors(mesh));
  fields.check(!skin.segments.empty() || !skin.axes.empty() || !skin.meshes.empty(), "segments",
               "is empty; allowed: at least one of segments, axes, meshes");
  return skin;
}

}  // namespace phantom::runtime
