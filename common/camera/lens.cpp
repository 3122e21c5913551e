#include "common/camera/lens.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace phantom::camera {
namespace {

constexpr double kWidestRadius = 10.0;  // |n| of 84° off the line of sight
constexpr double kRadiusStep = 1e-3;
constexpr int kMaxNewtonSteps = 60;

/// Returns the radius at which the distorted radius stops to grow.
double folding_radius(const Lens& lens) {
  for (double r = 0.0; r < kWidestRadius; r += kRadiusStep) {
    const double r2 = r * r;
    if (1 + r2 * (3 * lens.k1 + r2 * (5 * lens.k2 + r2 * 7 * lens.k3)) <= 0.0) return r;
  }
  return kWidestRadius;
}

}  // namespace

LensModel::LensModel(const Lens& lens) : lens_(lens), largest_radius_(folding_radius(lens)) {}

Eigen::Vector2d LensModel::distorted(const Eigen::Vector2d& n) const noexcept {
  const double x = n.x(), y = n.y(), r2 = n.squaredNorm();
  const double radial = 1 + r2 * (lens_.k1 + r2 * (lens_.k2 + r2 * lens_.k3));
  return {x * radial + 2 * lens_.p1 * x * y + lens_.p2 * (r2 + 2 * x * x),
          y * radial + lens_.p1 * (r2 + 2 * y * y) + 2 * lens_.p2 * x * y};
}

/// Returns ∂ distorted / ∂ n.
Eigen::Matrix2d LensModel::distorted_by(const Eigen::Vector2d& n) const noexcept {
  const double x = n.x(), y = n.y(), r2 = n.squaredNorm();
  const double radial = 1 + r2 * (lens_.k1 + r2 * (lens_.k2 + r2 * lens_.k3));
  const double slope = 2 * (lens_.k1 + r2 * (2 * lens_.k2 + r2 * 3 * lens_.k3));  // of radial, by r²/2
  Eigen::Matrix2d by;
  by(0, 0) = radial + slope * x * x + 2 * lens_.p1 * y + 6 * lens_.p2 * x;
  by(0, 1) = slope * x * y + 2 * lens_.p1 * x + 2 * lens_.p2 * y;
  by(1, 0) = by(0, 1);
  by(1, 1) = radial + slope * y * y + 6 * lens_.p1 * y + 2 * lens_.p2 * x;
  return by;
}

std::optional<Eigen::Vector2d> LensModel::project(const Eigen::Vector3d& p_C_m) const noexcept {
  if (!(p_C_m.z() > 1e-9)) return std::nullopt;
  const Eigen::Vector2d n = p_C_m.head<2>() / p_C_m.z();
  if (!(n.norm() < largest_radius_)) return std::nullopt;
  const Eigen::Vector2d d = distorted(n);
  return Eigen::Vector2d(lens_.fx_px * d.x() + lens_.cx_px, lens_.fy_px * d.y() + lens_.cy_px);
}

Eigen::Matrix<double, 2, 3> LensModel::jacobian(const Eigen::Vector3d& p_C_m) const noexcept {
  const double z = p_C_m.z();
  const Eigen::Vector2d n = p_C_m.head<2>() / z;
  Eigen::Matrix<double, 2, 3> n_by_p;
  n_by_p << 1 / z, 0, -n.x() / z, 0, 1 / z, -n.y() / z;
  return Eigen::Vector2d(lens_.fx_px, lens_.fy_px).asDiagonal() * distorted_by(n) * n_by_p;
}

std::optional<Eigen::Vector2d> LensModel::direction(const Eigen::Vector2d& pixel) const noexcept {
  const Eigen::Vector2d wanted((pixel.x() - lens_.cx_px) / lens_.fx_px,
                               (pixel.y() - lens_.cy_px) / lens_.fy_px);
  if (!wanted.allFinite()) return std::nullopt;
  Eigen::Vector2d n = Eigen::Vector2d::Zero();
  for (int step = 0; step < kMaxNewtonSteps; ++step) {
    const Eigen::Vector2d off = wanted - distorted(n);
    if (off.norm() < 1e-13) break;
    const Eigen::Matrix2d by = distorted_by(n);
    if (!(std::abs(by.determinant()) > 1e-12)) return std::nullopt;
    Eigen::Vector2d move = by.inverse() * off;
    if (const double length = move.norm(); length > 0.3) move *= 0.3 / length;  // does not jump over the fold
    n += move;
    if (!(n.norm() < largest_radius_)) return std::nullopt;
  }
  if (!((wanted - distorted(n)).norm() < 1e-9)) return std::nullopt;
  return n;
}

namespace {

std::array<Eigen::Vector2d, 4> border_middles(const Lens& lens) {
  const double right = lens.width_px - 0.5, low = lens.height_px - 0.5;
  return {Eigen::Vector2d(-0.5, (low - 0.5) / 2), Eigen::Vector2d(right, (low - 0.5) / 2),
          Eigen::Vector2d((right - 0.5) / 2, -0.5), Eigen::Vector2d((right - 0.5) / 2, low)};
}

}  // namespace

std::string fault_of(const Lens& lens) {
  if (lens.width_px < 1 || lens.height_px < 1) return "its picture has no size";
  if (!(lens.fx_px > 0.0 && lens.fy_px > 0.0)) return "its focal lengths must be positive";
  if (!(lens.cx_px >= 0.0 && lens.cx_px < lens.width_px && lens.cy_px >= 0.0 && lens.cy_px < lens.height_px))
    return "its principal point lies outside of the picture";
  const LensModel model(lens);
  for (const Eigen::Vector2d& middle : border_middles(lens))
    if (!model.direction(middle))
      return "its distortion folds back within the picture: some pixels of the border would see nothing";
  return {};
}

Lens straightened(const LensModel& lens, int width_px, int height_px) {
  double tan_x = 1e-3, tan_y = 1e-3;
  for (const Eigen::Vector2d& middle : border_middles(lens.lens())) {
    const auto n = lens.direction(middle);
    if (!n) continue;
    tan_x = std::max(tan_x, std::abs(n->x()));
    tan_y = std::max(tan_y, std::abs(n->y()));
  }
  Lens straight;
  straight.width_px = width_px;
  straight.height_px = height_px;
  straight.fx_px = straight.fy_px = std::min(width_px / (2 * tan_x), height_px / (2 * tan_y));
  straight.cx_px = (width_px - 1) / 2.0;
  straight.cy_px = (height_px - 1) / 2.0;
  return straight;
}

}  // namespace phantom::camera
