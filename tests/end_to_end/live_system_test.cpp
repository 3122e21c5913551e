// A depth camera watches a cell while the real processes run: what is put there is felt, and gone when it is
// taken away. The test plays the arm and the camera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <iostream>
#include <thread>

#include "common/core/clock.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/living.hpp"
#include "common/messages/publisher.hpp"
#include "components/workspace_camera/simulated_camera.hpp"
#include "tests/end_to_end/workspace_observer.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/late_sleeper.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::end_to_end {
namespace {

using test::eventually;
using test::Process;
using test::read_text;
using testing::HasSubstr;

constexpr double kThreadsOnTheWay = 20.0;
const Eigen::Vector3d kEye{1.3, -1.2, 1.6}, kTarget{0.5, 0.0, 1.0}, kPlace{0.75, 0.0, 1.1};

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
  PlayedCamera(dds::Participant& participant, const robot::SerialArm& arm)
      : view_(arm, std::nullopt, {}, 0.01), images_(participant, dds::kDepthImage) {
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  void put_box(bool there) { box_ = there; }
  void move_box(bool moves) { moves_ = moves; }
  void send(bool sends) { sends_ = sends; }
  void hang(bool hangs) { hangs_ = hangs; }
  /// Images that were taken until now.
  int taken() const { return taken_; }

 private:
  void run(const std::stop_token& stop) {
    workspace_camera::SimulatedOptions options;
    options.camera = {160, 120, 140.0, 140.0, 79.5, 59.5, 0.3, 4.0};
    workspace_camera::Thing still, moving;
    still.size_m = {0.1, 0.1, 0.12}, still.from_m = kPlace;
    moving = still;
    moving.from_m = kPlace - Eigen::Vector3d(0.1, 0.0, 0.0),
    moving.to_m = kPlace + Eigen::Vector3d(0.1, 0.0, 0.0);
    moving.trip_s = 2.0;
    // A room around it, too: what is before nothing that is measured is not seen to be free.
    const auto at = [](const geometry::TriangleMesh& mesh, double z_m) {
      return fusion::CameraScene::Object{mesh.transformed({Eigen::Matrix3d::Identity(), {0.0, 0.0, z_m}}),
                                         false};
    };
    const fusion::CameraScene table(
        {at(geometry::make_box({1.2, 1.2, 0.04}), 0.2), at(geometry::make_box({3.4, 3.4, 2.6}), 1.2)});
    const geometry::Pose X_WC = workspace_camera::looking_at(kEye, kTarget);
    workspace_camera::SimulatedCamera empty(options, X_WC, table, {}), full(options, X_WC, table, {still}),
        busy(options, X_WC, table, {moving});
    workspace_camera::ArmPose home;
    const double q[] = {0.0, 0.3, 1.2, 0.0, 0.4, 0.0};
    std::copy(std::begin(q), std::end(q), home.q.begin());
    messages::DepthImage image;
    image.camera = "above";
    image.width = 160, image.height = 120;
    image.fx_px = image.fy_px = 140.0, image.cx_px = 79.5, image.cy_px = 59.5;
    image.min_depth_m = 0.3, image.max_depth_m = 4.0;
    for (double time_s = 0.0; !stop.stop_requested(); time_s += 0.05) {
      if (!hangs_ || image.depth_mm.empty()) {
        auto& eye = !box_ ? empty : moves_ ? busy : full;
        const auto pixels = eye.image(time_s, &view_, &home);
        image.depth_mm.assign(pixels.begin(), pixels.end());
      }
      image.age_s = 0.005;
      if (sends_) images_.publish(image);
      ++taken_;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
  workspace_camera::ArmView view_;
  messages::Publisher<messages::DepthImage> images_;
  std::atomic<int> taken_ = 0;
  std::atomic<bool> box_ = false, moves_ = false, sends_ = true, hangs_ = false;
  std::jthread thread_;
};

class LiveSystem : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    const std::string source = PHANTOM_SOURCE_DIR;
    write(
        "cell.yaml",
        "name: table\nworkspace: {min_m: [-0.8, -0.8, 0.0], max_m: [0.8, 0.8, 1.3], voxel_size_m: 0.01}\n"
        "profile: {thickness_vox: [4, 4, 4], mu_Pa_s_per_m: [30, 20, 10], mu_skin_Pa_s_per_m: 100}\nobjects:\n"
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
    participant_.emplace("live_system_test", network());
    status_.emplace(*participant_, dds::kComponentStatus,
                    [this](const msg::ComponentStatus& sample, const dds::SampleInfo&) {
                      const std::lock_guard lock(mutex_);
                      said_[sample.component_name().c_str()] = sample.message().c_str();
                    });
    arm_.emplace(*participant_);
    camera_.emplace(*participant_,
                    robot::SerialArm::from_urdf(source + "/deploy/arms/laboratory_arm.urdf", "tool",
                                                {Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.5}})
                        .value());
    observer_.emplace(network());
    start("wva_server", server_, {"--config", path("wva_server.yaml")});
    start("phantom_sensing", sensing_);
    start_camera();
    ASSERT_TRUE(eventually([&] { return observer_->version() != 0 && agreed(); })) << logs();
    ASSERT_TRUE(eventually([&] { return said("workspace_camera").find("are fused") != std::string::npos; }))
        << logs();
  }
  void TearDown() override {
    camera_.reset();
    arm_.reset();
    for (auto* process : {&seeing_, &sensing_, &server_}) process->reset();
    if (HasFailure()) std::cerr << logs();
    std::filesystem::remove_all(folder_);
  }

  core::NetworkOptions network() const {
    core::NetworkOptions network;
    network.domain = domain_;
    network.qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml";
    network.interfaces = {"127.0.0.1"};
    return network;
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  std::string path(const char* name) const { return (folder_ / name).string(); }
  void start(const std::string& name, std::optional<Process>& process, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {PHANTOM_BIN_DIR "/" + name, "--deployment", path("topology.yaml")});
    process.emplace(std::move(more), folder_ / (name + ".log"));
  }
  void start_camera() { start("workspace_camera", seeing_, {"--config", path("workspace_camera.yaml")}); }
  std::string logs() const {
    return read_text(folder_ / "wva_server.log") + read_text(folder_ / "workspace_camera.log") +
           read_text(folder_ / "phantom_sensing.log");
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
    return eventually(holds) ? core::seconds(core::monotonic_ns() - from_ns) : -1.0;
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("phantom_live_" + std::to_string(getpid()));
  int domain_ = test::own_domain();
  std::mutex mutex_;
  std::map<std::string, std::string> said_;
  std::optional<dds::Participant> participant_;
  std::optional<dds::Reader<msg::ComponentStatus>> status_;
  std::optional<StillArm> arm_;
  std::optional<PlayedCamera> camera_;
  std::optional<WorkspaceObserver> observer_;
  std::optional<Process> server_, sensing_, seeing_;
};

TEST_F(LiveSystem, AThingThatIsPutThereIsFeltAndGoneWhenItIsTakenAway) {
  EXPECT_EQ(live_voxels(), 0U) << "the table and the arm are the model's";
  const std::uint64_t before = observer_->workspace()->content_hash();
  EXPECT_FALSE(messages::is_live(observer_->percept().object()));
  for (int i = 0; i < 2; ++i) {
    camera_->put_box(true);
    const double came_s = seconds_until([&] { return live_voxels() > 100; });
    const double felt_s = seconds_until(
        [&] { return observer_->percept().valid() && messages::is_live(observer_->percept().object()); });
    EXPECT_GE(came_s, 0.0);
    EXPECT_GE(felt_s, 0.0);
    camera_->put_box(false);
    const double gone_s = seconds_until([&] { return live_voxels() < 20; });
    EXPECT_GE(gone_s, 0.0) << live_voxels() << " voxels are left";
    // A few voxels may wait for their brick's turn.
    const double whole_s = seconds_until([&] { return observer_->workspace()->content_hash() == before; });
    EXPECT_GE(whole_s, 0.0) << live_voxels() << " voxels are left";
    EXPECT_TRUE(eventually([&] { return agreed() && !messages::is_live(observer_->percept().object()); }));
    std::cout << "put there: in the workspace after " << came_s << " s, felt " << felt_s
              << " s later; taken away: gone after " << gone_s << " s, without a trace " << whole_s
              << " s later\n";
  }
}

// Tries workspace_camera: a camera sends no images any more
TEST_F(LiveSystem, ACameraThatIsKilledIsTold) {
  camera_->put_box(true);
  ASSERT_TRUE(eventually([&] { return live_voxels() > 100; }));
  test::LateSleeper late;
  camera_->send(false);
  const double told_s =
      seconds_until([&] { return said("workspace_camera").find("is dead") != std::string::npos; });
  const double by_server_s =
      seconds_until([&] { return said("wva_server").find("is dead") != std::string::npos; });
  std::cout << "no images: told after " << told_s << " s, by wva_server " << by_server_s << " s later\n";
  EXPECT_GE(told_s, 0.0);
  EXPECT_GE(by_server_s, 0.0);
  EXPECT_LE(told_s, 1.2 + kThreadsOnTheWay * late.greatest_s()) << "0.5 s, and the status once in 0.5 s";
  EXPECT_GT(live_voxels(), 100U) << "it is kept";
  camera_->send(true);
  EXPECT_TRUE(eventually([&] { return said("workspace_camera").find("are fused") != std::string::npos; }));
  camera_->hang(true);
  EXPECT_TRUE(eventually([&] { return said("workspace_camera").find("is dead") != std::string::npos; }));
}

// Tries wva_server: the source of live matter is silent
TEST_F(LiveSystem, AKilledWorkspaceCameraIsToldAndItsSuccessorGoesOn) {
  camera_->put_box(true);
  ASSERT_TRUE(eventually([&] { return live_voxels() > 100; }));
  seeing_->end(SIGKILL);
  EXPECT_TRUE(eventually(
      [&] { return said("wva_server").find("nothing is heard of workspace_camera") != std::string::npos; }));
  EXPECT_GT(live_voxels(), 100U);
  camera_->put_box(false);
  start_camera();
  EXPECT_TRUE(eventually([&] { return live_voxels() == 0; }));
  EXPECT_TRUE(eventually([&] { return said("wva_server").find("nothing is heard") == std::string::npos; }));
}

TEST_F(LiveSystem, ThePerceptSaysWhenNoCameraSeesItsPlaceAnyMore) {
  using enum msg::PerceptCondition;
  const auto says = [&](msg::PerceptCondition condition) {
    return eventually([&] { return observer_->percept().condition() == condition; });
  };
  EXPECT_TRUE(says(PERCEPT_FRESH)) << "the hand is in view";
  camera_->send(false);
  EXPECT_TRUE(says(PERCEPT_SPACE_UNSEEN)) << "the camera is dead";
  EXPECT_TRUE(observer_->percept().valid());
  camera_->send(true);
  EXPECT_TRUE(says(PERCEPT_FRESH));
  seeing_->end(SIGKILL);
  EXPECT_TRUE(says(PERCEPT_SPACE_UNSEEN)) << "nothing is heard of it";
  EXPECT_THAT(read_text(folder_ / "phantom_sensing.log"), testing::Not(HasSubstr("no depth camera")))
      << "it comes and goes: the log would fill";
}

TEST_F(LiveSystem, WhatWasRecordedOfACameraIsSeenAsTheCameraWas) {
  const auto recorder = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {PHANTOM_BIN_DIR "/dds_recorder", "--deployment", path("topology.yaml")});
    return words;
  };
  {
    Process recording(recorder({"record", "--topics", "depth_image", "--folder", path("recorded")}),
                      folder_ / "dds_recorder.log");
    ASSERT_TRUE(eventually([&] { return said("dds_recorder").find("recording") != std::string::npos; }))
        << recording.output();
    camera_->put_box(true);
    ASSERT_TRUE(eventually([&] { return live_voxels() > 100; }));
    const int taken = camera_->taken();
    ASSERT_TRUE(eventually([&] { return camera_->taken() > taken + 40; }));
    EXPECT_EQ(recording.end(SIGINT), 0) << recording.output();
  }
  camera_->put_box(false);
  ASSERT_TRUE(eventually([&] { return live_voxels() < 20; }));
  camera_->send(false);
  Process replay(recorder({"replay", path("recorded"), "--beside-live", "--loop"}), folder_ / "replay.log");
  EXPECT_TRUE(eventually([&] { return live_voxels() > 100; })) << replay.output();
  EXPECT_EQ(replay.end(SIGINT), 0) << replay.output();
}

