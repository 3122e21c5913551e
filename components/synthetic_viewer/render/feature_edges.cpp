#include "components/synthetic_viewer/render/feature_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/geometry/mesh/weld.hpp"

namespace phantom::synthetic_viewer {
namespace {

/// One side of an edge; sides with the same ends belong together.
struct EdgeSide {
  std::array<std::uint32_t, 2> ends;
  std::uint32_t triangle;
};

/// Unit directions of features at a place, up to two that differ; a third that is not in their plane makes it
/// a corner.
struct Fan {
  std::array<Eigen::Vector3f, 2> directions;
  int count = 0;

  void add(const Eigen::Vector3f& direction) {
    constexpr float kApart = 0.2F;  // sine of the least angle
    if (count == 0 || (count == 1 && directions[0].cross(direction).norm() > kApart))
      directions[static_cast<std::size_t>(count++)] = direction;
    else if (count == 2 && std::abs(directions[0].cross(directions[1]).normalized().dot(direction)) > kApart)
      count = 3;
  }
};

std::vector<std::uint32_t> corners_of(const EdgeMesh& mesh) {
  std::vector<Fan> fans(mesh.places_m.size());
  for (const EdgeMesh::Edge& edge : mesh.edges) {
    if (!edge.feature) continue;
    const Eigen::Vector3f along = (mesh.places_m[edge.ends[1]] - mesh.places_m[edge.ends[0]]).normalized();
    for (const std::uint32_t end : edge.ends) fans[end].add(along);
  }
  std::vector<std::uint32_t> corners;
  for (std::uint32_t place = 0; place < fans.size(); ++place)
    if (fans[place].count == 3) corners.push_back(place);
  return corners;
}

}  // namespace

EdgeMesh edges_of(const geometry::TriangleMesh& mesh, double sharp_rad) {
  EdgeMesh made;
  geometry::Places<Eigen::Vector3f> places(made.places_m);
  places.expect(mesh.vertices_m.size());
  std::vector<EdgeSide> sides;
  for (const auto& corners : mesh.triangles) {
    std::array<std::uint32_t, 3> at{};
    for (std::size_t i = 0; i < 3; ++i) at[i] = places.number_of(mesh.vertices_m[corners[i]]);
    const Eigen::Vector3f normal =
        (made.places_m[at[1]] - made.places_m[at[0]]).cross(made.places_m[at[2]] - made.places_m[at[0]]);
    if (!(normal.norm() > 0.0F)) continue;
    const auto triangle = static_cast<std::uint32_t>(made.normals.size());
    made.normals.push_back(normal.normalized());
    for (std::size_t i = 0; i < 3; ++i)
      sides.push_back({{std::min(at[i], at[(i + 1) % 3]), std::max(at[i], at[(i + 1) % 3])}, triangle});
  }
  std::ranges::sort(sides, {}, &EdgeSide::ends);
  const auto sharp = static_cast<float>(std::cos(sharp_rad));
  for (auto first = sides.begin(); first != sides.end();) {
    const auto last =
        std::find_if(first, sides.end(), [&](const EdgeSide& s) { return s.ends != first->ends; });
    const std::uint32_t a = first->triangle, b = std::prev(last)->triangle;
    const bool plain = last - first == 2 && made.normals[a].dot(made.normals[b]) >= sharp;
    made.edges.push_back({first->ends, {a, b}, !plain});
    first = last;
  }
  made.corners = corners_of(made);
  return made;
}

std::optional<Eigen::Vector3f> corner_towards(const EdgeMesh& mesh, const std::array<bool, 3>& high) {
  if (mesh.corners.empty()) return std::nullopt;
  Eigen::Vector3f least = mesh.places_m.front(), most = least;
  for (const Eigen::Vector3f& place : mesh.places_m) {
    least = least.cwiseMin(place);
    most = most.cwiseMax(place);
  }
  const Eigen::Vector3f middle = 0.5F * (least + most);
  std::optional<Eigen::Vector3f> best;
  float nearest_m2 = 0.0F;
  for (const std::uint32_t corner : mesh.corners) {
    const Eigen::Vector3f& place = mesh.places_m[corner];
    float distance_m2 = 0.0F;
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis) {
      const bool to_most = high[static_cast<std::size_t>(axis)];
      const float away = to_most ? most[axis] - place[axis] : place[axis] - least[axis];
      inside = inside && (to_most ? place[axis] > middle[axis] : place[axis] < middle[axis]);
      distance_m2 += away * away;
    }
    if (!inside || (best && distance_m2 >= nearest_m2)) continue;
    best = place;
    nearest_m2 = distance_m2;
  }
  return best;
}

void add_edges(const EdgeMesh& mesh, const geometry::Pose& X_WM, const Eigen::Vector3d& eye_m,
               std::vector<Line>& lines) {
  const Eigen::Vector3f eye_M_m = (X_WM.inverse() * eye_m).cast<float>();
  const Eigen::Matrix3f rotation = X_WM.rotation.cast<float>();
  const Eigen::Vector3f origin_m = X_WM.translation_m.cast<float>();
  for (const EdgeMesh::Edge& edge : mesh.edges) {
    const Eigen::Vector3f& from_m = mesh.places_m[edge.ends[0]];
    if (!edge.feature) {
      const Eigen::Vector3f to_eye = eye_M_m - from_m;
      const bool left = mesh.normals[edge.sides[0]].dot(to_eye) > 0.0F;
      const bool right = mesh.normals[edge.sides[1]].dot(to_eye) > 0.0F;
      if (left == right) continue;
    }
    lines.push_back({rotation * from_m + origin_m, rotation * mesh.places_m[edge.ends[1]] + origin_m});
  }
}

}  // namespace phantom::synthetic_viewer
