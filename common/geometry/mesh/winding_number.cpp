#include "common/geometry/mesh/winding_number.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace phantom::geometry {
namespace {

constexpr std::uint32_t kLeafTriangles = 8;
constexpr double kFar = 3.0;          // in radii of a group; Barill et al. use 2 with one more moment
constexpr double kTriangleFar = 4.0;  // in radii of a single triangle

/// Returns half the solid angle of a triangle, with corners relative to the eye (van Oosterom and Strackee
/// 1983).
double half_solid_angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double volume = a.dot(b.cross(c));
  const double base = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
  return volume == 0.0 ? 0.0 : std::atan2(volume, base);
}

constexpr double kToWindings = 1.0 / (2.0 * std::numbers::pi);

}  // namespace

double winding_number(const TriangleMesh& mesh, const Eigen::Vector3d& p_m) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles) {
    sum += half_solid_angle(mesh.vertices_m[t[0]].cast<double>() - p_m,
                            mesh.vertices_m[t[1]].cast<double>() - p_m,
                            mesh.vertices_m[t[2]].cast<double>() - p_m);
  }
  return sum * kToWindings;
}

WindingTree::WindingTree(const TriangleMesh& mesh) {
  tree_ = BoxTree(triangle_boxes(mesh), kLeafTriangles);
  triangles_.reserve(mesh.triangles.size());
  for (const std::uint32_t item : tree_.items()) {
    const auto& t = mesh.triangles[item];
    Corners corners{mesh.vertices_m[t[0]].cast<double>(),
                    mesh.vertices_m[t[1]].cast<double>(),
                    mesh.vertices_m[t[2]].cast<double>(),
                    {},
                    {},
                    0.0};
    corners.centre = (corners.a + corners.b + corners.c) / 3.0;
    corners.area_normal = 0.5 * (corners.b - corners.a).cross(corners.c - corners.a);
    for (const Eigen::Vector3d& corner : {corners.a, corners.b, corners.c})
      corners.radius_2 = std::max(corners.radius_2, (corner - corners.centre).squaredNorm());
    triangles_.push_back(corners);
  }
  struct Range {
    std::uint32_t first, count;
  };
  const auto& nodes = tree_.nodes();
  std::vector<Range> below(nodes.size());
  groups_.resize(nodes.size());
  for (std::size_t i = nodes.size(); i-- > 0;) {  // children first
    const BoxTree::Node& node = nodes[i];
    below[i] = node.count > 0 ? Range{node.first, node.count}
                              : Range{below[i + 1].first, below[i + 1].count + below[node.first].count};
    groups_[i] = group_of(below[i].first, below[i].count);
  }
}

WindingTree::Group WindingTree::group_of(std::uint32_t first, std::uint32_t count) const {
  Group group{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double area = 0.0;
  for (std::uint32_t i = first; i < first + count; ++i) {
    const Eigen::Vector3d &m = triangles_[i].centre, &n = triangles_[i].area_normal;
    mean += m / count;
    area += n.norm();
    group.centre += n.norm() * m;
    group.normal += n;
  }
  group.centre = area > 0.0 ? Eigen::Vector3d(group.centre / area) : mean;
  for (std::uint32_t i = first; i < first + count; ++i) {
    const Corners& t = triangles_[i];
    group.moment += (t.centre - group.centre) * t.area_normal.transpose();
    for (const Eigen::Vector3d& corner : {t.a, t.b, t.c})
      group.radius = std::max(group.radius, (corner - group.centre).norm());
  }
  return group;
}

double WindingTree::at(const Eigen::Vector3d& p_m, std::uint64_t* steps) const {
  double half_angles = 0.0;
  std::uint64_t work = 0;
  const auto is_near = [&](std::uint32_t node) {
    work += kGroupSteps;
    const Group& group = groups_[node];
    const Eigen::Vector3d d = group.centre - p_m;
    const double square = d.squaredNorm();
    if (square <= kFar * kFar * group.radius * group.radius) return true;
    const double per_cube = 1.0 / (square * std::sqrt(square));
    half_angles += 0.5 * per_cube *
                   (group.normal.dot(d) + group.moment.trace() - 3.0 * d.dot(group.moment * d) / square);
    return false;
  };
  tree_.walk(is_near, [&](std::uint32_t place) {
    work += kTriangleSteps;
    const Corners& t = triangles_[place];
    const Eigen::Vector3d to = t.centre - p_m;
    const double distance_2 = to.squaredNorm();
    half_angles += distance_2 > kTriangleFar * kTriangleFar * t.radius_2
                       ? 0.5 * t.area_normal.dot(to) / (distance_2 * std::sqrt(distance_2))
                       : half_solid_angle(t.a - p_m, t.b - p_m, t.c - p_m);
  });
  if (steps != nullptr) *steps = work;
  return half_angles * kToWindings;
}

}  // namespace phantom::geometry
