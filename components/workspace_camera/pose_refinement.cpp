#include "components/workspace_camera/pose_refinement.hpp"

#include <algorithm>
#include <cmath>

#include "components/workspace_camera/depth_raster.hpp"

namespace phantom::workspace_camera {
namespace {

constexpr double kFirstStep_m = 0.02, kLastStep_m = 0.0006;
// A pose is better than another one, or told apart from it, by so many pixels, or by this share of them.
constexpr double kBetter_px = 0.5, kBetterShare = 0.002, kApart_px = 8.0, kApartShare = 0.03;

}  // namespace

PoseRefinement::PoseRefinement(const fusion::PinholeCamera& camera, const geometry::Pose& X_WC,
                               const Evidence& evidence, const geometry::TriangleMesh& mesh_O,
                               const Eigen::Vector3d& centre_O_m, double radius_m)
    : camera_(camera),
      X_CW_(X_WC.inverse()),
      evidence_(evidence),
      mesh_O_(mesh_O),
      centre_O_m_(centre_O_m),
      radius_m_(std::max(radius_m, 0.01)),
      drawn_m_(camera.pixels(), 0.0F) {}

double PoseRefinement::score(const geometry::Pose& X_WO) {
  covered_.clear();
  draw_mesh(mesh_O_, X_CW_ * X_WO, camera_, corners_m_, [this](std::size_t pixel, double depth_m, double) {
    float& drawn_m = drawn_m_[pixel];
    if (drawn_m == 0.0F) covered_.push_back(pixel);
    if (drawn_m == 0.0F || depth_m < static_cast<double>(drawn_m)) drawn_m = static_cast<float>(depth_m);
  });
  double score = 0.0;
  for (const std::size_t pixel : covered_) {
    const double behind_m = static_cast<double>(evidence_.seen_m[pixel] - drawn_m_[pixel]),
                 tolerance_m = static_cast<double>(evidence_.tolerance_m[pixel]);
    drawn_m_[pixel] = 0.0F;
    if (evidence_.seen_m[pixel] == 0.0F || behind_m < -tolerance_m) continue;
    if (behind_m > tolerance_m) {
      score -= 1.0;
    } else if (evidence_.explained[pixel] == 0) {
      score += 1.0 - behind_m * behind_m / (tolerance_m * tolerance_m);
    }
  }
  return score;
}

geometry::Pose PoseRefinement::moved(const geometry::Pose& X_WO, const Vector6& motion) const {
  const Eigen::Vector3d centre_W_m = X_WO * centre_O_m_;
  const Eigen::Matrix3d R = geometry::rotation_from_vector(motion.head<3>());
  return {R * X_WO.rotation, centre_W_m + R * (X_WO.translation_m - centre_W_m) + motion.tail<3>()};
}

geometry::Pose PoseRefinement::best_near(const geometry::Pose& X_WO) {
  Vector6 best = Vector6::Zero(), before = best;
  double best_score = score(X_WO);
  const auto try_out = [&](const Vector6& motion) {
    const double found = score(moved(X_WO, motion));
    if (found <= best_score + std::max(kBetter_px, kBetterShare * best_score)) return false;
    best = motion;
    best_score = found;
    return true;
  };
  for (double step_m = kFirstStep_m; step_m >= kLastStep_m; step_m *= 0.5) {
    bool better = true;
    while (better) {
      better = false;
      for (int axis = 5; axis >= 0; --axis) {
        Vector6 step = Vector6::Zero();
        step[axis] = axis < 3 ? step_m / radius_m_ : step_m;
        better = try_out(best + step) || try_out(best - step) || better;
      }
      if (better) try_out(2.0 * best - before);
      before = best;
    }
  }
  return moved(X_WO, best);
}

bool PoseRefinement::tells_apart(const geometry::Pose& X_WO, const Vector6& motion) {
  const double here = score(X_WO), there = std::max(score(moved(X_WO, motion)), score(moved(X_WO, -motion)));
  return there < here - std::max(kApart_px, kApartShare * here);
}

}  // namespace phantom::workspace_camera
