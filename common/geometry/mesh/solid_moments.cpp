#include "common/geometry/mesh/solid_moments.hpp"

#include <Eigen/Geometry>

namespace phantom::geometry {
namespace {

/// Returns the inertia of 1 kg whose mean of x·xᵀ about its centre is `spread_m2`.
Eigen::Matrix3d inertia_of(const Eigen::Matrix3d& spread_m2) {
  return spread_m2.trace() * Eigen::Matrix3d::Identity() - spread_m2;
}

SolidMoments moments_of_box(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d size = box.isEmpty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(box.sizes());
  const Eigen::Matrix3d spread = (size.array().square() / 12.0).matrix().asDiagonal();
  return {size.prod(), box.isEmpty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(box.center()),
          inertia_of(spread)};
}

}  // namespace

SolidMoments solid_moments(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& vertex : mesh.vertices_m) box.extend(vertex.cast<double>());
  if (box.isEmpty()) return {};
  const Eigen::Vector3d origin = box.center();  // near, so that little is lost to rounding
  double six_volumes = 0.0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  const Eigen::Matrix3d canonical = (Eigen::Matrix3d::Ones() + Eigen::Matrix3d::Identity()) / 120.0;
  for (const auto& [i, j, k] : mesh.triangles) {
    Eigen::Matrix3d corners;
    corners << mesh.vertices_m[i].cast<double>() - origin, mesh.vertices_m[j].cast<double>() - origin,
        mesh.vertices_m[k].cast<double>() - origin;
    const double d = corners.col(0).dot(corners.col(1).cross(corners.col(2)));
    six_volumes += d;
    first += d / 24.0 * corners.rowwise().sum();
    second += d * corners * canonical * corners.transpose();
  }
  const double volume = six_volumes / 6.0;
  constexpr double kMinShare = 1e-3;  // of the box: an open sheet encloses less
  if (!(std::abs(volume) > kMinShare * box.volume())) return moments_of_box(box);
  const Eigen::Vector3d centre = first / volume;
  const Eigen::Matrix3d spread = second / volume - centre * centre.transpose();
  if (!box.contains(origin + centre) || !(spread.diagonal().minCoeff() > 0.0)) return moments_of_box(box);
  return {std::abs(volume), origin + centre, inertia_of(spread)};
}

}  // namespace phantom::geometry
