// Objects that arms carry: where the model has them, from which version on, and over the end of a server.
#include "components/wva_server/carriers.hpp"

#include <gmock/gmock.h>

#include <random>

#include "common/robot/tests/test_arms.hpp"
#include "components/wva_server/change_under_way.hpp"
#include "components/wva_server/tests/test_cell.hpp"
#include "tests/support/same_content.hpp"

namespace phantom::wva_server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr core::Nanoseconds kNow_ns = 5 * core::kNsPerSecond;

class Carrying : public TestCell {
 protected:
  void SetUp() override {
    TestCell::SetUp();
    live_.emplace(activated(cell(), 7));
  }
  static Carriers carriers(const std::string& followed = "left") {
    std::map<std::string, CarrierArm> arms;
    arms.emplace("left", CarrierArm{robot::test_arms::planar(), "tip"});
    arms.emplace("right", CarrierArm{robot::test_arms::planar(), "tip"});
    return {std::move(arms), followed, 0.1};
  }
  static ArmSample state(double q0, double q1, core::Nanoseconds at_ns = kNow_ns) {
    ArmSample sample;
    sample.received_ns = at_ns;
    sample.position[0] = q0;
    sample.position[1] = q1;
    return sample;
  }
  static geometry::Pose tip_at(double q0, double q1) {
    const robot::SerialArm arm = robot::test_arms::planar();
    robot::LinkPoses X_WL;
    arm.link_poses({q0, q1}, X_WL);
    const auto [link, X_LF] = *arm.find_frame("tip");
    return X_WL[link] * X_LF;
  }
  static WorkspaceCommand attach(const std::string& object, const std::string& arm = "left",
                                 const geometry::Pose& X_FO = {}) {
    WorkspaceCommand command = make_command(WorkspaceOperation::kAttach, object);
    command.arm = arm;
    command.frame = "tip";
    command.sets_pose = true;
    command.X_FO = X_FO;
    return command;
  }
  static WorkspaceCommand release(const std::string& object, const geometry::Pose& X_WO = {},
                                  const std::string& arm = "") {
    WorkspaceCommand command = make_command(WorkspaceOperation::kRelease, object, 0, X_WO);
    command.arm = arm;
    command.sets_pose = true;
    return command;
  }
  CellChange done(const WorkspaceCommand& command) { return done(command, *live_); }
  CellChange done(const WorkspaceCommand& command, LiveCell& live) {
    auto change = live.apply(command, live.workspace().version + 1, {});
    if (!change) throw std::runtime_error(change.status().message());
    return *std::move(change);
  }
  /// Returns why the command is refused; nothing must have changed then.
  std::string refused(const WorkspaceCommand& command) {
    const std::uint64_t version = live_->workspace().version, hash = live_->content_hash();
    const std::size_t carried = live_->carried().size();
    const auto change = live_->apply(command, version + 1, {});
    if (change) return "accepted";
    EXPECT_EQ(live_->workspace().version, version);
    EXPECT_EQ(live_->content_hash(), hash);
    EXPECT_EQ(live_->carried().size(), carried);
    return change.status().message();
  }

  std::optional<LiveCell> live_;
};

TEST_F(Carrying, AnAttachedObjectIsInTheWorkspaceNoMoreAndKeepsItsIdNameAndMesh) {
  const geometry::Pose X_FO{geometry::rotation_from_rpy(0.1, 0.2, 0.3), {0.01, 0.02, 0.03}};
  const CellChange change = done(attach("ball", "left", X_FO));
  EXPECT_EQ(change.id, 1);
  EXPECT_EQ(change.workspace.version, 8U);
  EXPECT_THAT(change.message,
              AllOf(HasSubstr("'ball' (object 1)"), HasSubstr("arm 'left' at its link 'tip'")));
  LiveCell without = activated(cell());
  done(make_command(WorkspaceOperation::kRemove, "ball"), without);
  EXPECT_EQ(live_->content_hash(), without.content_hash());
  EXPECT_EQ(live_->workspace().content_hash(), without.content_hash());
  ASSERT_EQ(live_->carried().size(), 1U);
  const messages::CarriedObject carried = live_->carried().front();
  EXPECT_EQ(carried.id, 1);
  EXPECT_EQ(carried.arm, "left");
  EXPECT_EQ(carried.frame, "tip");
  EXPECT_EQ(carried.X_FO.rotation, X_FO.rotation);
  EXPECT_EQ(carried.X_FO.translation_m, X_FO.translation_m);
  EXPECT_EQ(carried.mesh_hash, live_->objects().at(1).mesh_hash);
  EXPECT_EQ(live_->objects().size(), 3U);
}

