#pragma once

// A cell that a depth camera watches, with the real processes wva_server, workspace_camera and
// phantom_sensing; the arm and the camera are played.

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/core/clock.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/living.hpp"
#include "common/messages/publisher.hpp"
#include "components/workspace_camera/simulated_camera.hpp"
#include "tests/end_to_end/workspace_observer.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::end_to_end {

/// The cell's voxels and the played camera.
struct LiveOptions {
  double voxel_m = 0.01;
  int layer_vox = 4;  ///< thickness of each of the three layers
  int divisor = 4;    ///< of the camera's 640 × 480 pixels
  std::chrono::milliseconds period{50};
};

inline const Eigen::Vector3d kLiveEye{1.3, -1.2, 1.6}, kLiveTarget{0.5, 0.0, 1.0}, kLivePlace{0.75, 0.0, 1.1};

/// The states of an arm that stands still.
class StillArm {
 public:
  explicit StillArm(dds::Participant& participant) : states_(participant, dds::kSlaveState) {
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        messages::SlaveState state;
        state.joint_count = 6;
        const double home[] = {0.0, 0.3, 1.2, 0.0, 0.4, 0.0};
        std::copy(std::begin(home), std::end(home), state.position.begin());
        states_.publish(state);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
  }

 private:
  messages::Publisher<messages::SlaveState> states_;
  std::jthread thread_;
};

/// A depth camera's process: a table, and a box if there is one.
class PlayedCamera {
 public:
  PlayedCamera(dds::Participant& participant, const robot::SerialArm& arm, const LiveOptions& options)
      : options_(options), view_(arm, std::nullopt, {}, 0.01), images_(participant, dds::kDepthImage) {
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  void put_box(bool there) { box_ = there; }
  void move_box(bool moves) { moves_ = moves; }
  void send(bool sends) { sends_ = sends; }
  void hang(bool hangs) { hangs_ = hangs; }
  /// When the first image was exposed that shows the box, or its place without it, since put_box().
  core::Nanoseconds shown_ns() const { return shows_ == box_ ? shown_ns_.load() : 0; }
  /// Images that were taken until now.
  int taken() const { return taken_; }

 private:
  void run(const std::stop_token& stop) {
    workspace_camera::SimulatedOptions options;
    const int width = 640 / options_.divisor, height = 480 / options_.divisor;
    const double focal_px = 560.0 / options_.divisor;
    options.camera = {width, height, focal_px, focal_px, 0.5 * (width - 1), 0.5 * (height - 1), 0.3, 4.0};
    workspace_camera::Thing still, moving;
    still.size_m = {0.1, 0.1, 0.12}, still.from_m = kLivePlace;
    moving = still;
    moving.from_m = kLivePlace - Eigen::Vector3d(0.1, 0.0, 0.0),
    moving.to_m = kLivePlace + Eigen::Vector3d(0.1, 0.0, 0.0);
    moving.trip_s = 2.0;
    // A room around it, too: what is before nothing that is measured is not seen to be free.
    const auto at = [](const geometry::TriangleMesh& mesh, double z_m) {
      return fusion::CameraScene::Object{mesh.transformed({Eigen::Matrix3d::Identity(), {0.0, 0.0, z_m}}),
                                         false};
    };
    const fusion::CameraScene table(
        {at(geometry::make_box({1.2, 1.2, 0.04}), 0.2), at(geometry::make_box({3.4, 3.4, 2.6}), 1.2)});
    const geometry::Pose X_WC = workspace_camera::looking_at(kLiveEye, kLiveTarget);
    workspace_camera::SimulatedCamera empty(options, X_WC, table, {}), full(options, X_WC, table, {still}),
        busy(options, X_WC, table, {moving});
    workspace_camera::ArmPose home;
    const double q[] = {0.0, 0.3, 1.2, 0.0, 0.4, 0.0};
    std::copy(std::begin(q), std::end(q), home.q.begin());
    messages::DepthImage image;
    image.camera = "above";
    image.width = static_cast<std::uint16_t>(width), image.height = static_cast<std::uint16_t>(height);
    image.fx_px = image.fy_px = focal_px;
    image.cx_px = options.camera.cx_px, image.cy_px = options.camera.cy_px;
    image.min_depth_m = 0.3, image.max_depth_m = 4.0;
    const double period_s = std::chrono::duration<double>(options_.period).count();
    auto next = std::chrono::steady_clock::now();
    for (double time_s = 0.0; !stop.stop_requested(); time_s += period_s) {
      const core::Nanoseconds exposed_ns = core::monotonic_ns();
      if (!hangs_ || image.depth_mm.empty()) {
        const bool box = box_;
        if (box != shows_) shown_ns_ = exposed_ns;
        shows_ = box;
        auto& eye = !box ? empty : moves_ ? busy : full;
        const auto pixels = eye.image(time_s, &view_, &home);
        image.depth_mm.assign(pixels.begin(), pixels.end());
      }
      image.age_s = core::seconds(core::monotonic_ns() - exposed_ns);
      if (sends_) images_.publish(image);
      ++taken_;
      next = std::max(next + options_.period, std::chrono::steady_clock::now());
      std::this_thread::sleep_until(next);
    }
  }
  const LiveOptions options_;
  workspace_camera::ArmView view_;
  messages::Publisher<messages::DepthImage> images_;
  std::atomic<int> taken_ = 0;
  std::atomic<bool> box_ = false, shows_ = false, moves_ = false, sends_ = true, hangs_ = false;
  std::atomic<core::Nanoseconds> shown_ns_ = 0;
  std::jthread thread_;
};

class LiveRig {
 public:
  explicit LiveRig(const LiveOptions& options = {}) : options_(options) {
    std::filesystem::create_directories(folder_);
    const std::string source = PHANTOM_SOURCE_DIR, layers = std::to_string(options.layer_vox);
    write(
        "cell.yaml",
        "name: table\nworkspace: {min_m: [-0.8, -0.8, 0.0], max_m: [0.8, 0.8, 1.3], voxel_size_m: " +
            std::to_string(options.voxel_m) + "}\nprofile: {thickness_vox: [" + layers + ", " + layers +
            ", " + layers +
            "], mu_Pa_s_per_m: [30, 20, 10], mu_skin_Pa_s_per_m: 100}\nobjects:\n"
            "  - {name: table, primitive: {box: {size_m: [1.2, 1.2, 0.04]}}, pose: {xyz_m: [0.0, 0.0, 0.2]}}\n"
            "arms:\n  - {name: arm, urdf: " +
            source +
            "/deploy/arms/laboratory_arm.urdf, tip_link: tool, mount: {xyz_m: [0, 0, 0.5]}, home: [0, 0.3, 1.2, 0, "
            "0.4, 0], skin: [{link: hand, meshes: [{}]}, {link: flange, meshes: [{}]}]}\n");
    write("topology.yaml",
          "name: test\ndomain: " + std::to_string(domain_) + "\nqos_profiles: " + source +
              "/deploy/qos/phantom.xml\ncell: cell.yaml\nnetwork: {interfaces: [127.0.0.1]}\n");
    write("wva_server.yaml", "live: {source: workspace_camera, tolerance_vox: 3}\n");
    write("workspace_camera.yaml",
          "cameras: [{name: above, looks_from_m: [1.3, -1.2, 1.6], looks_at_m: [0.5, 0.0, 1.0]}]\n");
  }
  ~LiveRig() {
    camera_.reset();
    arm_.reset();
    for (auto* process : {&seeing_, &sensing_, &server_}) process->reset();
    std::filesystem::remove_all(folder_);
  }
  LiveRig(const LiveRig&) = delete;
  LiveRig& operator=(const LiveRig&) = delete;

