#include "common/survey/part.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "common/geometry/mesh/weld.hpp"

namespace phantom::survey {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// The mesh with coincident vertices merged and triangles without area removed.
struct Welded {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Eigen::Vector3d> normals;  // unit
  std::vector<double> areas;
};

Welded weld(const geometry::TriangleMesh& mesh, double join_m) {
  Welded welded;
  std::vector<Eigen::Vector3d> vertices_m;
  for (const Eigen::Vector3f& vertex : mesh.vertices_m) vertices_m.push_back(vertex.cast<double>());
  const std::vector<std::uint32_t> first = geometry::weld(vertices_m, join_m);
  std::vector<std::uint32_t> point_of(first.size());
  for (std::uint32_t i = 0; i < first.size(); ++i) {
    if (first[i] == i) welded.points.push_back(vertices_m[i]);
    point_of[i] = first[i] == i ? static_cast<std::uint32_t>(welded.points.size() - 1) : point_of[first[i]];
  }
  std::vector<std::array<std::uint32_t, 3>> distinct;
  geometry::Places<std::array<std::uint32_t, 3>> seen(distinct);
  for (const auto& t : mesh.triangles) {
    const std::array<std::uint32_t, 3> w{point_of[t[0]], point_of[t[1]], point_of[t[2]]};
    if (w[0] == w[1] || w[1] == w[2] || w[2] == w[0]) continue;
    const Eigen::Vector3d twice =
        (welded.points[w[1]] - welded.points[w[0]]).cross(welded.points[w[2]] - welded.points[w[0]]);
    const double longest = std::max({(welded.points[w[1]] - welded.points[w[0]]).norm(),
                                     (welded.points[w[2]] - welded.points[w[1]]).norm(),
                                     (welded.points[w[0]] - welded.points[w[2]]).norm()});
    if (twice.norm() < join_m * longest) continue;  // its corners are in line
    std::array<std::uint32_t, 3> key = w;
    std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
    if (seen.number_of(key) < welded.triangles.size()) continue;
    welded.triangles.push_back(w);
    welded.normals.push_back(twice.normalized());
    welded.areas.push_back(0.5 * twice.norm());
  }
  return welded;
}

/// Returns the triangles on either side of each edge, in either direction.
std::map<Edge, std::vector<std::uint32_t>> triangles_at_edges(const Welded& mesh) {
  std::map<Edge, std::vector<std::uint32_t>> at;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3];
      at[{std::min(a, b), std::max(a, b)}].push_back(t);
    }
  }
  return at;
}

/// Returns the triangles of each face, grown from the largest triangles.
std::vector<std::vector<std::uint32_t>> group(const Welded& mesh, const PartOptions& options) {
  std::vector<std::vector<std::uint32_t>> faces;
  constexpr std::uint32_t kNone = UINT32_MAX;
  const auto at_edges = triangles_at_edges(mesh);
  std::vector<std::uint32_t> face_of(mesh.triangles.size(), kNone), order(mesh.triangles.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return mesh.areas[a] > mesh.areas[b]; });
  const double least_cosine = std::cos(options.plane_rad);
  for (const std::uint32_t seed : order) {
    if (face_of[seed] != kNone) continue;
    const Eigen::Vector3d normal = mesh.normals[seed], on_it = mesh.points[mesh.triangles[seed][0]];
    const auto face = static_cast<std::uint32_t>(faces.size());
    faces.emplace_back(1, seed);
    face_of[seed] = face;
    const auto belongs = [&](std::uint32_t t) {
      if (face_of[t] != kNone || mesh.normals[t].dot(normal) < least_cosine) return false;
      return std::all_of(mesh.triangles[t].begin(), mesh.triangles[t].end(), [&](std::uint32_t p) {
        return std::abs(normal.dot(mesh.points[p] - on_it)) <= options.plane_m;
      });
    };
    for (std::size_t next = 0; next < faces[face].size(); ++next) {
      const auto corners = mesh.triangles[faces[face][next]];
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t a = corners[i], b = corners[(i + 1) % 3];
        for (const std::uint32_t t : at_edges.at({std::min(a, b), std::max(a, b)})) {
          if (!belongs(t)) continue;
          face_of[t] = face;
          faces[face].push_back(t);
        }
      }
    }
  }
  return faces;
}

