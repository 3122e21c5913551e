#include "common/survey/touch_surface.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "common/geometry/point_triangle.hpp"

namespace phantom::survey {
namespace {

constexpr double kOnSurface_m = 1e-7;  // nearer than this the direction to the surface means nothing

}  // namespace

TouchSurface::TouchSurface(const geometry::TriangleMesh& mesh_O) : winding_(mesh_O) {
  const auto corner = [&](std::uint32_t triangle, std::size_t i) -> Eigen::Vector3d {
    return mesh_O.vertices_m[mesh_O.triangles[triangle][i]].cast<double>();
  };
  const double outwards = geometry::enclosed_volume_m3(mesh_O) < 0 ? -1.0 : 1.0;
  std::vector<geometry::BoundingBox> boxes;
  std::vector<Facet> facets;
  geometry::BoundingBox whole;
  for (std::uint32_t t = 0; t < mesh_O.triangles.size(); ++t) {
    const std::array<Eigen::Vector3d, 3> c{corner(t, 0), corner(t, 1), corner(t, 2)};
    const Eigen::Vector3d area = (c[1] - c[0]).cross(c[2] - c[0]);
    if (!(area.norm() > 0)) continue;
    facets.push_back({c, outwards * area.normalized()});
    boxes.emplace_back();
    for (const Eigen::Vector3d& p : c) {
      boxes.back().extend(p.cast<float>());
      whole.extend(p.cast<float>());
    }
  }
  tree_ = geometry::BoxTree(boxes);
  for (const std::uint32_t item : tree_.items()) facets_.push_back(facets[item]);
  centre_O_m_ = 0.5 * (whole.min_m + whole.max_m).cast<double>();
  for (int i = 0; i < 8; ++i) {
    const auto side = [&](int axis) { return (i >> axis & 1) != 0 ? whole.max_m[axis] : whole.min_m[axis]; };
    extremes_O_m_.emplace_back(side(0), side(1), side(2));
  }
}

TouchSurface::Place TouchSurface::nearest(const Eigen::Vector3d& p_O_m) const {
  double square = std::numeric_limits<double>::infinity();
  const Facet* best = nullptr;
  Place place;
  tree_.near(p_O_m, square, [&](std::uint32_t at) {
    const auto& c = facets_[at].corners_m;
    const Eigen::Vector3d q = geometry::closest_point_on_triangle(p_O_m, c[0], c[1], c[2]);
    const double to_it = (p_O_m - q).squaredNorm();
    if (best != nullptr && to_it >= square) return;
    square = to_it;
    best = &facets_[at];
    place.point_O_m = q;
  });
  const double away_m = std::sqrt(square);
  place.distance_m = std::abs(winding_.at(p_O_m)) > 0.5 ? -away_m : away_m;
  place.normal_O =
      away_m > kOnSurface_m ? Eigen::Vector3d((p_O_m - place.point_O_m) / place.distance_m) : best->normal;
  return place;
}

std::optional<TouchSurface::Place> TouchSurface::nearest_facing(const Eigen::Vector3d& p_O_m,
                                                                const Eigen::Vector3d& normal_O,
                                                                double least_cosine) const {
  double square = std::numeric_limits<double>::infinity();
  const Facet* best = nullptr;
  Place place;
  tree_.near(p_O_m, square, [&](std::uint32_t at) {
    if (facets_[at].normal.dot(normal_O) < least_cosine) return;
    const auto& c = facets_[at].corners_m;
    const Eigen::Vector3d q = geometry::closest_point_on_triangle(p_O_m, c[0], c[1], c[2]);
    const double to_it = (p_O_m - q).squaredNorm();
    if (best != nullptr && to_it >= square) return;
    square = to_it;
    best = &facets_[at];
    place.point_O_m = q;
  });
  if (best == nullptr) return std::nullopt;
  const Eigen::Vector3d off = p_O_m - place.point_O_m;
  const double away_m = std::sqrt(square);
  place.distance_m = off.dot(normal_O) < 0 ? -away_m : away_m;
  place.normal_O = away_m > kOnSurface_m ? Eigen::Vector3d(off / place.distance_m) : best->normal;
  return place;
}

}  // namespace phantom::survey