TEST_F(LiveSystem, ACameraThatIsFrozenIsToldToo) {
  camera_->put_box(true);
  ASSERT_TRUE(eventually([&] { return live_voxels() > 100; }));
  seeing_->signal(SIGSTOP);
  EXPECT_TRUE(eventually(
      [&] { return said("wva_server").find("nothing is heard of workspace_camera") != std::string::npos; }));
  seeing_->signal(SIGCONT);
  EXPECT_TRUE(eventually([&] { return said("wva_server").find("nothing is heard") == std::string::npos; }));
}

TEST_F(LiveSystem, ARestartedServerHasWhatIsSeen) {
  camera_->put_box(true);
  ASSERT_TRUE(eventually([&] { return live_voxels() > 100; }));
  const std::uint64_t version = observer_->version();
  EXPECT_EQ(server_->end(SIGTERM), 0);
  start("wva_server", server_, {"--config", path("wva_server.yaml")});
  EXPECT_TRUE(eventually([&] { return observer_->version() > version && live_voxels() > 100; }));
}

TEST_F(LiveSystem, CommandsAreCarriedOutMeanwhile) {
  camera_->put_box(true);
  camera_->move_box(true);
  ASSERT_TRUE(eventually([&] { return live_voxels() > 100; }));
  const std::uint64_t first = observer_->version();
  for (int i = 0; i < 3; ++i) {
    const test::Said said = test::run_line(
        PHANTOM_BIN_DIR "/wva_server command move --object table --pose '0 0 0.1" + std::to_string(7 + i) +
        " 0 0 0' --timeout-s 30 --deployment " + path("topology.yaml"));
    EXPECT_EQ(said.exit_code, 0) << said.output;
  }
  EXPECT_TRUE(eventually([&] { return observer_->version() > first && agreed(); }));
  EXPECT_TRUE(eventually([&] { return live_voxels() > 50; }));
}