/// Chains a face's border edges (those with only one of its triangles) into closed loops of points.
std::vector<std::vector<std::uint32_t>> borders(const Welded& mesh,
                                                const std::vector<std::uint32_t>& triangles,
                                                const Eigen::Vector3d& normal) {
  std::map<Edge, int> directed;
  for (const std::uint32_t t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++directed[{mesh.triangles[t][i], mesh.triangles[t][(i + 1) % 3]}];
  }
  std::map<std::uint32_t, std::vector<std::uint32_t>> next_of;
  for (const auto& [edge, count] : directed) {
    const auto back = directed.find({edge.second, edge.first});
    if (count == 1 && back == directed.end()) next_of[edge.first].push_back(edge.second);
  }
  std::vector<std::vector<std::uint32_t>> loops;
  while (!next_of.empty()) {
    std::vector<std::uint32_t> loop{next_of.begin()->first};
    while (true) {
      const auto from = next_of.find(loop.back());
      if (from == next_of.end()) break;  // an open border is no polygon
      auto& ways = from->second;
      auto way = ways.begin();
      if (ways.size() > 1 && loop.size() > 1) {
        // Borders touch at this point. Turning right the most stays on the same border.
        const Eigen::Vector3d in = mesh.points[loop.back()] - mesh.points[loop[loop.size() - 2]];
        const auto turn = [&](std::uint32_t to) {
          const Eigen::Vector3d out = mesh.points[to] - mesh.points[loop.back()];
          return std::atan2(normal.dot(in.cross(out)), in.dot(out));
        };
        way = std::min_element(ways.begin(), ways.end(),
                               [&](std::uint32_t a, std::uint32_t b) { return turn(a) < turn(b); });
      }
      const std::uint32_t to = *way;
      ways.erase(way);
      if (ways.empty()) next_of.erase(from);
      if (to == loop.front()) {
        loops.push_back(std::move(loop));
        break;
      }
      loop.push_back(to);
    }
  }
  return loops;
}

/// Removes points at which a border runs straight.
std::vector<std::uint32_t> corners_only(std::vector<std::uint32_t> loop, const Welded& mesh,
                                        double straight_rad) {
  for (bool again = true; again && loop.size() >= 3;) {
    again = false;
    for (std::size_t i = 0; i < loop.size() && loop.size() >= 3; ++i) {
      const std::size_t n = loop.size();
      const Eigen::Vector3d in = mesh.points[loop[i]] - mesh.points[loop[(i + n - 1) % n]];
      const Eigen::Vector3d out = mesh.points[loop[(i + 1) % n]] - mesh.points[loop[i]];
      if (std::atan2(in.cross(out).norm(), in.dot(out)) >= straight_rad) continue;
      loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(i));
      again = true;
      --i;
    }
  }
  return loop;
}

/// Returns points that lie outermost in many directions: the corners of the convex hull, except the finest.
std::vector<Eigen::Vector3d> extremes(const std::vector<Eigen::Vector3d>& points) {
  constexpr int kDirections = 500;
  std::vector<std::size_t> chosen;
  for (int i = 0; i < kDirections && !points.empty(); ++i) {  // directions on a Fibonacci sphere
    const double z = 1.0 - (2.0 * i + 1.0) / kDirections,
                 angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d direction(r * std::cos(angle), r * std::sin(angle), z);
    std::size_t best = 0;
    for (std::size_t p = 1; p < points.size(); ++p) {
      if (direction.dot(points[p]) > direction.dot(points[best])) best = p;
    }
    if (std::find(chosen.begin(), chosen.end(), best) == chosen.end()) chosen.push_back(best);
  }
  std::vector<Eigen::Vector3d> outermost;
  for (const std::size_t p : chosen) outermost.push_back(points[p]);
  return outermost;
}

