#include "components/synthetic_viewer/render/ray_scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/geometry/point_triangle.hpp"
#include "common/geometry/ray_triangle.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr double kSameCrossing_m = 1e-6;

std::optional<double> hit_triangle(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                   const Eigen::Vector3f* corners) noexcept {
  return geometry::ray_meets_triangle(origin, direction, corners[0].cast<double>(), corners[1].cast<double>(),
                                      corners[2].cast<double>());
}

struct Span {
  double from_m, to_m;
  RayScene::BodyName name;
};

/// Adds the intervals of a ray that lie within a body, from entry to exit. An exit without an entry starts at
/// the beginning of the ray; an entry without an exit runs to its end.
void add_spans(std::vector<RayMesh::Crossing>& crossings, double end_m, RayScene::BodyName name,
               std::vector<Span>& spans) {
  std::sort(crossings.begin(), crossings.end(),
            [](const auto& a, const auto& b) { return a.distance_m < b.distance_m; });
  // A ray through an edge crosses both triangles there.
  const auto same = [](const auto& a, const auto& b) {
    return a.entering == b.entering && b.distance_m - a.distance_m < kSameCrossing_m;
  };
  crossings.erase(std::unique(crossings.begin(), crossings.end(), same), crossings.end());
  int depth = 0;
  double entered_m = 0.0;
  for (const RayMesh::Crossing& crossing : crossings) {
    if (crossing.entering) {
      if (depth++ == 0) entered_m = crossing.distance_m;
    } else {
      if (depth == 0) entered_m = 0.0;
      depth = std::max(0, depth - 1);
      if (depth == 0) spans.push_back({entered_m, crossing.distance_m, name});
    }
  }
  if (depth > 0) spans.push_back({entered_m, end_m, name});
}

}  // namespace

RayMesh::RayMesh(const geometry::TriangleMesh& mesh) : tree_(geometry::triangle_boxes(mesh)) {
  corners_m_.reserve(3 * mesh.triangles.size());
  for (const std::uint32_t triangle : tree_.items())
    for (const std::uint32_t vertex : mesh.triangles[triangle]) corners_m_.push_back(mesh.vertices_m[vertex]);
}

std::optional<double> RayMesh::nearest(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                       double min_m, double max_m) const noexcept {
  std::optional<double> best;
  tree_.along_ray(origin_m, direction, min_m, max_m, [&](std::uint32_t place) {
    const Eigen::Vector3f* corners = &corners_m_[3 * std::size_t{place}];
    const auto distance = hit_triangle(origin_m, direction, corners);
    if (!distance || *distance <= min_m || *distance >= max_m) return;
    best = distance;
    max_m = *distance;
  });
  return best;
}

std::optional<Eigen::Vector3d> RayMesh::closest(const Eigen::Vector3d& p_m, double within_m) const noexcept {
  std::optional<Eigen::Vector3d> best;
  double square = within_m * within_m;
  tree_.near(p_m, square, [&](std::uint32_t place) {
    const Eigen::Vector3f* corners = &corners_m_[3 * std::size_t{place}];
    const Eigen::Vector3d point_m = geometry::closest_point_on_triangle(
        p_m, Eigen::Vector3d(corners[0].cast<double>()), Eigen::Vector3d(corners[1].cast<double>()),
        Eigen::Vector3d(corners[2].cast<double>()));
    if (const double here = (point_m - p_m).squaredNorm(); here < square) {
      square = here;
      best = point_m;
    }
  });
  return best;
}

Eigen::Vector3d RayMesh::size_m() const noexcept {
  if (tree_.nodes().empty()) return Eigen::Vector3d::Zero();
  return (tree_.nodes().front().max - tree_.nodes().front().min).matrix().cast<double>();
}

std::vector<Eigen::Vector3d> RayMesh::corners(std::size_t most) const {
  std::vector<Eigen::Vector3d> found;
  const std::size_t step = (corners_m_.size() + most - 1) / most;
  for (std::size_t i = 0; i < corners_m_.size(); i += step) found.push_back(corners_m_[i].cast<double>());
  return found;
}

void RayMesh::crossings(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction, double min_m,
                        double max_m, std::vector<Crossing>& found) const {
  tree_.along_ray(origin_m, direction, min_m, max_m, [&](std::uint32_t place) {
    const Eigen::Vector3f* corners = &corners_m_[3 * std::size_t{place}];
    const auto distance = hit_triangle(origin_m, direction, corners);
    if (!distance || *distance <= min_m || *distance >= max_m) return;
    const Eigen::Vector3f normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    found.push_back({*distance, normal.cast<double>().dot(direction) < 0});
  });
}

