#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "common/camera/board.hpp"
#include "common/camera/lens.hpp"

namespace phantom::camera::test {

/// A wide lens with a barrel distortion that moves the corners by tens of pixels.
inline Lens wide_lens() {
  return {640, 480, 520.0, 515.0, 331.0, 236.0, -0.28, 0.09, 0.0012, -0.0008, -0.01};
}

/// Distorts and projects, written out from the definition.
inline Eigen::Vector2d project_by_hand(const Lens& l, const Eigen::Vector3d& p) {
  const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
  const double radial = 1 + l.k1 * r2 + l.k2 * r2 * r2 + l.k3 * std::pow(r2, 3);
  const double dx = x * radial + 2 * l.p1 * x * y + l.p2 * (r2 + 2 * x * x);
  const double dy = y * radial + l.p1 * (r2 + 2 * y * y) + 2 * l.p2 * x * y;
  return {l.fx_px * dx + l.cx_px, l.fy_px * dy + l.cy_px};
}

/// Returns a pose at `eye` that looks at `target`: z of C towards it, y of C downwards in W.
inline geometry::Pose looking(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
                              double roll_rad = 0.0) {
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  geometry::Pose pose;
  pose.rotation << x, z.cross(x), z;
  pose.rotation = pose.rotation * Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation_m = eye;
  return pose;
}

/// Renders pictures of checkerboards: each pixel is the mean of what its subpixels see, with noise.
class BoardRenderer {
 public:
  explicit BoardRenderer(const Lens& lens) : lens_(lens) {
    const LensModel model(lens);
    for (int v = 0; v < lens.height_px; ++v)
      for (int u = 0; u < lens.width_px; ++u)
        for (int s = 0; s < kSamples * kSamples; ++s) {
          const double du = (s % kSamples + 0.5) / kSamples - 0.5, dv = (s / kSamples + 0.5) / kSamples - 0.5;
          const auto n = model.direction({u + du, v + dv});
          directions_.push_back(n ? n->cast<float>() : Eigen::Vector2f(1e3F, 1e3F));
        }
  }
  std::vector<std::uint8_t> render(const Board& board, const geometry::Pose& X_CB, double noise,
                                   unsigned seed) const {
    std::mt19937 random(seed);
    std::normal_distribution<double> error(0.0, noise);
    std::vector<std::uint8_t> grey;
    const geometry::Pose X_BC = X_CB.inverse();
    for (std::size_t pixel = 0; pixel < directions_.size() / (kSamples * kSamples); ++pixel) {
      double sum = 0;
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const Eigen::Vector2f& n = directions_[pixel * kSamples * kSamples + static_cast<std::size_t>(s)];
        const Eigen::Vector3d ray = X_BC.rotation * Eigen::Vector3d(n.x(), n.y(), 1.0);
        const Eigen::Vector3d at = X_BC.translation_m - X_BC.translation_m.z() / ray.z() * ray;
        sum += grey_of(board, at.x() / board.square_m, at.y() / board.square_m);
      }
      const double value = sum / (kSamples * kSamples) + error(random);
      grey.push_back(static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0)));
    }
    return grey;
  }

 private:
  static constexpr int kSamples = 3;
  static double grey_of(const Board& board, double x, double y) {
    const bool squares = x > -1 && y > -1 && x < board.columns && y < board.rows;
    const bool paper = x > -2 && y > -2 && x < board.columns + 1 && y < board.rows + 1;
    if (!squares) return paper ? 225.0 : 110.0;
    const long parity = std::lround(std::floor(x)) + std::lround(std::floor(y));
    return parity % 2 == 0 ? 30.0 : 225.0;
  }
  Lens lens_;
  std::vector<Eigen::Vector2f> directions_;
};

/// A pose of the board before the camera, at about `distance_m`, tilted about its own axes.
inline geometry::Pose board_before(const Board& board, double distance_m, double tilt_x, double tilt_y,
                                   double turn, const Eigen::Vector2d& aside_m = {0, 0}) {
  const Eigen::Vector3d middle(board.square_m * (board.columns - 1) / 2,
                               board.square_m * (board.rows - 1) / 2, 0);
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(tilt_x, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(tilt_y, Eigen::Vector3d::UnitY()))
                                       .toRotationMatrix();
  return {rotation, Eigen::Vector3d(aside_m.x(), aside_m.y(), distance_m) - rotation * middle};
}

}  // namespace phantom::camera::test
