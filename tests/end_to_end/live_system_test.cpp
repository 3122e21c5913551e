// A depth camera watches a cell while the real processes run: what is put there is felt, and gone when it is
// taken away. The test plays the arm and the camera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <iostream>

#include "tests/end_to_end/live_rig.hpp"
#include "tests/support/late_sleeper.hpp"

namespace phantom::end_to_end {
namespace {

using test::eventually;
using test::Process;
using test::read_text;
using testing::HasSubstr;

constexpr double kThreadsOnTheWay = 20.0;

class LiveSystem : public testing::Test, protected LiveRig {
 protected:
  void SetUp() override { ASSERT_TRUE(LiveRig::start()) << logs(); }
  void TearDown() override {
    if (HasFailure()) std::cerr << logs();
  }
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
