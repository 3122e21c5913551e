#include "common/survey/visible.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "common/geometry/ray_triangle.hpp"

namespace phantom::survey {
namespace {

constexpr double kBefore_m = 1e-3;  // a triangle hides a corner if the beam meets it this much earlier

bool sees(const PartModel& part, const Eigen::Vector3d& eye_O, const Eigen::Vector3d& node_O) {
  const Eigen::Vector3d way = node_O - eye_O;
  const double until = 1.0 - kBefore_m / way.norm();
  const auto corner = [&](std::uint32_t vertex) -> Eigen::Vector3d {
    return part.mesh_O.vertices_m[vertex].cast<double>();
  };
  const auto& triangles = part.mesh_O.triangles;
  return std::none_of(triangles.begin(), triangles.end(), [&](const std::array<std::uint32_t, 3>& t) {
    const auto at = geometry::ray_meets_triangle(eye_O, way, corner(t[0]), corner(t[1]), corner(t[2]));
    return at && *at > 0 && *at < until;
  });
}

/// Returns the longest run of successive corners that are seen.
VisibleFace seen_part(const BorderLoop& loop, const std::vector<bool>& seen) {
  VisibleFace face;
  face.face = loop.face;
  const std::size_t n = loop.nodes.size();
  if (std::all_of(seen.begin(), seen.end(), [](bool s) { return s; })) {
    face.nodes = loop.nodes;
    return face;
  }
  face.closed = false;
  for (std::size_t start = 0; start < n; ++start) {
    if (!seen[start] || seen[(start + n - 1) % n]) continue;
    std::vector<std::uint32_t> run;
    for (std::size_t i = start; seen[i % n] && run.size() < n; ++i) run.push_back(loop.nodes[i % n]);
    if (run.size() > face.nodes.size()) face.nodes = std::move(run);
  }
  return face;
}

}  // namespace

std::vector<VisibleFace> visible_faces(const PartModel& part, const geometry::Pose& X_WO,
                                       const Eigen::Vector3d& eye_W_m, const VisibleOptions& options) {
  const Eigen::Vector3d eye_O = X_WO.inverse() * eye_W_m;
  std::vector<std::pair<double, const BorderLoop*>> facing;
  for (const BorderLoop& loop : part.loops) {
    const PartFace& face = part.faces[loop.face];
    const double cosine = face.normal_O.dot((eye_O - part.nodes_O_m[loop.nodes.front()]).normalized());
    if (loop.hole || cosine < options.least_cosine || loop.nodes.size() > options.most_corners) continue;
    if (*std::min_element(loop.edge_m.begin(), loop.edge_m.end()) < options.least_edge_m) continue;
    facing.emplace_back(face.area_m2 * cosine, &loop);
  }
  std::stable_sort(facing.begin(), facing.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<VisibleFace> faces;
  for (const auto& [size, loop] : facing) {
    if (faces.size() == options.most_faces) break;
    std::vector<bool> seen;
    for (const std::uint32_t node : loop->nodes) seen.push_back(sees(part, eye_O, part.nodes_O_m[node]));
    VisibleFace face = seen_part(*loop, seen);
    if (face.nodes.size() >= 2) faces.push_back(std::move(face));
  }
  return faces;
}

core::Expected<std::vector<Targeting>> simulate_targetings(const PartModel& part, const geometry::Pose& X_WO,
                                                           const std::vector<VisibleFace>& faces,
                                                           const RangeHead& head, const HeadErrors& errors,
                                                           std::mt19937_64& random) {
  std::vector<Targeting> targetings;
  std::map<std::uint32_t, std::size_t> first_of;  // index of the targeting in which a corner came first
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (const std::uint32_t node : faces[f].nodes) {
      Targeting targeting{std::string(1, static_cast<char>('A' + f)),
                          faces[f].closed,
                          std::to_string(first_of.size() + 1),
                          std::nullopt,
                          {}};
      const auto [known, is_new] = first_of.try_emplace(node, targetings.size());
      if (is_new) {
        const auto reading = simulate_reading(head, errors, X_WO * part.nodes_O_m[node], random,
                                              X_WO.rotation * part.faces[faces[f].face].normal_O);
        if (!reading) return reading.status();
        targeting.reading = *reading;
      } else {
        targeting.node = targetings[known->second].node;
      }
      targetings.push_back(std::move(targeting));
    }
  }
  return targetings;
}

}  // namespace phantom::survey
