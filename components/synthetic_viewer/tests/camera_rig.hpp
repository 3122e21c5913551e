#pragma once
// A cell with a simulated camera, without any topic: where the arm is at which time is filled in by hand.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "common/runtime/cell/cell_bodies.hpp"
#include "components/synthetic_viewer/render/tests/project.hpp"
#include "components/synthetic_viewer/samples/tests/mesh_chunks.hpp"
#include "components/synthetic_viewer/scene/simulated_camera.hpp"
#include "components/synthetic_viewer/tests/loop_rig.hpp"

namespace phantom::synthetic_viewer::test {

/// A camera of 640 × 480 px whose lens bends straight lines by tens of pixels, and which is a little rolled.
inline VideoCamera bent_camera() {
  VideoCamera camera;
  camera.name = "gate";
  camera.kind = VideoKind::kSimulated;
  camera.rate_hz = 20;
  camera.calibration.lens =
      camera::Lens{640, 480, 520.0, 515.0, 331.0, 236.0, -0.28, 0.09, 0.0012, -0.0008, -0.01};
  const Eigen::Vector3d eye(-0.35, -1.15, 1.75), z = (Eigen::Vector3d(0.7, 0.0, 1.15) - eye).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d(0.05, 0.1, 1.0)).normalized();
  geometry::Pose X_WC;
  X_WC.rotation << x, z.cross(x), z;
  X_WC.translation_m = eye;
  camera.calibration.X_WC = X_WC;
  camera.simulated = {.latency_s = 0.2, .noise = 1.5};
  return camera;
}

/// How far the edges in a picture are from drawn lines: for points on lines that are seen, the distance along
/// the line's normal to the nearest place where the picture's brightness clearly changes. Ascending, px.
inline std::vector<double> distances_to_edges(const Image& picture, const Image& seen_lines,
                                              const Camera& camera, const std::vector<Line>& lines) {
  constexpr double kReach_px = 30.0, kStep_px = 0.25, kClear = 10.0;
  cv::Mat grey, smooth;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(grey, CV_32F);
  cv::GaussianBlur(grey, smooth, {5, 5}, 0.8);
  const auto at = [&](const Eigen::Vector2d& p) {  // pixel centres at .5
    cv::Mat value;
    cv::getRectSubPix(smooth, {1, 1}, {static_cast<float>(p.x() - 0.5), static_cast<float>(p.y() - 0.5)},
                      value);
    return static_cast<double>(value.at<float>(0, 0));
  };
  std::vector<double> found;
  for (const Line& line : lines) {
    const auto a = project(camera, picture.cols, picture.rows, line.from_m.cast<double>());
    const auto b = project(camera, picture.cols, picture.rows, line.to_m.cast<double>());
    if (!a || !b || (*a - *b).norm() < 12) continue;
    const Eigen::Vector2d along = (*b - *a).normalized(), normal(-along.y(), along.x());
    for (double s = 6; s < (*b - *a).norm() - 6; s += 3) {
      const Eigen::Vector2d p = *a + s * along;
      if (p.x() < 40 || p.y() < 40 || p.x() > picture.cols - 40 || p.y() > picture.rows - 40) continue;
      const cv::Point pixel(static_cast<int>(p.x()), static_cast<int>(p.y()));
      if (seen_lines.at<cv::Vec3b>(pixel)[1] < 100) continue;
      std::vector<double> slopes;
      for (double d = -kReach_px; d <= kReach_px; d += kStep_px)
        slopes.push_back(std::abs(at(p + (d + 0.5) * normal) - at(p + (d - 0.5) * normal)));
      double nearest = 2 * kReach_px;
      for (std::size_t i = 1; i + 1 < slopes.size(); ++i)
        if (slopes[i] > kClear && slopes[i] >= slopes[i - 1] && slopes[i] >= slopes[i + 1])
          nearest = std::min(nearest, std::abs(static_cast<double>(i) * kStep_px - kReach_px));
      if (nearest <= kReach_px) found.push_back(nearest);
    }
  }
  std::ranges::sort(found);
  return found;
}
inline double share_within(const std::vector<double>& sorted, double limit) {
  return static_cast<double>(std::ranges::upper_bound(sorted, limit) - sorted.begin()) /
         std::max<double>(1.0, static_cast<double>(sorted.size()));
}

