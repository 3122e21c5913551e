#include "components/workspace_camera/camera_alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "components/workspace_camera/depth_raster.hpp"

namespace phantom::workspace_camera {
namespace {

constexpr int kStep_px = 2, kIterations = 4, kCoarseWidth_px = 80;
constexpr double kModelError_m = 0.003;
constexpr double kLeastCosine = 0.25;  // of the incidence: a grazing pixel tells little of its depth
// Errors of neighbouring pixels are alike: this share of them is independent. A direction counts if its
// standard deviation is at most that: two successive ones 3.5 times as great are seen once in days.
constexpr double kIndependent = 1.0 / 8.0, kDetermined_m = 0.002;

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

geometry::Pose step_of(const Vector6& step) {
  const double angle = step.head<3>().norm();
  geometry::Pose X{Eigen::Matrix3d::Identity(), step.tail<3>()};
  if (angle > 0.0) X.rotation = Eigen::AngleAxisd(angle, step.head<3>() / angle).toRotationMatrix();
  return X;
}

/// Draws the model as a camera sees it: depths, 0 where there is nothing, and whose they are.
struct DrawnModel {
  std::vector<float> depth_m;
  std::vector<std::uint16_t> object;

  DrawnModel(const fusion::PinholeCamera& camera, const geometry::Pose& X_WC,
             std::span<const ModelObject> objects, std::span<const Place> X_WO)
      : depth_m(camera.pixels(), 0.0F), object(camera.pixels(), 0) {
    std::vector<Eigen::Vector3d> corners_m;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (!X_WO[i]) continue;
      draw_mesh(objects[i].mesh_O, X_WC.inverse() * *X_WO[i], camera, corners_m,
                [&](std::size_t pixel, double at_m, double) {
                  float& least_m = depth_m[pixel];
                  if (least_m != 0.0F && at_m >= static_cast<double>(least_m)) return;
                  least_m = static_cast<float>(at_m);
                  object[pixel] = static_cast<std::uint16_t>(i);
                });
    }
  }
};

}  // namespace

bool CameraAlignment::is_for(const fusion::PinholeCamera& camera, const geometry::Pose& X_WC) const {
  return !surface_.empty() && camera_ == camera && X_WC_.rotation == X_WC.rotation &&
         X_WC_.translation_m == X_WC.translation_m;
}

void CameraAlignment::set_model(const fusion::PinholeCamera& camera, const geometry::Pose& X_WC,
                                std::span<const ModelObject> objects, std::span<const Place> X_WO) {
  camera_ = camera;
  X_WC_ = X_WC;
  surface_.assign(camera.pixels(), {});
  const DrawnModel drawn(camera, X_WC, objects, X_WO);
  const std::vector<float>& depth_m = drawn.depth_m;
  objects_ = objects.size();
  const auto point = [&](int u, int v) -> Eigen::Vector3d {
    return static_cast<double>(depth_m[static_cast<std::size_t>(v * camera.width_px + u)]) *
           camera.direction(u, v);
  };
  for (int v = 1; v + 1 < camera.height_px; ++v) {
    for (int u = 1; u + 1 < camera.width_px; ++u) {
      const Eigen::Vector3d at = point(u, v), left = point(u - 1, v), right = point(u + 1, v),
                            up = point(u, v - 1), down = point(u, v + 1);
      if (std::min({at.z(), left.z(), right.z(), up.z(), down.z()}) <= 0.0) continue;
      // On one surface the pixel lies between its neighbours.
      if (std::abs(left.z() + right.z() - 2.0 * at.z()) > 0.01 * at.z() ||
          std::abs(up.z() + down.z() - 2.0 * at.z()) > 0.01 * at.z())
        continue;
      Eigen::Vector3d normal = (right - left).cross(down - up);
      const double length = normal.norm();
      if (length == 0.0) continue;
      normal /= length;
      if (std::abs(normal.dot(at)) < kLeastCosine * at.norm()) continue;
      const auto pixel = static_cast<std::size_t>(v * camera.width_px + u);
      surface_[pixel] = {at.cast<float>(), normal.cast<float>(), drawn.object[pixel]};
    }
  }
}

/// An object that is mostly seen through is not there: what lies near its place tells nothing of the camera.
std::vector<char> CameraAlignment::present(const fusion::DepthImage& image) const {
  std::vector<int> for_it(objects_, 0);
  for (int v = 0; v < camera_.height_px; v += kStep_px) {
    for (int u = 0; u < camera_.width_px; u += kStep_px) {
      const Surface& surface = surface_[static_cast<std::size_t>(v * camera_.width_px + u)];
      const auto seen_m = static_cast<double>(image.depth_m(u, v)),
                 model_m = static_cast<double>(surface.point_m.z());
      if (seen_m == 0.0 || model_m == 0.0 || seen_m < model_m - kGate_m) continue;
      for_it[surface.object] += seen_m <= model_m + kGate_m ? 1 : -1;
    }
  }
  std::vector<char> is_there(objects_, 0);
  for (std::size_t i = 0; i < objects_; ++i) is_there[i] = for_it[i] > 0 ? 1 : 0;
  return is_there;
}