TEST_F(LiveSystem, WhatAPersonDecidesAboutAThingHoldsUntilItIsRestored) {
  const auto decide = [&](const std::string& words) {
    return test::run_line(PHANTOM_BIN_DIR "/wva_server command " + words + " --timeout-s 30 --deployment " +
                          path("topology.yaml"));
  };
  camera_->put_box(true);
  ASSERT_TRUE(eventually([&] { return live_voxels() > 100; }));
  const test::Said named = decide("name --object 'live object 1' --name bucket");
  ASSERT_EQ(named.exit_code, 0) << named.output;
  ASSERT_TRUE(eventually([&] { return decide("list").output.find("bucket") != std::string::npos; }))
      << decide("list").output;
  const test::Said frozen = decide("freeze --object bucket");
  ASSERT_EQ(frozen.exit_code, 0) << frozen.output;
  EXPECT_TRUE(eventually([&] { return said("wva_server").find("'bucket' is frozen") != std::string::npos; }));
  const std::size_t voxels = live_voxels();
  camera_->put_box(false);
  const int taken = camera_->taken();
  ASSERT_TRUE(eventually([&] { return camera_->taken() > taken + 40; }));
  EXPECT_EQ(live_voxels(), voxels) << "no camera sees it any more";
  EXPECT_EQ(decide("restore --object bucket").exit_code, 0);
  EXPECT_TRUE(eventually([&] { return live_voxels() == 0; }));
  const test::Said gone = decide("freeze --object bucket");
  EXPECT_EQ(gone.exit_code, 1);
  EXPECT_THAT(gone.output, HasSubstr("refused: "));
}