/// `node_of`: the nodes made so far, by their points in the mesh.
void add_loop(PartModel& part, std::map<std::uint32_t, std::uint32_t>& node_of,
              std::vector<std::uint32_t> points, const Welded& mesh, std::uint32_t face) {
  const Eigen::Vector3d& normal = part.faces[face].normal_O;
  Eigen::Vector3d twice = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i)
    twice += (mesh.points[points[i]] - mesh.points[points[0]])
                 .cross(mesh.points[points[(i + 1) % points.size()]] - mesh.points[points[0]]);
  BorderLoop loop;
  loop.face = face;
  loop.hole = twice.dot(normal) < 0;
  if (loop.hole) std::reverse(points.begin(), points.end());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t n = points.size();
    const Eigen::Vector3d& p = mesh.points[points[i]];
    const Eigen::Vector3d in = p - mesh.points[points[(i + n - 1) % n]],
                          out = mesh.points[points[(i + 1) % n]] - p;
    const auto [node, is_new] =
        node_of.try_emplace(points[i], static_cast<std::uint32_t>(part.nodes_O_m.size()));
    if (is_new) part.nodes_O_m.push_back(p);
    loop.nodes.push_back(node->second);
    loop.edge_m.push_back(out.norm());
    loop.turn_rad.push_back(std::atan2(normal.dot(in.cross(out)), in.dot(out)));
  }
  part.loops.push_back(std::move(loop));
}

}  // namespace

PartModel make_part(const std::string& name, const geometry::TriangleMesh& mesh_O,
                    const PartOptions& options) {
  PartModel part;
  part.name = name;
  part.mesh_O = mesh_O;
  const Welded mesh = weld(mesh_O, options.join_m);
  const auto faces = group(mesh, options);
  std::map<std::uint32_t, std::uint32_t> node_of;
  for (const auto& triangles : faces) {
    PartFace face;
    for (const std::uint32_t t : triangles) {
      face.area_m2 += mesh.areas[t];
      face.normal_O += mesh.areas[t] * mesh.normals[t];
    }
    face.normal_O.normalize();
    part.faces.push_back(face);
    for (auto& border : borders(mesh, triangles, face.normal_O)) {
      auto corners = corners_only(std::move(border), mesh, options.straight_rad);
      if (corners.size() >= 3)
        add_loop(part, node_of, std::move(corners), mesh, static_cast<std::uint32_t>(part.faces.size() - 1));
    }
  }
  part.extremes_O_m = extremes(mesh.points);
  const geometry::BoundingBox box = mesh_O.bounding_box();
  if (!box.empty()) part.extent_m = (box.max_m - box.min_m).cast<double>().norm();
  return part;
}

std::set<std::pair<std::uint32_t, std::uint32_t>> sharp_edges(const PartModel& part) {
  constexpr double kSharpCosine = 0.85;
  std::map<std::pair<std::uint32_t, std::uint32_t>, Eigen::Vector3d> normal_at;
  std::set<std::pair<std::uint32_t, std::uint32_t>> sharp;
  for (const BorderLoop& loop : part.loops) {
    for (std::size_t i = 0; i < loop.nodes.size(); ++i) {
      const auto edge = std::minmax({loop.nodes[i], loop.nodes[(i + 1) % loop.nodes.size()]});
      const Eigen::Vector3d& normal = part.faces[loop.face].normal_O;
      const auto [known, is_new] = normal_at.try_emplace(edge, normal);
      if (is_new || known->second.dot(normal) < kSharpCosine) {
        sharp.insert(edge);
      } else {
        sharp.erase(edge);
      }
    }
  }
  return sharp;
}

bool is_symmetry(const PartModel& part, const geometry::Pose& D, double tolerance_m) {
  geometry::PointGrid grid(tolerance_m);
  for (std::uint32_t i = 0; i < part.nodes_O_m.size(); ++i) grid.add(part.nodes_O_m[i], i);
  return std::all_of(part.nodes_O_m.begin(), part.nodes_O_m.end(),
                     [&](const Eigen::Vector3d& node) { return grid.nearest(D * node).has_value(); });
}

}  // namespace phantom::survey