TEST_F(Carrying, AReleasedObjectStandsWhereAMoveWouldHavePutIt) {
  done(attach("ball"));
  const geometry::Pose there{geometry::rotation_from_rpy(0.0, 0.0, 0.5), {0.1, -0.1, 0.2}};
  WorkspaceCommand command = release("ball", there);
  command.guard_vox = 2;
  const CellChange change = done(command);
  EXPECT_THAT(change.message, HasSubstr("released 'ball' (object 1) at (0.100, -0.100, 0.200) m"));
  EXPECT_TRUE(live_->carried().empty());
  LiveCell moved = activated(cell());
  done(make_command(WorkspaceOperation::kMove, "ball", 0, there, "", 2), moved);
  EXPECT_EQ(live_->content_hash(), moved.content_hash());
  EXPECT_EQ(live_->objects().at(1).config.X_WO.translation_m, there.translation_m);
}

// Tries wva_server: an arm asks for an object that another one carries
TEST_F(Carrying, OfTwoArmsThatWantTheSameObjectTheFirstHasItUntilItReleasesIt) {
  done(attach("ball", "left"));
  EXPECT_EQ(refused(attach("ball", "right")),
            "'ball' (object 1) is carried by arm 'left' at its link 'tip' already; release it there first");
  EXPECT_THAT(refused(release("ball", {}, "right")),
              HasSubstr("carried by arm 'left' at its link 'tip', not by 'right'"));
  EXPECT_EQ(live_->carried().front().arm, "left");
  done(release("ball", {Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.3}}, "left"));
  done(attach("ball", "right"));
  EXPECT_EQ(live_->carried().front().arm, "right");
}

// Tries wva_server: an object is put down outside of the workspace
TEST_F(Carrying, WhatMakesNoSenseIsRefused) {
  EXPECT_THAT(refused(release("ball")),
              HasSubstr("is carried by no arm; it stands at (0.000, 0.000, 0.300) m"));
  EXPECT_THAT(refused(attach("pump")), HasSubstr("no object 'pump'"));
  done(attach("ball"));
  EXPECT_THAT(refused(make_command(WorkspaceOperation::kMove, "ball")), HasSubstr("release it first"));
  EXPECT_THAT(refused(release("ball", {Eigen::Matrix3d::Identity(), {5.0, 0.0, 0.0}})),
              HasSubstr("outside of the workspace"))
      << "it stays carried";
  EXPECT_EQ(live_->carried().size(), 1U);
}

TEST_F(Carrying, AProtectedZoneIsNotTakenButMovedAndRemoved) {
  live_.emplace(activated(cell_with("pose: {xyz_m: [0.2, 0.1, 0.15]},",
                                    "kind: protected_zone, pose: {xyz_m: [0.2, 0.1, 0.15]},")));
  const auto fluid_at = [&](double y_m) { return order_at(live_->workspace(), 0.2, y_m, 0.15); };
  EXPECT_EQ(fluid_at(0.1), 1) << "its innermost layer";
  EXPECT_THAT(refused(attach("right post")), HasSubstr("'right post' (object 3) is a protected zone"));
  EXPECT_TRUE(live_->carried().empty());
  done(make_command(WorkspaceOperation::kMove, "right post", 0,
                    {Eigen::Matrix3d::Identity(), {0.2, -0.2, 0.15}}));
  EXPECT_EQ(fluid_at(0.1), 0);
  EXPECT_EQ(fluid_at(-0.2), 1) << "it is a zone there, too";
  done(make_command(WorkspaceOperation::kRemove, "right post"));
  EXPECT_EQ(fluid_at(-0.2), 0);
}

TEST_F(Carrying, ACarriedObjectMayBeRemovedAndIsCarriedNoMore) {
  done(attach("ball"));
  const std::uint64_t hash = live_->content_hash();
  const CellChange change = done(make_command(WorkspaceOperation::kRemove, "ball"));
  EXPECT_EQ(change.workspace.version, 9U);
  EXPECT_TRUE(change.workspace.changed.empty());
  EXPECT_EQ(live_->content_hash(), hash);
  EXPECT_TRUE(live_->carried().empty());
  EXPECT_FALSE(live_->objects().contains(1));
}