  /// Starts all. Returns whether the cell is felt and the camera's images are fused.
  bool start() {
    participant_.emplace("live_system_test", dds::test_network());
    status_.emplace(*participant_, dds::kComponentStatus,
                    [this](const msg::ComponentStatus& sample, const dds::SampleInfo&) {
                      const std::lock_guard lock(mutex_);
                      said_[sample.component_name().c_str()] = sample.message().c_str();
                    });
    arm_.emplace(*participant_);
    camera_.emplace(*participant_,
                    robot::SerialArm::from_urdf(PHANTOM_SOURCE_DIR "/deploy/arms/laboratory_arm.urdf", "tool",
                                                {Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.5}})
                        .value(),
                    options_);
    observer_.emplace(dds::test_network());
    start("wva_server", server_, {"--config", path("wva_server.yaml")});
    start("phantom_sensing", sensing_);
    start_camera();
    return test::eventually([&] { return observer_->version() != 0 && agreed(); }) &&
           test::eventually([&] { return said("workspace_camera").find("are fused") != std::string::npos; });
  }

 protected:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  std::string path(const char* name) const { return (folder_ / name).string(); }
  void start(const std::string& name, std::optional<test::Process>& process,
             std::vector<std::string> more = {}) {
    more.insert(more.begin(), {PHANTOM_BIN_DIR "/" + name, "--deployment", path("topology.yaml")});
    process.emplace(std::move(more), folder_ / (name + ".log"));
  }
  void start_camera() { start("workspace_camera", seeing_, {"--config", path("workspace_camera.yaml")}); }
  std::string logs() const {
    return test::read_text(folder_ / "wva_server.log") + test::read_text(folder_ / "workspace_camera.log") +
           test::read_text(folder_ / "phantom_sensing.log");
  }
  bool agreed() { return observer_->felt_version() == observer_->version(); }
  std::string said(const std::string& component) {
    const std::lock_guard lock(mutex_);
    return said_[component];
  }
  std::size_t live_voxels() {
    const auto world = observer_->workspace();
    std::size_t count = 0;
    for (const workspace::BrickKey key : world->bricks()) {
      const workspace::Workspace::BrickView brick = world->brick(key);
      for (std::uint32_t i = 0; i < workspace::kBrickVoxels; ++i)
        count += messages::is_live(brick.object_of(i)) && brick.order[i] == workspace::kOrderBoundary ? 1 : 0;
    }
    return count;
  }
  /// Seconds until something holds; a negative number if it never does.
  template <class Predicate>
  static double seconds_until(Predicate holds) {
    const core::Nanoseconds from_ns = core::monotonic_ns();
    return test::eventually(holds) ? core::seconds(core::monotonic_ns() - from_ns) : -1.0;
  }

  const LiveOptions options_;
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("phantom_live_" + std::to_string(getpid()));
  int domain_ = test::own_domain();
  std::mutex mutex_;
  std::map<std::string, std::string> said_;
  std::optional<dds::Participant> participant_;
  std::optional<dds::Reader<msg::ComponentStatus>> status_;
  std::optional<StillArm> arm_;
  std::optional<PlayedCamera> camera_;
  std::optional<WorkspaceObserver> observer_;
  std::optional<test::Process> server_, sensing_, seeing_;
};

}  // namespace phantom::end_to_end
