#include "common/teleop/coupling/cartesian_map.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace phantom::teleop {
namespace {

/// Returns h(σ)/σ from σ².
double gain(double sigma_square, double singular_below) noexcept {
  const double sigma = std::sqrt(std::max(0.0, sigma_square));
  if (sigma >= 1.0) return 1.0 / sigma_square;
  return 1.0 / std::max(sigma, singular_below);
}

}  // namespace

CartesianMap cartesian_map(const CartesianMapParameters& parameters, const robot::Jacobian& jacobian,
                           const core::JointArray& weight) noexcept {
  Spatial root_inertia;
  root_inertia.head<3>().setConstant(std::sqrt(parameters.mass_kg));
  root_inertia.tail<3>().setConstant(parameters.orientation ? std::sqrt(parameters.inertia_kg_m2) : 0.0);
  core::JointArray mobility{};
  robot::Jacobian scaled = root_inertia.asDiagonal() * jacobian;
  for (std::size_t j = 0; j < parameters.joint_count; ++j) {
    mobility[j] = std::max(0.0, weight[j]) / parameters.inertia[j];
    scaled.col(static_cast<Eigen::Index>(j)) *= std::sqrt(mobility[j]);
  }
  CartesianMap map;
  using Square = Eigen::Matrix<double, 6, 6>;
  const Square gram = scaled * scaled.transpose();
  const Eigen::SelfAdjointEigenSolver<Square> eigen(gram);
  if (eigen.info() != Eigen::Success) return map;  // numbers that are none: nothing moves
  const Square& u = eigen.eigenvectors();
  Spatial gains;
  const Eigen::Index rows = parameters.orientation ? 6 : 3;
  for (Eigen::Index i = 0; i < 6; ++i) gains[i] = gain(eigen.eigenvalues()[i], parameters.singular_below);
  const Eigen::Index weakest = 6 - rows;  // eigenvalues rise; rows that are left out have the least
  map.least_followed = std::max(0.0, eigen.eigenvalues()[weakest]) * gains[weakest];
  const Square pull =
      root_inertia.asDiagonal() * (u * gains.asDiagonal() * u.transpose()) * root_inertia.asDiagonal();
  map.joints_per_twist.noalias() = jacobian.transpose() * pull;
  for (std::size_t j = 0; j < core::kMaxJoints; ++j)
    map.joints_per_twist.row(static_cast<Eigen::Index>(j)) *= mobility[j];
  return map;
}

}  // namespace phantom::teleop