TEST_F(Carrying, AnObjectKeepsItsPlaceWhenItIsTakenAndMovesWithTheHand) {
  Carriers hands = carriers();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> angle(-0.5, 0.5);
  for (int round = 0; round < 20; ++round) {
    const double q[4] = {angle(random), angle(random), angle(random), angle(random)};
    hands.take(state(q[0], q[1]));
    const geometry::Pose X_WO = live_->objects().at(1).config.X_WO;
    const auto taken = hands.complete(make_command(WorkspaceOperation::kAttach, "ball"), *live_, kNow_ns);
    ASSERT_TRUE(taken) << taken.status().message();
    EXPECT_EQ(taken->arm, "left");
    EXPECT_EQ(taken->frame, "tip");
    EXPECT_TRUE((tip_at(q[0], q[1]) * taken->X_FO).translation_m.isApprox(X_WO.translation_m, 1e-12));
    done(*taken);
    hands.take(state(q[2], q[3]));
    const auto put = hands.complete(make_command(WorkspaceOperation::kRelease, "ball"), *live_, kNow_ns);
    ASSERT_TRUE(put) << put.status().message();
    const geometry::Pose there = tip_at(q[2], q[3]) * taken->X_FO;
    EXPECT_TRUE(put->X_WO.translation_m.isApprox(there.translation_m, 1e-12));
    EXPECT_TRUE(put->X_WO.rotation.isApprox(there.rotation, 1e-12));
    done(release("ball", X_WO));  // near, for the next round
  }
}

// Tries wva_server: an attach or release while the arm's slave_state does not come
TEST_F(Carrying, WithoutAFreshStateOfTheArmAPoseMustBeGiven) {
  Carriers hands = carriers();
  const auto problem = [&](const WorkspaceCommand& command) {
    const auto completed = hands.complete(command, *live_, kNow_ns);
    return completed ? std::string("completed") : completed.status().message();
  };
  const WorkspaceCommand take = make_command(WorkspaceOperation::kAttach, "ball"),
                         put = make_command(WorkspaceOperation::kRelease, "ball");
  EXPECT_THAT(problem(take),
              HasSubstr("no slave_state has come; allowed: the same command with its pose in the"));
  hands.take(state(0, 0, kNow_ns - 200 * core::kNsPerMillisecond));
  EXPECT_THAT(problem(take), HasSubstr("its newest slave_state is 0.2 s old"));
  EXPECT_EQ(problem(attach("ball")), "completed") << "its pose is given";
  hands.take(state(0, 0));
  EXPECT_EQ(problem(take), "completed");
  done(attach("ball"));
  hands.take(state(0, 0, kNow_ns - 200 * core::kNsPerMillisecond));
  EXPECT_THAT(problem(put), HasSubstr("0.2 s old; allowed: the same command with where it stands now"));
  EXPECT_EQ(problem(release("ball")), "completed");
  EXPECT_EQ(problem(take), "completed") << "refused by the cell, which knows the better reason";
}

TEST_F(Carrying, ArmsAndLinksThatDoNotExistAreRefused) {
  Carriers hands = carriers();
  hands.take(state(0, 0));
  const auto problem = [&](const std::string& arm, const std::string& frame) {
    WorkspaceCommand command = make_command(WorkspaceOperation::kAttach, "ball");
    command.arm = arm;
    command.frame = frame;
    const auto completed = hands.complete(command, *live_, kNow_ns);
    return completed ? std::string("completed") : completed.status().message();
  };
  EXPECT_EQ(problem("middle", ""), "no arm 'middle' that can carry it; there are: left, right");
  EXPECT_EQ(problem("left", "claw"), "arm 'left' has no moving link 'claw'");
  EXPECT_EQ(problem("left", "base"), "arm 'left' has no moving link 'base'");
  EXPECT_EQ(problem("left", "upper"), "completed");
  EXPECT_THAT(problem("right", ""), HasSubstr("does not follow it"));
  EXPECT_EQ(carriers("").followed(), nullptr) << "there are two";
}

