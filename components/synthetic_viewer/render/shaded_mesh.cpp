#include "components/synthetic_viewer/render/shaded_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/geometry/mesh/weld.hpp"

namespace phantom::synthetic_viewer {
namespace {

/// The triangle corners that meet at each place, as linked lists through `next`.
struct CornersByPlace {
  std::vector<std::uint32_t> place_of_vertex;
  std::vector<std::uint32_t> first, next, size;  // first corner of a place; next corner of the same place
};
constexpr std::uint32_t kEnd = ~0U;
// Where more corners than this meet (the middle of a disc, a broken file), normals stay those of the faces,
// because comparing each corner with each other one would take too long.
constexpr std::uint32_t kMaxCorners = 512;

CornersByPlace find_places(const geometry::TriangleMesh& mesh,
                           const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  CornersByPlace places;
  places.place_of_vertex = geometry::weld(mesh.vertices_m);
  places.first.assign(mesh.vertices_m.size(), kEnd);
  places.size.assign(mesh.vertices_m.size(), 0);
  places.next.resize(3 * triangles.size());
  for (std::uint32_t corner = 0; corner < places.next.size(); ++corner) {
    const std::uint32_t place = places.place_of_vertex[triangles[corner / 3][corner % 3]];
    places.next[corner] = std::exchange(places.first[place], corner);
    ++places.size[place];
  }
  return places;
}

ShadedMesh::Vertex vertex(const Eigen::Vector3f& position, const Eigen::Vector3f& normal) {
  return {{position.x(), position.y(), position.z()}, {normal.x(), normal.y(), normal.z()}};
}

}  // namespace

ShadedMesh shade(const geometry::TriangleMesh& mesh, double crease_rad) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Eigen::Vector3f> normals;  // unit
  std::vector<float> areas;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f& a = mesh.vertices_m[t[0]];
    const Eigen::Vector3f cross = (mesh.vertices_m[t[1]] - a).cross(mesh.vertices_m[t[2]] - a);
    const float length = cross.norm();
    if (!(length > 0)) continue;
    triangles.push_back(t);
    normals.push_back(cross / length);
    areas.push_back(length);
  }
  const CornersByPlace places = find_places(mesh, triangles);
  const float least_cosine = static_cast<float>(std::cos(crease_rad));
  ShadedMesh shaded;
  std::vector<std::uint32_t> made(places.next.size());  // index of the vertex made for a corner
  for (std::uint32_t corner = 0; corner < made.size(); ++corner) {
    const std::uint32_t face = corner / 3, source = triangles[face][corner % 3];
    const std::uint32_t place = places.place_of_vertex[source];
    Eigen::Vector3f sum = normals[face] * areas[face];
    if (places.size[place] <= kMaxCorners) {
      sum.setZero();
      for (std::uint32_t other = places.first[place]; other != kEnd; other = places.next[other]) {
        if (normals[other / 3].dot(normals[face]) >= least_cosine)
          sum += normals[other / 3] * areas[other / 3];
      }
    }
    const Eigen::Vector3f normal = sum.normalized();
    std::uint32_t index = kEnd;
    // A corner shares the vertex of an earlier neighbour with the same normal. Later corners have no vertex
    // yet.
    for (std::uint32_t other = places.next[corner], tries = 0; other != kEnd && tries < 16;
         other = places.next[other], ++tries) {
      const auto& n = shaded.vertices[made[other]].normal;
      if (Eigen::Vector3f(n[0], n[1], n[2]).dot(normal) > 0.99999F) {
        index = made[other];
        break;
      }
    }
    if (index == kEnd) {
      index = static_cast<std::uint32_t>(shaded.vertices.size());
      shaded.vertices.push_back(vertex(mesh.vertices_m[source], normal));
    }
    made[corner] = index;
    shaded.indices.push_back(index);
  }
  return shaded;
}

geometry::TriangleMesh coarsen(const geometry::TriangleMesh& mesh, double pitch_m) {
  geometry::TriangleMesh coarse;
  std::vector<Eigen::Vector3f> cubes;
  geometry::Places<Eigen::Vector3f> known_cubes(cubes);
  std::vector<std::uint32_t> cube_of_vertex;
  std::vector<float> members;
  cube_of_vertex.reserve(mesh.vertices_m.size());
  for (const Eigen::Vector3f& v : mesh.vertices_m) {
    const std::uint32_t cube = known_cubes.number_of((v / static_cast<float>(pitch_m)).array().floor());
    if (cube == members.size()) {
      coarse.vertices_m.emplace_back(Eigen::Vector3f::Zero());
      members.push_back(0.0F);
    }
    coarse.vertices_m[cube] += v;
    members[cube] += 1.0F;
    cube_of_vertex.push_back(cube);
  }
  for (std::size_t i = 0; i < members.size(); ++i) coarse.vertices_m[i] /= members[i];
  using Corners = std::array<std::uint32_t, 3>;
  std::vector<Corners> distinct;
  geometry::Places<Corners> known(distinct);
  for (const auto& t : mesh.triangles) {
    const Corners corners{cube_of_vertex[t[0]], cube_of_vertex[t[1]], cube_of_vertex[t[2]]};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    Corners sorted = corners;
    std::sort(sorted.begin(), sorted.end());
    if (known.number_of(sorted) == coarse.triangles.size()) coarse.triangles.push_back(corners);
  }
  return coarse;
}

}  // namespace phantom::synthetic_viewer