std::optional<CameraOffset> CameraAlignment::offset(const fusion::DepthImage& image,
                                                    std::span<const float> arm_depth_m) const {
  const fusion::PinholeCamera& camera = image.camera();
  std::vector<Eigen::Vector3d> points_m;
  for (int v = 0; v < camera.height_px; v += kStep_px) {
    for (int u = 0; u < camera.width_px; u += kStep_px) {
      const auto seen_m = static_cast<double>(image.depth_m(u, v));
      if (seen_m == 0.0) continue;
      const auto pixel = static_cast<std::size_t>(v * camera.width_px + u);
      if (!arm_depth_m.empty() && arm_depth_m[pixel] > 0.0F &&
          seen_m > static_cast<double>(arm_depth_m[pixel]) - kArmMargin_m)
        continue;
      points_m.push_back(seen_m * camera.direction(u, v));
    }
  }
  const std::vector<char> is_there = present(image);
  CameraOffset offset;
  geometry::Pose X;  // of the camera where it is, in the camera as it is said to be
  Matrix6 H;
  for (int i = 0; i < kIterations; ++i) {
    H.setZero();
    Vector6 g = Vector6::Zero();
    offset.pixels = 0;
    double distance_m = 0.0;
    for (const Eigen::Vector3d& seen_m : points_m) {
      const Eigen::Vector3d q = X * seen_m;
      if (q.z() < kNearest_m) continue;
      const double u = std::round(camera.fx_px * q.x() / q.z() + camera.cx_px),
                   v = std::round(camera.fy_px * q.y() / q.z() + camera.cy_px);
      if (u < 0.0 || v < 0.0 || u >= camera.width_px || v >= camera.height_px) continue;
      const Surface& surface =
          surface_[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width_px) +
                   static_cast<std::size_t>(u)];
      if (surface.point_m.z() == 0.0F || is_there[surface.object] == 0) continue;
      const Eigen::Vector3d normal = surface.normal.cast<double>();
      const double error_m = normal.dot(q - surface.point_m.cast<double>());
      if (std::abs(error_m) >= kGate_m) continue;
      const double tukey = 1.0 - error_m * error_m / (kGate_m * kGate_m),
                   sigma_m = std::hypot(sigma_.at(seen_m.z()), kModelError_m);
      const double weight = tukey * tukey / (sigma_m * sigma_m);
      Vector6 row;
      row << q.cross(normal), normal;
      H += weight * row * row.transpose();
      g += weight * error_m * row;
      distance_m += q.norm();
      ++offset.pixels;
    }
    if (offset.pixels < kMinPixels) return std::nullopt;
    offset.distance_m = distance_m / static_cast<double>(offset.pixels);
    // What is not determined stays: a weak prior keeps the equations solvable.
    const Matrix6 prior = 1e-3 * H.diagonal().maxCoeff() * Matrix6::Identity();
    X = step_of(-(H + 1e-3 * prior).ldlt().solve(g)) * X;
  }
  const Eigen::AngleAxisd turn(X.rotation);
  offset.turn_rad = turn.angle() * turn.axis();
  offset.shift_m = X.translation_m;
  const double d = offset.distance_m;
  Vector6 scale;
  scale << 1.0 / d, 1.0 / d, 1.0 / d, 1.0, 1.0, 1.0;
  offset.information = kIndependent * (scale.asDiagonal() * H * scale.asDiagonal());
  return offset;
}

namespace {

/// Adds up the pixels of an image.
class ViewCount {
 public:
  ViewCount(const fusion::DepthImage& image, std::span<const float> arm_depth_m)
      : image_(image), arm_depth_m_(arm_depth_m) {}

  /// `model_m`: 0: the model has nothing there.
  void add(int u, int v, double model_m) {
    const fusion::PinholeCamera& camera = image_.camera();
    const auto pixel = static_cast<std::size_t>(v * camera.width_px + u);
    if (!arm_depth_m_.empty() && arm_depth_m_[pixel] > 0.0F) return;
    const auto seen_m = static_cast<double>(image_.depth_m(u, v));
    ++of_all_.expected;
    of_all_.hidden += seen_m == 0.0 ? 1 : 0;
    if (model_m < camera.min_depth_m || model_m > camera.max_depth_m) return;
    ++of_model_.expected;
    of_model_.hidden += seen_m < model_m - CameraAlignment::kGate_m ? 1 : 0;
  }
  CameraAlignment::View view() const {
    return of_model_.expected >= CameraAlignment::kMinPixels ? of_model_ : of_all_;
  }