// A tool: the cell file says how it is held, what it weighs, and which arm has it from the start.
TEST_F(Carrying, AToolIsHeldAsTheCellFileSaysAndMayBeThereFromTheStart) {
  const std::string tool =
      "pose: {xyz_m: [0.0, 0.0, 0.3]}, mass_kg: 2, hold: {arm: arm, pose: {xyz_m: [0, 0, 0.1]}}";
  live_.emplace(activated(cell_with("pose: {xyz_m: [0.0, 0.0, 0.3]}", tool), 7));
  ASSERT_EQ(live_->carried().size(), 1U);
  const messages::CarriedObject carried = live_->carried().front();
  EXPECT_EQ(carried.id, 1);
  EXPECT_EQ(carried.arm, "arm");
  EXPECT_EQ(carried.frame, "tool");
  EXPECT_EQ(carried.X_FO.translation_m.z(), 0.1);
  EXPECT_EQ(carried.mass_kg, 2.0);
  EXPECT_TRUE(carried.centre_of_mass_m.isZero(1e-6));
  EXPECT_NEAR(carried.moments_kg_m2.x(), 0.4 * 2.0 * 0.06 * 0.06, 1e-4);
  EXPECT_EQ(order_at(live_->workspace(), 0.001, 0.001, 0.301), 0) << "it does not stand in the cell as well";
  done(release("ball", {Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.3}}));
  const Carriers hands = carriers();
  const auto taken = hands.complete(make_command(WorkspaceOperation::kAttach, "ball"), *live_, kNow_ns);
  ASSERT_TRUE(taken) << "where the arm is need not be known: " << taken.status().message();
  EXPECT_EQ(taken->frame, "tip");
  EXPECT_EQ(taken->X_FO.translation_m.z(), 0.1);
  const auto unknown = runtime::load_cell(
      cell_with("pose: {xyz_m: [0.0, 0.0, 0.3]}", "pose: {xyz_m: [0.0, 0.0, 0.3]}, hold: {arm: claw}"));
  EXPECT_THROW(
      (void)LiveCell(unknown, {}).activate(runtime::load_bodies(unknown, {}), 1, {}, [](const auto&...) {}),
      core::ConfigError);
}

// Tries wva_server: it is killed while an arm carries an object
TEST_F(Carrying, AServerThatIsStartedAnewServesTheSameWhateverWasDone) {
  std::mt19937 random(17);
  const auto one_of = [&](std::initializer_list<const char*> names) {
    return std::string(names.begin()[random() % names.size()]);
  };
  std::uniform_real_distribution<double> place(-0.2, 0.2), turn(-3.0, 3.0);
  std::size_t carried_at_times = 0;
  for (int step = 0; step < 40; ++step) {
    const geometry::Pose X{geometry::rotation_from_rpy(turn(random), turn(random), turn(random)),
                           {place(random), place(random), 0.25 + place(random)}};
    WorkspaceCommand command;
    switch (random() % 3) {
      case 0:
        command = attach(one_of({"ball", "left post", "right post"}), one_of({"left", "right"}), X);
        break;
      case 1:
        command = release(one_of({"ball", "left post", "right post"}), X);
        break;
      default:
        command = make_command(WorkspaceOperation::kMove, one_of({"ball", "left post", "right post"}), 0, X);
    }
    (void)live_->apply(command, live_->workspace().version + 1, {});
    const auto file = folder_ / "changes.json";
    write_changes(live_->changes(), live_->cell(), file);
    runtime::CellConfig again = runtime::load_cell(cell());
    const auto kept = read_changes(again, file);
    ASSERT_TRUE(kept);
    wva_server::apply(*kept, again);
    LiveCell successor(again, {}, *kept);
    const auto activated =
        successor.activate(runtime::load_bodies(again, {}), 100, {}, [](const auto&...) {});
    ASSERT_TRUE(activated) << activated.status().message();
    ASSERT_NO_FATAL_FAILURE(phantom::test::expect_same_content(successor.workspace(), live_->workspace()));
    ASSERT_EQ(successor.carried().size(), live_->carried().size());
    for (std::size_t i = 0; i < live_->carried().size(); ++i) {
      const messages::CarriedObject was = live_->carried()[i], is = successor.carried()[i];
      EXPECT_EQ(is.id, was.id);
      EXPECT_EQ(is.arm, was.arm);
      EXPECT_EQ(is.frame, was.frame);
      EXPECT_EQ(is.X_FO.rotation, was.X_FO.rotation) << "to the last bit";
      EXPECT_EQ(is.X_FO.translation_m, was.X_FO.translation_m);
      EXPECT_EQ(is.mesh_hash, was.mesh_hash);
      ++carried_at_times;
    }
  }
  EXPECT_GT(carried_at_times, 20U);
}

TEST_F(Carrying, AnAttachWaitsForTheMoveBeforeItAndARemoveEndsIt) {
  ChangeUnderWay move(*live_, make_command(WorkspaceOperation::kMove, "ball"), 8, {}, [] { return false; });
  EXPECT_FALSE(move.is_overtaken_by(attach("ball")));
  EXPECT_FALSE(move.is_overtaken_by(release("ball")));
  EXPECT_TRUE(move.is_overtaken_by(make_command(WorkspaceOperation::kRemove, "ball")));
  while (!move.wait(1.0)) {
  }
}

}  // namespace
}  // namespace phantom::wva_server
