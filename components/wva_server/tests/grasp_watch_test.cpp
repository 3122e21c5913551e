// What the gripper's state says of the objects of the model.
#include "components/wva_server/grasp_watch.hpp"

#include <gmock/gmock.h>

#include "common/runtime/cell/arm_model.hpp"
#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server {
namespace {

/// The laboratory's arm at home, as in the shipped gripper_bench.
class Grasp : public TestCell {
 protected:
  void SetUp() override {
    TestCell::SetUp();
    bench_ = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/gripper_bench/cell.yaml");
    const runtime::ArmConfig& config = bench_.arm();
    const robot::SerialArm arm = runtime::load_arm(config);
    core::JointArray home{};
    std::copy(config.home.begin(), config.home.end(), home.begin());
    arm.link_poses(home, X_WL_);
    const auto [link, X_LT] = *arm.find_frame("tool");
    X_WT_ = X_WL_[link] * X_LT;
    fingers_ = runtime::load_fingers(config, arm, 0.004);
    watch_.emplace(fingers_, config.name, "tool");
  }
  /// The bench with its block `offset_m` from between the finger tips, in the tool's axes.
  LiveCell bench_with_block(const Eigen::Vector3d& offset_m) const {
    LiveCell live(bench_, {});
    const auto activated = live.activate(runtime::load_bodies(bench_), 1, {}, [](const auto&...) {});
    EXPECT_TRUE(activated);
    WorkspaceCommand move = make_command(WorkspaceOperation::kMove, "block", 0, X_WT_);
    move.X_WO.translation_m = X_WT_ * offset_m;
    const auto moved = live.apply(move, 2, {});
    EXPECT_TRUE(moved) << moved.status().message();
    return live;
  }
  static messages::GripperState gripper(double width_m, bool holds) {
    messages::GripperState state;
    state.sense = {true, width_m, 0.0, 20.0, true, false};
    state.widest_m = 0.1;
    state.holds = holds;
    state.open = width_m > 0.099;
    return state;
  }
  static void carry_out(const WorkspaceCommand& command, LiveCell& live) {
    WorkspaceCommand whole = command;
    whole.sets_pose = true;
    whole.X_WO = live.objects().at(2).config.X_WO;
    const auto change = live.apply(whole, live.workspace().version + 1, {});
    ASSERT_TRUE(change) << change.status().message();
  }

  runtime::CellConfig bench_;
  robot::LinkPoses X_WL_;
  geometry::Pose X_WT_;
  std::vector<robot::FingerPoint> fingers_;
  std::optional<GraspWatch> watch_;
};

TEST_F(Grasp, OfABlockBetweenTheFingersIsToldFromOneBesideThem) {
  ASSERT_GT(fingers_.size(), 100U);
  EXPECT_EQ(object_between(fingers_, 0.42, X_WL_, bench_with_block({0, 0, 0}).workspace()), 2);
  EXPECT_EQ(object_between(fingers_, 0.42, X_WL_, bench_with_block({0.15, 0, 0}).workspace()), std::nullopt);
  EXPECT_EQ(object_between(fingers_, 0.42, X_WL_, bench_with_block({0, 0.2, 0}).workspace()), std::nullopt);
  EXPECT_EQ(object_between(fingers_, 0.0, X_WL_, bench_with_block({0.15, 0, 0}).workspace()), std::nullopt);
}

TEST_F(Grasp, AttachesOnceWhenTheGripperBeginsToHoldAndReleasesWhenItOpens) {
  LiveCell live = bench_with_block({0, 0, 0});
  EXPECT_FALSE(watch_->step(gripper(0.1, false), X_WL_, live));
  EXPECT_FALSE(watch_->step(gripper(0.06, false), X_WL_, live)) << "it closes, and holds nothing yet";
  const auto attach = watch_->step(gripper(0.042, true), X_WL_, live);
  ASSERT_TRUE(attach);
  EXPECT_EQ(attach->operation, WorkspaceOperation::kAttach);
  EXPECT_EQ(attach->object, "block");
  EXPECT_EQ(attach->arm, "laboratory_arm");
  EXPECT_EQ(attach->frame, "tool");
  EXPECT_FALSE(attach->sets_pose) << "it stays where it is";
  carry_out(*attach, live);
  EXPECT_FALSE(watch_->step(gripper(0.042, true), X_WL_, live));
  EXPECT_FALSE(watch_->step(gripper(0.0425, false), X_WL_, live)) << "it is as wide as what it holds";
  const auto release = watch_->step(gripper(0.05, false), X_WL_, live);
  ASSERT_TRUE(release);
  EXPECT_EQ(release->operation, WorkspaceOperation::kRelease);
  EXPECT_EQ(release->object, "block");
  carry_out(*release, live);
  EXPECT_FALSE(watch_->step(gripper(0.06, false), X_WL_, live)) << "once";
  EXPECT_TRUE(watch_->step(gripper(0.042, true), X_WL_, live)) << "and again";
}

TEST_F(Grasp, WhatIsNotInTheModelIsNotAttachedAndADriveThatDoesNotFollowChangesNothing) {
  LiveCell live = bench_with_block({0.15, 0, 0});
  EXPECT_FALSE(watch_->step(gripper(0.042, true), X_WL_, live));
  EXPECT_FALSE(watch_->step(gripper(0.1, false), X_WL_, live));
  LiveCell near = bench_with_block({0, 0, 0});
  messages::GripperState dead = gripper(0.042, true);
  dead.sense.follows = false;
  EXPECT_FALSE(watch_->step(dead, X_WL_, near));
  carry_out(*watch_->step(gripper(0.042, true), X_WL_, near), near);
  dead = gripper(0.09, false);
  dead.sense.follows = false;
  EXPECT_FALSE(watch_->step(dead, X_WL_, near)) << "what it does is not known: it holds as it did";
  dead.sense.follows = true;
  EXPECT_TRUE(watch_->step(dead, X_WL_, near));
}

TEST_F(Grasp, WhatSlipsOutOfTheFingersIsReleased) {
  LiveCell live = bench_with_block({0, 0, 0});
  carry_out(*watch_->step(gripper(0.042, true), X_WL_, live), live);
  const auto release = watch_->step(gripper(0.01, false), X_WL_, live);
  ASSERT_TRUE(release);
  EXPECT_EQ(release->operation, WorkspaceOperation::kRelease);
}

TEST_F(Grasp, AServerThatIsStartedAnewFindsTheObjectCarriedAndReleasesItWhenTheGripperOpens) {
  LiveCell live = bench_with_block({0, 0, 0});
  carry_out(*watch_->step(gripper(0.042, true), X_WL_, live), live);
  GraspWatch successor(fingers_, "laboratory_arm", "tool");
  EXPECT_FALSE(successor.step(gripper(0.042, true), X_WL_, live)) << "it is carried already";
  EXPECT_TRUE(successor.step(gripper(0.06, false), X_WL_, live));
}

TEST_F(Grasp, AnArmWithoutAGripperThatMovesHasNoFingers) {
  const auto arm = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/two_plates/cell.yaml").arms.at(0);
  EXPECT_TRUE(runtime::load_fingers(arm, runtime::load_arm(arm), 0.004).empty());
}

}  // namespace
}  // namespace phantom::wva_server