std::optional<double> RayScene::nearest(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                        double min_m, double max_m) const noexcept {
  std::optional<double> best;
  for (const Body& body : bodies) {
    const geometry::Pose X_MW = body.X_WM.inverse();
    const auto distance = body.mesh->nearest(X_MW * origin_m, X_MW.rotation * direction, min_m, max_m);
    if (distance) {
      best = distance;
      max_m = *distance;
    }
  }
  return best;
}

std::optional<double> RayScene::to_zone(std::uint16_t object, const Eigen::Vector3d& origin_m,
                                        const Eigen::Vector3d& direction, double max_m) const {
  std::optional<double> best_m;
  std::vector<RayMesh::Crossing> crossings;
  for (const Body& zone : zones) {
    if (zone.name.object != object) continue;
    const geometry::Pose X_MW = zone.X_WM.inverse();
    const Eigen::Vector3d from_m = X_MW * origin_m, along = X_MW.rotation * direction;
    crossings.clear();
    zone.mesh->crossings(from_m, along, 0.0, zone.mesh->size_m().norm() + max_m, crossings);
    const auto first = std::ranges::min_element(crossings, {}, &RayMesh::Crossing::distance_m);
    if (first == crossings.end()) continue;
    const double distance_m = first->entering ? first->distance_m : 0.0;
    if (distance_m < max_m) best_m = std::min(best_m.value_or(max_m), distance_m);
  }
  return best_m;
}

std::optional<RayScene::FreeDistance> RayScene::free_distance(const Eigen::Vector3d& origin_m,
                                                              const Eigen::Vector3d& direction,
                                                              double wanted_m, double clearance_m) const {
  const double end_m = 3 * wanted_m;
  std::vector<Span> spans;
  std::vector<RayMesh::Crossing> crossings;
  for (const Body& body : bodies) {
    const geometry::Pose X_MW = body.X_WM.inverse();
    crossings.clear();
    body.mesh->crossings(X_MW * origin_m, X_MW.rotation * direction, clearance_m, end_m + clearance_m,
                         crossings);
    add_spans(crossings, end_m + clearance_m, body.name, spans);
  }
  const auto blocking = [&](double at_m) {
    return std::find_if(spans.begin(), spans.end(), [&](const Span& span) {
      return at_m > span.from_m - clearance_m && at_m < span.to_m + clearance_m;
    });
  };
  const auto blocked = blocking(wanted_m);
  if (blocked == spans.end()) return std::nullopt;
  std::optional<double> best_m;
  for (const Span& span : spans) {
    for (const double at_m : {span.from_m - clearance_m, span.to_m + clearance_m}) {
      if (at_m < 2 * clearance_m || at_m > end_m || blocking(at_m) != spans.end()) continue;
      if (!best_m || std::abs(at_m - wanted_m) < std::abs(*best_m - wanted_m)) best_m = at_m;
    }
  }
  if (!best_m) return std::nullopt;
  return FreeDistance{*best_m, blocked->name};
}

double RayScene::visible_share(const Eigen::Vector3d& look_at_m, const Eigen::Vector3d& pgv, double radius_m,
                               const Eigen::Vector3d& eye_m) const noexcept {
  const double length = pgv.norm();
  const Eigen::Vector3d normal = length > 0 ? Eigen::Vector3d(pgv / length) : Eigen::Vector3d::Zero();
  const Eigen::Vector3d u = normal.isZero() ? Eigen::Vector3d::UnitX().eval() : normal.unitOrthogonal();
  const Eigen::Vector3d v = normal.isZero() ? Eigen::Vector3d::UnitY().eval() : normal.cross(u).eval();
  const Eigen::Vector3d middle = look_at_m + 0.5 * radius_m * normal;
  const std::array<Eigen::Vector3d, 5> points{middle, middle + radius_m * u, middle - radius_m * u,
                                              middle + radius_m * v, middle - radius_m * v};
  int seen = 0;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d ray = eye_m - point;
    const double distance_m = ray.norm();
    if (distance_m <= radius_m || !nearest(point, ray / distance_m, radius_m, distance_m)) ++seen;
  }
  return seen / static_cast<double>(points.size());
}

}  // namespace phantom::synthetic_viewer
