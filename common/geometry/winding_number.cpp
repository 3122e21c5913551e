#include "common/geometry/winding_number.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace phantom::geometry {
namespace {

constexpr std::uint32_t kLeafTriangles = 8;
constexpr double kFar = 3.0;          // in radii of a group; Barill et al. use 2 with one more moment
constexpr double kTriangleFar = 4.0;  // in radii of a single triangle

/// Solid angle ÷ 2 of a triangle, corners relative to the eye (van Oosterom and Strackee 1983).
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
  triangles_.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
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
  nodes_.reserve(mesh.triangles.size() / 2 + 1);
  if (!triangles_.empty()) build(0, static_cast<std::uint32_t>(triangles_.size()));
}

std::uint32_t WindingTree::build(std::uint32_t first, std::uint32_t count) {
  const auto name = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  node.first = first;
  node.count = count;
  node.centre = node.normal = Eigen::Vector3d::Zero();
  node.moment = Eigen::Matrix3d::Zero();
  Eigen::Vector3d low = Eigen::Vector3d::Constant(INFINITY), high = -low, mean = Eigen::Vector3d::Zero();
  double area = 0.0;
  for (std::uint32_t i = first; i < first + count; ++i) {
    const Eigen::Vector3d &m = triangles_[i].centre, &n = triangles_[i].area_normal;
    low = low.cwiseMin(m);
    high = high.cwiseMax(m);
    mean += m / count;
    area += n.norm();
    node.centre += n.norm() * m;
    node.normal += n;
  }
  node.centre = area > 0.0 ? Eigen::Vector3d(node.centre / area) : mean;
  for (std::uint32_t i = first; i < first + count; ++i) {
    const Corners& t = triangles_[i];
    node.moment += (t.centre - node.centre) * t.area_normal.transpose();
    for (const Eigen::Vector3d& corner : {t.a, t.b, t.c})
      node.radius = std::max(node.radius, (corner - node.centre).norm());
  }
  if (count > kLeafTriangles) {
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const auto begin = triangles_.begin() + first;
    std::nth_element(begin, begin + count / 2, begin + count,
                     [&](const Corners& s, const Corners& t) { return s.centre[axis] < t.centre[axis]; });
    build(first, count / 2);
    node.right = build(first + count / 2, count - count / 2);
  }
  nodes_[name] = node;
  return name;
}

double WindingTree::at(const Eigen::Vector3d& p_m) const {
  double half_angles = 0.0;
  std::uint32_t waiting[64];  // the tree is balanced: depth ≤ 32
  int depth = 0;
  if (!nodes_.empty()) waiting[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t name = waiting[--depth];
    const Node& node = nodes_[name];
    const Eigen::Vector3d d = node.centre - p_m;
    const double square = d.squaredNorm();
    if (square > kFar * kFar * node.radius * node.radius) {
      const double per_cube = 1.0 / (square * std::sqrt(square));
      half_angles +=
          0.5 * per_cube * (node.normal.dot(d) + node.moment.trace() - 3.0 * d.dot(node.moment * d) / square);
    } else if (node.right != 0) {
      waiting[depth++] = node.right;
      waiting[depth++] = name + 1;
    } else {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const Corners& t = triangles_[i];
        const Eigen::Vector3d to = t.centre - p_m;
        const double distance_2 = to.squaredNorm();
        half_angles += distance_2 > kTriangleFar * kTriangleFar * t.radius_2
                           ? 0.5 * t.area_normal.dot(to) / (distance_2 * std::sqrt(distance_2))
                           : half_solid_angle(t.a - p_m, t.b - p_m, t.c - p_m);
      }
    }
  }
  return half_angles * kToWindings;
}

}  // namespace phantom::geometry