// Tries workspace_camera: an object stands elsewhere than the model has it, or is gone
TEST_F(LiveSystem, AnObjectThatTheModelHasElsewhereIsReportedUntilItIsCorrected) {
  const auto move = [&](const std::string& height_m) {
    return test::run_line(PHANTOM_BIN_DIR "/wva_server command move --object table --pose '0 0 " + height_m +
                          " 0 0 0' --timeout-s 30 --deployment " + path("topology.yaml"));
  };
  test::Said moved = move("0.12");
  ASSERT_EQ(moved.exit_code, 0) << moved.output;
  EXPECT_TRUE(eventually([&] {
    return said("workspace_camera").find("'table' stands 0.") != std::string::npos;
  })) << said("workspace_camera");
  // Of a plate whose edges are hardly in view the height is known; it may seem to lean, or to be aside, a
  // little.
  EXPECT_THAT(said("workspace_camera"), testing::ContainsRegex("[+]0[.]0[6-9]\\) m"));
  moved = move("0.2");
  ASSERT_EQ(moved.exit_code, 0) << moved.output;
  EXPECT_TRUE(eventually([&] { return said("workspace_camera").find("are fused") != std::string::npos; }))
      << said("workspace_camera");
}

}  // namespace
}  // namespace phantom::end_to_end