 private:
  const fusion::DepthImage& image_;
  const std::span<const float> arm_depth_m_;
  CameraAlignment::View of_model_, of_all_;
};

/// A camera that sees the same in pixels `factor` times as large.
fusion::PinholeCamera coarse(fusion::PinholeCamera camera, int factor) {
  camera.width_px /= factor;
  camera.height_px /= factor;
  camera.fx_px /= factor;
  camera.fy_px /= factor;
  camera.cx_px = (camera.cx_px + 0.5) / factor - 0.5;
  camera.cy_px = (camera.cy_px + 0.5) / factor - 0.5;
  return camera;
}

}  // namespace

CameraAlignment::View CameraAlignment::view(const fusion::DepthImage& image,
                                            std::span<const float> arm_depth_m) const {
  const fusion::PinholeCamera& camera = image.camera();
  const bool drawn = is_for(camera, image.X_WC());
  ViewCount count(image, arm_depth_m);
  for (int v = 0; v < camera.height_px; v += kStep_px)
    for (int u = 0; u < camera.width_px; u += kStep_px)
      count.add(
          u, v,
          drawn ? static_cast<double>(surface_[static_cast<std::size_t>(v * camera.width_px + u)].point_m.z())
                : 0.0);
  return count.view();
}

CameraAlignment::View CameraAlignment::view_of_model(const fusion::DepthImage& image,
                                                     std::span<const float> arm_depth_m,
                                                     std::span<const ModelObject> objects,
                                                     std::span<const Place> X_WO) {
  const int factor = std::max(1, image.camera().width_px / kCoarseWidth_px);
  const fusion::PinholeCamera camera = coarse(image.camera(), factor);
  const DrawnModel drawn(camera, image.X_WC(), objects, X_WO);
  ViewCount count(image, arm_depth_m);
  for (int v = 0; v < camera.height_px; ++v)
    for (int u = 0; u < camera.width_px; ++u)
      count.add(factor * u + factor / 2, factor * v + factor / 2,
                static_cast<double>(drawn.depth_m[static_cast<std::size_t>(v * camera.width_px + u)]));
  return count.view();
}

void CoverWatch::put(const CameraAlignment::View& view) {
  if (view.expected < CameraAlignment::kMinPixels) return;
  const double hidden = static_cast<double>(view.hidden) / static_cast<double>(view.expected);
  const bool otherwise = covered_ ? hidden < kOpen : hidden > kCovered;
  against_ = otherwise ? against_ + 1 : 0;
  if (against_ < kConfirmations) return;
  covered_ = !covered_;
  against_ = 0;
}

/// Takes what is determined of a turn and a shift.
void KnockWatch::judge(const CameraOffset& offset, const Eigen::Vector3d& turn_rad,
                       const Eigen::Vector3d& shift_m) {
  Vector6 change;
  change << offset.distance_m * turn_rad, shift_m;
  const Eigen::SelfAdjointEigenSolver<Matrix6> directions(offset.information);
  Vector6 known = Vector6::Zero();
  for (int i = 0; i < 6; ++i) {
    const Vector6 direction = directions.eigenvectors().col(i);
    constexpr double kLeast = 1.0 / (kDetermined_m * kDetermined_m);
    if (directions.eigenvalues()[i] >= kLeast) known += direction.dot(change) * direction;
  }
  const Eigen::Vector3d known_rad = known.head<3>() / offset.distance_m;
  turn_rad_ = known_rad.norm();
  // Where the camera looks, at the distance of what it sees.
  shift_m_ = (known.tail<3>() + known_rad.cross(offset.distance_m * Eigen::Vector3d::UnitZ())).norm();
}

void KnockWatch::restart() {
  first_turn_rad_ = first_shift_m_ = Eigen::Vector3d::Zero();
  taken_ = beyond_ = within_ = 0;
  if (misplaced_) mounting_tested_ = false;
  misplaced_ = false;
}

void KnockWatch::put(const CameraOffset& offset) {
  if (taken_ < kFirst) {
    const double weight = 1.0 / ++taken_;
    first_turn_rad_ += weight * (offset.turn_rad - first_turn_rad_);
    first_shift_m_ += weight * (offset.shift_m - first_shift_m_);
    if (taken_ < kFirst) return;
    judge(offset, first_turn_rad_, first_shift_m_);
    if (!mounting_tested_) misplaced_ = shift_m_ > kMountingShift_m || turn_rad_ > kMountingTurn_rad;
    mounting_tested_ = true;
    return;
  }
  if (misplaced_) return;
  judge(offset, offset.turn_rad - first_turn_rad_, offset.shift_m - first_shift_m_);
  const bool beyond = shift_m_ > kShift_m || turn_rad_ > kTurn_rad;
  beyond_ = beyond ? beyond_ + 1 : 0;
  within_ = beyond ? 0 : within_ + 1;
  if (beyond_ >= kConfirmations) knocked_ = true;
  if (within_ >= 10 * kConfirmations) knocked_ = false;
}

}  // namespace phantom::workspace_camera
