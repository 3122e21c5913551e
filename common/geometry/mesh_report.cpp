#include "common/geometry/mesh_report.hpp"

#include <Eigen/Geometry>

#include "common/geometry/mesh_topology.hpp"
#include "common/geometry/triangle_pairs.hpp"

namespace phantom::geometry {
namespace {

Eigen::Vector3d twice_area_normal(const TriangleMesh& mesh, const Triangle& t) {
  const Eigen::Vector3d a = mesh.vertices_m[t[0]].cast<double>();
  return (mesh.vertices_m[t[1]].cast<double>() - a).cross(mesh.vertices_m[t[2]].cast<double>() - a);
}

/// Counts the closed shells of which most triangles face inwards.
std::size_t inward_shells(const TriangleMesh& mesh, const std::vector<Triangle>& triangles,
                          const MeshTopology& topology) {
  std::vector<double> six_volumes(topology.shells.size(), 0.0);
  const Eigen::Vector3d origin = mesh.vertices_m.front().cast<double>();
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Eigen::Vector3d a = mesh.vertices_m[triangles[i][0]].cast<double>() - origin;
    const double way = topology.turned[i] != 0 ? -1.0 : 1.0;
    six_volumes[topology.shell_of[i]] += way * a.dot(twice_area_normal(mesh, triangles[i]));
  }
  std::size_t count = 0;
  for (std::size_t s = 0; s < six_volumes.size(); ++s)
    count += topology.shells[s].closed && six_volumes[s] < 0 ? 1 : 0;
  return count;
}

}  // namespace

MeshReport inspect_mesh(const TriangleMesh& mesh, const MeshReportLimits& limits) {
  MeshReport report;
  report.triangles = mesh.triangles.size();
  if (mesh.triangles.empty()) return report;
  std::size_t without_area = 0;
  for (const Triangle& t : mesh.triangles) {
    const double twice_area = twice_area_normal(mesh, t).norm();
    report.area_m2 += 0.5 * twice_area;
    const bool repeats = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    without_area += twice_area == 0.0 && !repeats ? 1 : 0;
  }
  report.volume_m3 = enclosed_volume_m3(mesh);
  const UniqueTriangles unique = unique_triangles(mesh.triangles);
  report.degenerate_triangles = unique.degenerate + without_area;
  report.duplicate_triangles = unique.duplicates;
  const MeshTopology topology = topology_of(unique.triangles);
  report.open_edges = topology.open_edges;
  report.non_manifold_edges = topology.non_manifold_edges;
  report.shells = topology.shells.size();
  for (const auto& shell : topology.shells) {
    report.flipped_triangles += shell.turned;
    report.closed_shells += shell.closed ? 1 : 0;
    report.unorientable_shells += shell.orientable ? 0 : 1;
  }
  report.inward_shells = inward_shells(mesh, unique.triangles, topology);
  const auto pairs = detail::crossing_pairs({mesh.vertices_m, unique.triangles}, limits.max_pairs);
  report.intersecting_pairs = pairs.intersecting;
  report.intersections_complete = pairs.complete;
  return report;
}

std::vector<std::string> describe(const MeshReport& report) {
  std::vector<std::string> text;
  const auto count_in_words = [&](std::size_t count, const char* one, const char* many) {
    if (count > 0) text.push_back("has " + std::to_string(count) + " " + (count == 1 ? one : many));
  };
  count_in_words(report.open_edges, "open edge", "open edges");
  count_in_words(report.non_manifold_edges, "edge of more than two triangles",
                 "edges of more than two triangles");
  count_in_words(report.flipped_triangles, "triangle that faces the wrong way",
                 "triangles that face the wrong way");
  count_in_words(report.unorientable_shells, "part with one side only", "parts with one side only");
  count_in_words(report.duplicate_triangles, "triangle twice", "triangles twice");
  count_in_words(report.degenerate_triangles, "triangle without area", "triangles without area");
  count_in_words(report.intersecting_pairs, "pair of triangles that pass through one another",
                 "pairs of triangles that pass through one another");
  if (!report.intersections_complete)
    text.emplace_back("has too many triangles close together to look for all that pass through one another");
  return text;
}

}  // namespace phantom::geometry
