#include "common/geometry/mesh/mesh_report.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/core/text.hpp"
#include "common/geometry/mesh/mesh_topology.hpp"
#include "common/geometry/mesh/triangle_pairs.hpp"
#include "common/geometry/mesh/winding_number.hpp"

namespace phantom::geometry {
namespace {

Eigen::Vector3d twice_area_normal(const TriangleMesh& mesh, const Triangle& t) {
  const Eigen::Vector3d a = mesh.vertices_m[t[0]].cast<double>();
  return (mesh.vertices_m[t[1]].cast<double>() - a).cross(mesh.vertices_m[t[2]].cast<double>() - a);
}

/// Returns six times the volume of each shell, below 0 if most of it faces inwards. `mesh`: every shell faces
/// one way.
std::vector<double> six_volumes_of(const TriangleMesh& mesh, const MeshTopology& topology) {
  std::vector<double> six_volumes(topology.shells.size(), 0.0);
  const Eigen::Vector3d origin = mesh.vertices_m[mesh.triangles.front()[0]].cast<double>();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Eigen::Vector3d a = mesh.vertices_m[mesh.triangles[i][0]].cast<double>() - origin;
    six_volumes[topology.shell_of[i]] += a.dot(twice_area_normal(mesh, mesh.triangles[i]));
  }
  return six_volumes;
}

/// Returns the volume of where the winding number is not 0. Each shell adds its volume if it is solid inside
/// and free around it, and takes it away if it is a cavity.
double solid_volume_m3(const TriangleMesh& mesh, const MeshTopology& topology,
                       const std::vector<double>& six_volumes) {
  if (six_volumes.size() == 1) return std::abs(six_volumes[0]) / 6.0;
  const WindingTree tree(mesh);
  std::vector<std::uint32_t> largest(six_volumes.size());
  std::vector<double> twice_area(six_volumes.size(), -1.0);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const double here = twice_area_normal(mesh, mesh.triangles[i]).norm();
    if (here <= twice_area[topology.shell_of[i]]) continue;
    twice_area[topology.shell_of[i]] = here;
    largest[topology.shell_of[i]] = i;
  }
  double sum_m3 = 0.0;
  for (std::size_t s = 0; s < six_volumes.size(); ++s) {
    const Triangle& sample = mesh.triangles[largest[s]];
    if (twice_area[s] == 0.0) continue;
    Eigen::Vector3d before = 1e-4 * twice_area_normal(mesh, sample) / std::sqrt(twice_area[s]);  // its front
    for (const std::uint32_t corner : sample) before += mesh.vertices_m[corner].cast<double>() / 3.0;
    const double front = std::round(tree.at(before)), back = front + 1.0;
    const bool faces_out = six_volumes[s] > 0;
    const double inside = faces_out ? back : front, around = faces_out ? front : back;
    sum_m3 += ((inside != 0 ? 1.0 : 0.0) - (around != 0 ? 1.0 : 0.0)) * std::abs(six_volumes[s]) / 6.0;
  }
  return sum_m3;
}

/// Returns the triangles turned so that each shell faces one way.
TriangleMesh with_shells_turned(const TriangleMesh& mesh, const std::vector<Triangle>& triangles,
                                const MeshTopology& topology) {
  TriangleMesh turned{mesh.vertices_m, triangles};
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (topology.turned[i] != 0) std::swap(turned.triangles[i][1], turned.triangles[i][2]);
  }
  return turned;
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
  if (unique.triangles.empty()) return report;
  const TriangleMesh turned = with_shells_turned(mesh, unique.triangles, topology);
  const std::vector<double> six_volumes = six_volumes_of(turned, topology);
  for (std::size_t s = 0; s < six_volumes.size(); ++s)
    report.inward_shells += topology.shells[s].closed && six_volumes[s] < 0 ? 1 : 0;
  report.volume_m3 = solid_volume_m3(turned, topology, six_volumes);
  const auto pairs = detail::crossing_pairs(turned, limits.max_pairs);
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

CoordinatePrecision coordinate_precision(const TriangleMesh& mesh) {
  const BoundingBox box = mesh.bounding_box();
  if (box.empty()) return {};
  const float farthest = std::max(box.min_m.cwiseAbs().maxCoeff(), box.max_m.cwiseAbs().maxCoeff());
  return {farthest, std::nextafter(farthest, std::numeric_limits<float>::infinity()) - farthest};
}

std::string describe(const CoordinatePrecision& precision, double voxel_m) {
  return core::formatted(
      "reaches %.6g m from its origin, where coordinates of 32 bits are rounded to %.2g m, too coarse for a voxel "
      "of %g m; allowed: a mesh with its origin near to it, a pose that puts it there, and the scale of its units",
      precision.farthest_m, precision.step_m, voxel_m);
}

}  // namespace phantom::geometry
