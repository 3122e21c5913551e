#include "components/synthetic_viewer/scene/simulated_camera.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <opencv2/core.hpp>
#include <thread>

#include "common/runtime/cell/cell_bodies.hpp"
#include "components/synthetic_viewer/render/renderer.hpp"
#include "components/synthetic_viewer/scene/cell_scene.hpp"
#include "components/synthetic_viewer/video/picture_warp.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr core::Nanoseconds kSlaveSilence_ns = core::kNsPerSecond / 4;
constexpr core::Nanoseconds kMaxWait_ns = core::kNsPerSecond / 20;
constexpr int kSmearPictures = 5;
constexpr double kStillAngle_rad = 1e-5;
constexpr std::size_t kMaxUnderWay = 600;  // pictures that are exposed and have not arrived

/// Returns a lens without distortion that images all that `lens` does, at its sharpness in the middle, as far
/// as its picture then is not larger than twice as wide and high.
camera::Lens ideal_lens(const camera::LensModel& lens) {
  const camera::Lens& real = lens.lens();
  double tan_x = 0.0, tan_y = 0.0;
  const auto include = [&](double u, double v) {
    const auto n = lens.direction({u, v});
    if (!n) return;
    tan_x = std::max(tan_x, std::abs(n->x()));
    tan_y = std::max(tan_y, std::abs(n->y()));
  };
  for (int k = 0; k <= 64; ++k) {
    include(real.width_px * k / 64.0 - 0.5, -0.5);
    include(real.width_px * k / 64.0 - 0.5, real.height_px - 0.5);
    include(-0.5, real.height_px * k / 64.0 - 0.5);
    include(real.width_px - 0.5, real.height_px * k / 64.0 - 0.5);
  }
  const double focal = std::min({real.fx_px, real.width_px / tan_x, real.height_px / tan_y});
  camera::Lens ideal;
  ideal.width_px = 2 * static_cast<int>(std::ceil(focal * tan_x + 1));
  ideal.height_px = 2 * static_cast<int>(std::ceil(focal * tan_y + 1));
  ideal.fx_px = ideal.fy_px = focal;
  ideal.cx_px = (ideal.width_px - 1) / 2.0;
  ideal.cy_px = (ideal.height_px - 1) / 2.0;
  return ideal;
}

class SimulatedCamera : public VideoSource {
 public:
  SimulatedCamera(const VideoCamera& camera, GraphicsPlatform graphics, const SimulatedWorld& world,
                  const RecentSamples& past)
      : how_(camera.simulated),
        rate_hz_(camera.rate_hz),
        past_(past),
        lens_(*camera.calibration.lens),
        ideal_(ideal_lens(lens_)),
        warp_(camera::LensModel(ideal_), lens_),
        eye_(drawing_camera(ideal_, *camera.calibration.X_WC * how_.X_CS)),
        renderer_(graphics),
        scene_(world.arm, world.cell.min_m, world.cell.max_m) {
    for (const LinkMeshData& part : world.arm_meshes) scene_.links.push_back(uploaded(part, renderer_));
    for (const OtherArmData& other : world.others) {
      auto& made = scene_.others.emplace_back(CellScene::OtherArm{other.name, other.arm, {}});
      for (const LinkMeshData& part : other.meshes) made.links.push_back(uploaded(part, renderer_));
      state_.others.push_back({other.name, {}});
    }
    for (const geometry::PlacedMesh& body : runtime::load_real_bodies(world.cell))
      add(world.cell, body.id, body.mesh_W, {});
    for (const runtime::LooseMesh& loose : runtime::load_loose_bodies(world.cell))
      add(world.cell, loose.id, loose.mesh_O, loose.X_WO);
    // Twice as large as a picture, so that each takes another part of it.
    noise_ = cv::Mat(2 * lens_.lens().height_px, 2 * lens_.lens().width_px, CV_16SC3);
    random_.fill(noise_, cv::RNG::NORMAL, 0.0, how_.noise);
  }

  core::Expected<std::optional<VideoPicture>> next() override {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    if (now_ns >= exposure_due_ns_ && under_way_.size() < kMaxUnderWay) {
      expose(now_ns);
      // A picture that took longer than its period makes the rate lower, not a queue.
      exposure_due_ns_ = std::max(exposure_due_ns_, now_ns) + core::from_seconds(1 / rate_hz_);
    }
    const core::Nanoseconds arrival_ns = under_way_.empty() ? exposure_due_ns_ : due_ns(under_way_.front());
    const core::Nanoseconds until_ns =
        std::min({exposure_due_ns_, arrival_ns, core::monotonic_ns() + kMaxWait_ns});
    std::this_thread::sleep_for(std::chrono::nanoseconds(until_ns - core::monotonic_ns()));
    if (under_way_.empty() || core::monotonic_ns() < due_ns(under_way_.front()))
      return std::optional<VideoPicture>();
    std::optional<VideoPicture> arrived = std::move(under_way_.front());
    under_way_.pop_front();
    if (!how_.stamped) arrived->exposed_ns.reset();
    arrived->arrived_ns = core::monotonic_ns();
    return arrived;
  }