class CameraRig : public TwoPlates {
 protected:
  explicit CameraRig(const std::string& cell = "two_plates") : TwoPlates(cell) {
    config_.camera_view.camera = bent_camera();
    config_.camera_view.format = {960, 720, 1, false};
  }
  VideoCamera& camera() { return *config_.camera_view.camera; }
  /// Opens camera and drawing as configured.
  void open() {
    const runtime::ArmConfig& arm = cell_.arm(config_.arm);
    arm_ = std::make_unique<robot::SerialArm>(runtime::load_arm(arm));
    const auto meshes = load_arm_meshes(*arm_, runtime::load_skin(arm, *arm_));
    world_ = std::make_unique<SimulatedWorld>(
        SimulatedWorld{cell_, *arm_, meshes, load_other_arms(cell_, config_.arm, config_.other_arms)});
    for (const auto& other : config_.other_arms) state_.others.push_back({other.arm, {}});
    drawing_ = std::make_unique<Drawing>(config_, cell_, *arm_, meshes, state_);
    for (const runtime::CellBody& body : runtime::load_bodies(cell_)) {
      const runtime::ObjectConfig& object = cell_.objects[body.body.id - 1U];
      for (MeshChunkSample& chunk : chunks_of(body.mesh_O, 1 << 17))
        ASSERT_TRUE(drawing_->take(std::move(chunk)));
      state_.take(
          ObjectSample{body.body.id, object.name, body.mesh_O.content_hash(), object.X_WO, object.colour}, 1);
    }
    feed_ = std::make_unique<VideoFeed>(
        [this] { return open_simulated_camera(camera(), GraphicsPlatform::kSurfaceless, *world_, past_); });
    view_ = std::make_unique<CameraView>(camera(), config_.camera_view.format, config_.camera_view.staleness,
                                         *feed_, past_);
    drawing_->attach(*view_);
  }
  /// Where the arm's first joint is: to and fro at `speed_rad_s`, a second each way.
  double turned_rad(core::Nanoseconds time_ns) const {
    const double t = std::fmod(core::seconds(time_ns), 2.0);
    return speed_rad_s_ * (t < 1.0 ? t - 0.5 : 1.5 - t);
  }
  /// In a cell with another arm that one moves, and this one rests.
  ArmSample arm_at(core::Nanoseconds time_ns) const {
    ArmSample arm = pose(config_.other_arms.empty() ? turned_rad(time_ns) : 0.0);
    arm.received_ns = time_ns;
    return arm;
  }
  ArmSample other_at(core::Nanoseconds time_ns) const {
    ArmSample arm = pose(turned_rad(time_ns));
    arm.received_ns = time_ns;
    return arm;
  }
  /// Fills in where the arm is until 3 s from now.
  void fill() {
    const core::Nanoseconds now_ns = core::monotonic_ns(), until_ns = now_ns + 3 * core::kNsPerSecond;
    if (now_ns > filled_ns_) known_from_ns_ = now_ns;  // nothing was known until now: so long it was away
    if (filled_ns_ == 0) filled_ns_ = now_ns - core::kNsPerSecond;
    for (; filled_ns_ < until_ns; filled_ns_ += 5 * core::kNsPerMillisecond)
      past_.arms.take(arm_at(filled_ns_)), past_.others[0].take(other_at(filled_ns_));
  }
  /// Waits for a picture that was exposed while the camera knew where the arm was, and while the arm moved
  /// one way, and takes it as it stands 0.3 s later, however long this host took to make it.
  void take_picture() {
    ASSERT_TRUE(eventually([&] {
      const core::Nanoseconds known_until_ns = filled_ns_;
      fill();
      const VideoStatus status = feed_->status();
      if (!status.newest || status.number == seen_) return false;
      seen_ = status.number;
      exposed_ns_ = status.newest->exposed_ns.value();
      if (exposed_ns_ < known_from_ns_ || exposed_ns_ > known_until_ns) return false;
      const core::Nanoseconds later_ns = core::from_seconds(camera().simulated.latency_s + 0.1);
      now_ns_ = exposed_ns_ + later_ns;
      const double t = std::fmod(core::seconds(exposed_ns_), 1.0);
      if (speed_rad_s_ != 0.0 && (t < 0.05 || t + core::seconds(later_ns) > 0.95)) return false;
      state_.arm = arm_at(now_ns_);
      drawing_->advance(now_ns_, 0.0);
      // Of those that come later nothing is seen until the next call.
      return drawing_->take_video(now_ns_) && feed_->status().number == seen_;
    })) << feed_->status().problem;
  }
  /// Of lines over the picture that was taken.
  std::vector<double> distances(Frame frame) {
    const auto picture = frame.backdrop;
    frame.backdrop = std::make_shared<const Image>(Image::zeros(picture->size(), CV_8UC3));
    frame.bold_lines = false;
    const Image seen = drawing_->renderer().render(frame, config_.camera_view.format);
    return distances_to_edges(*picture, seen, frame.camera, frame.lines);
  }

  RecentSamples past_;
  ViewerState state_;
  double speed_rad_s_ = 0.0;
  core::Nanoseconds filled_ns_ = 0, known_from_ns_ = 0, exposed_ns_ = 0, now_ns_ = 0;
  std::uint64_t seen_ = 0;
  std::unique_ptr<robot::SerialArm> arm_;
  std::unique_ptr<SimulatedWorld> world_;
  std::unique_ptr<Drawing> drawing_;
  std::unique_ptr<VideoFeed> feed_;
  std::unique_ptr<CameraView> view_;
};

}  // namespace phantom::synthetic_viewer::test
