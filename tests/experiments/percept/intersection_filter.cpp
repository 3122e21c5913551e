#include "tests/experiments/percept/intersection_filter.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace phantom::experiments {
namespace {

// Spheres are taken a little larger, so that rounding never keeps a filter from letting through what the next
// would hit.
constexpr double kSlack = 1.0 + 1e-9;

}  // namespace

FilterQueries& FilterQueries::operator+=(const FilterQueries& other) noexcept {
  seso += other.seso;
  sess += other.sess;
  sdt += other.sdt;
  idp += other.idp;
  rt += other.rt;
  vit += other.vit;
  return *this;
}

std::uint64_t filter_load(const FilterQueries& queries, FilterForm form) noexcept {
  const FilterUnits units = filter_units(form);
  return queries.seso * units.seso + queries.sess * units.sess + queries.sdt * units.sdt +
         queries.idp * units.idp + queries.rt * units.rt + queries.vit * units.vit;
}

/// The smallest: around the longest edge if the corner across it lies within, else through all three corners.
IntersectionScene::Sphere IntersectionScene::sphere_around(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                                           const Eigen::Vector3d& c) {
  const std::array<std::array<Eigen::Vector3d, 3>, 3> edges{{{a, b, c}, {b, c, a}, {c, a, b}}};
  const auto& longest = *std::max_element(edges.begin(), edges.end(), [](const auto& e, const auto& f) {
    return (e[1] - e[0]).squaredNorm() < (f[1] - f[0]).squaredNorm();
  });
  const Eigen::Vector3d middle = 0.5 * (longest[0] + longest[1]);
  const double half = 0.5 * (longest[1] - longest[0]).norm();
  if ((longest[2] - middle).norm() <= half) return {middle, half * kSlack};
  const Eigen::Vector3d u = b - a, v = c - a, n = u.cross(v);
  const Eigen::Vector3d to_centre =
      (u.squaredNorm() * v.cross(n) + v.squaredNorm() * n.cross(u)) / (2.0 * n.squaredNorm());
  return {a + to_centre, to_centre.norm() * kSlack};
}

IntersectionScene::IntersectionScene(const std::vector<geometry::TriangleMesh>& objects_W,
                                     const FilterChain& chain)
    : chain_(chain) {
  for (const geometry::TriangleMesh& mesh : objects_W) {
    Object& object = objects_.emplace_back();
    const geometry::BoundingBox& box = object.box = mesh.bounding_box();
    object.sphere.centre_m = mesh.vertices_m.empty()
                                 ? Eigen::Vector3d::Zero()
                                 : Eigen::Vector3d(0.5 * (box.min_m + box.max_m).cast<double>());
    object.sphere.radius_m = 0.0;
    for (const auto& vertex : mesh.vertices_m) {
      object.sphere.radius_m =
          std::max(object.sphere.radius_m, (vertex.cast<double>() - object.sphere.centre_m).norm() * kSlack);
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto corner = [&](std::size_t k) -> Eigen::Vector3d {
        return mesh.vertices_m[mesh.triangles[i][k]].cast<double>();
      };
      const Eigen::Vector3d a = corner(0), b = corner(1), c = corner(2);
      const Eigen::Vector3d normal = (b - a).cross(c - a);
      if (!(normal.squaredNorm() > 0.0)) continue;
      object.triangles.push_back({sphere_around(a, b, c), a, b - a, c - a, normal, i});
    }
  }
}

bool IntersectionScene::in_reach(const Sphere& sphere, const Eigen::Vector3d& p, double length_m,
                                 FilterForm form) noexcept {
  const double reach_m = sphere.radius_m + length_m;
  if (form == FilterForm::kOptimised) return (sphere.centre_m - p).squaredNorm() <= reach_m * reach_m;
  return (sphere.centre_m - p).norm() <= reach_m;
}

bool IntersectionScene::in_scope(const Object& object, const Eigen::Vector3d& p, double length_m,
                                 FilterForm form) const noexcept {
  if (!chain_.bounds_by_box) return in_reach(object.sphere, p, length_m, form);
  const double grown_m = length_m * kSlack;
  return (p.array() >= object.box.min_m.cast<double>().array() - grown_m).all() &&
         (p.array() <= object.box.max_m.cast<double>().array() + grown_m).all();
}

bool IntersectionScene::faces(const Triangle& triangle, const Eigen::Vector3d& direction,
                              FilterForm form) const noexcept {
  const double dot = triangle.normal.dot(direction);
  if (!chain_.tests_facing) return dot != 0.0;
  if (form == FilterForm::kOptimised) return dot < 0.0;
  const double cosine = dot / (triangle.normal.norm() * direction.norm());
  return std::acos(std::clamp(cosine, -1.0, 1.0)) > 0.5 * std::numbers::pi;
}

bool IntersectionScene::holds(const Triangle& triangle, const Eigen::Vector3d& p) noexcept {
  // Barycentric coordinates of the point, by the areas that it spans with the edges.
  const Eigen::Vector3d ap = p - triangle.a_m;
  const double square = triangle.normal.squaredNorm();
  const double u = triangle.normal.dot(ap.cross(triangle.ac_m)) / square;
  const double v = triangle.normal.dot(triangle.ab_m.cross(ap)) / square;
  return u >= -1e-12 && v >= -1e-12 && u + v <= 1.0 + 1e-12;
}

std::optional<ProbeHit> IntersectionScene::probe(const Eigen::Vector3d& p_W_m,
                                                 const Eigen::Vector3d& direction, double length_m,
                                                 FilterForm form, FilterQueries& queries) const noexcept {
  std::optional<ProbeHit> nearest;
  for (std::size_t o = 0; o < objects_.size(); ++o) {
    ++queries.seso;
    if (!in_scope(objects_[o], p_W_m, length_m, form)) continue;
    for (const Triangle& triangle : objects_[o].triangles) {
      ++queries.sess;
      if (!in_reach(triangle.sphere, p_W_m, length_m, form)) continue;
      ++queries.sdt;
      if (!faces(triangle, direction, form)) continue;
      ++queries.idp;
      const double distance_m = triangle.normal.dot(triangle.a_m - p_W_m) / triangle.normal.dot(direction);
      if (!(distance_m >= 0.0)) continue;
      const auto in_range = [&] {
        ++queries.rt;
        return distance_m <= length_m;
      };
      const auto in_triangle = [&] {
        ++queries.vit;
        return holds(triangle, p_W_m + distance_m * direction);
      };
      if (chain_.triangle_first ? !(in_triangle() && in_range()) : !(in_range() && in_triangle())) continue;
      if (!nearest || distance_m < nearest->distance_m) nearest = ProbeHit{distance_m, o, triangle.index};
    }
  }
  return nearest;
}

std::vector<Eigen::Vector3d> front_hemisphere(const Eigen::Vector3d& axis, int count) {
  const Eigen::Vector3d across = axis.unitOrthogonal(), third = axis.cross(across);
  const double golden_rad = std::numbers::pi * (3.0 - std::sqrt(5.0));
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double along = (i + 0.5) / count, radius = std::sqrt(1.0 - along * along);
    directions.push_back(along * axis +
                         radius * (std::cos(i * golden_rad) * across + std::sin(i * golden_rad) * third));
  }
  return directions;
}

}  // namespace phantom::experiments