 private:
  core::Nanoseconds due_ns(const VideoPicture& picture) const {
    return *picture.exposed_ns + core::from_seconds(how_.latency_s);
  }

  void add(const runtime::CellConfig& cell, std::uint16_t id, const geometry::TriangleMesh& mesh,
           const geometry::Pose& X_WM) {
    scene_.meshes[id] = uploaded(mesh, renderer_);
    state_.objects[id] = {id, cell.objects[id - 1U].name, id, X_WM, cell.objects[id - 1U].colour};
  }

  /// The world at a time, as the ideal lens images it.
  Image at(core::Nanoseconds time_ns) {
    state_.arm = past_.arm_at(time_ns, kSlaveSilence_ns);
    for (std::size_t i = 0; i < state_.others.size(); ++i)
      state_.others[i].arm = past_.other_at(i, time_ns, kSlaveSilence_ns);
    state_.gripper = past_.gripper_at(time_ns, core::kNsPerSecond);
    Frame frame = scene_.frame(state_, {}, time_ns);
    frame.lines.clear();
    frame.camera = eye_;
    return renderer_.render(frame, {ideal_.width_px, ideal_.height_px, 1, true});
  }

  bool moves_between(core::Nanoseconds a_ns, core::Nanoseconds b_ns) const {
    const auto moves = [](const ArmSample& a, const ArmSample& b) {
      double farthest = 0.0;
      for (std::size_t i = 0; i < a.position.size(); ++i)
        farthest = std::max(farthest, std::abs(a.position[i] - b.position[i]));
      return farthest > kStillAngle_rad;
    };
    bool any = moves(past_.arm_at(a_ns, kSlaveSilence_ns), past_.arm_at(b_ns, kSlaveSilence_ns));
    for (std::size_t i = 0; i < state_.others.size(); ++i)
      any =
          any || moves(past_.other_at(i, a_ns, kSlaveSilence_ns), past_.other_at(i, b_ns, kSlaveSilence_ns));
    return any;
  }

  /// The exposure ends now.
  void expose(core::Nanoseconds end_ns) {
    const core::Nanoseconds length_ns = core::from_seconds(how_.exposure_s);
    const core::Nanoseconds middle_ns = end_ns - length_ns / 2;
    Image ideal;
    if (length_ns > 0 && moves_between(end_ns - length_ns, end_ns)) {
      cv::Mat sum;
      for (int k = 0; k < kSmearPictures; ++k) {
        cv::Mat part;
        at(end_ns - length_ns + length_ns * (2 * k + 1) / (2 * kSmearPictures)).convertTo(part, CV_16UC3);
        sum = sum.empty() ? part : sum + part;
      }
      sum.convertTo(ideal, CV_8UC3, 1.0 / kSmearPictures);
    } else {
      ideal = at(middle_ns);
    }
    Image picture = warp_.warped(ideal);
    const cv::Rect part(random_.uniform(0, picture.cols), random_.uniform(0, picture.rows), picture.cols,
                        picture.rows);
    cv::Mat noisy;
    picture.convertTo(noisy, CV_16SC3, how_.gain);
    noisy += noise_(part);
    noisy.convertTo(picture, CV_8UC3);
    under_way_.push_back({std::move(picture), middle_ns, 0});
  }

  const VideoCamera::Simulated how_;
  const double rate_hz_;
  const RecentSamples& past_;
  camera::LensModel lens_;
  camera::Lens ideal_;
  PictureWarp warp_;
  Camera eye_;
  Renderer renderer_;
  CellScene scene_;
  ViewerState state_;
  cv::RNG random_{1};
  cv::Mat noise_;
  std::deque<VideoPicture> under_way_;
  core::Nanoseconds exposure_due_ns_ = 0;
};

}  // namespace

std::unique_ptr<VideoSource> open_simulated_camera(const VideoCamera& camera, GraphicsPlatform graphics,
                                                   const SimulatedWorld& world, const RecentSamples& past) {
  return std::make_unique<SimulatedCamera>(camera, graphics, world, past);
}

}  // namespace phantom::synthetic_viewer
