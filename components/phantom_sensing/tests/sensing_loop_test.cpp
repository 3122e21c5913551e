// The watchdog, the order of things and the hand-over of workspaces, on a clock that the test turns.
#include "components/phantom_sensing/sensing_loop.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <semaphore>
#include <thread>

#include "common/workspace/brick_codec.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::phantom_sensing::sensing_loop_test {
namespace {

using core::kNsPerMillisecond;
using rig::send;

struct Seen : PerceptSink {
  struct Drag {
    bool valid;
    double coefficient;
    std::uint64_t slave, master, version;
    double age_s;
  };
  std::vector<Drag> drags;
  std::vector<bool> percepts;  // valid
  std::vector<PerceptCondition> conditions;
  std::size_t allowed = 0, muted = 0;
  core::SampleId gripper;
  std::vector<std::pair<std::uint32_t, bool>> alerts;
  void on_drag(const StepOutputs& out, const TickInfo& info) override {
    drags.push_back({out.valid, out.drag.plus[0], info.slave.stamp.sequence_number,
                     info.slave.master_echo.sequence_number, out.workspace_version, info.model_age_s});
    conditions.push_back(info.condition);
    allowed = info.allowed_contacts;
    muted = out.muted_sensors;
    gripper = info.gripper;
  }
  void on_percept(const StepOutputs& out, const TickInfo&) override { percepts.push_back(out.valid); }
  void on_alert(const percept::Alert& alert, bool cleared) override {
    alerts.emplace_back(alert.number, cleared);
  }
};

using phantom::test::eventually;

class Loop : public testing::Test {
 protected:
  void give_workspace(std::uint64_t version = 1) {
    send(rig::wall(), version, keeper_);
    ASSERT_TRUE(eventually([&] { return keeper_.version() == version; }));
  }
  void offer(std::uint64_t number, core::Nanoseconds at_ns, double x_m = 0.2, double speed_m_s = 0.3) {
    SlaveSample sample;
    sample.stamp = {number, at_ns, 77};
    sample.master_echo = {number + 1000, at_ns, 5};
    sample.received_ns = at_ns;
    sample.position[0] = x_m;
    sample.velocity[0] = speed_m_s;
    loop_.offer(sample);
  }

  std::atomic<int> refused_{0};  // counted on the keeper's thread
  PhantomModel model_ = rig::suspended_model();
  Config config_;
  Seen seen_;
  WorkspaceSubscriber keeper_{{[this](const std::string&) { ++refused_; }}};
  SensingLoop loop_{model_, config_, keeper_, seen_};
};

// Tries phantom_sensing: no workspace yet; no slave state yet
TEST_F(Loop, SaysInvalidFromTheStartAndKeepsSayingSo) {
  loop_.turn(1);
  ASSERT_EQ(seen_.drags.size(), 1U);
  EXPECT_FALSE(seen_.drags[0].valid);
  EXPECT_EQ(seen_.drags[0].coefficient, 0.0);
  EXPECT_EQ(seen_.drags[0].slave, 0U);
  EXPECT_EQ(loop_.watchdog_period_ns(), 10 * kNsPerMillisecond);
  loop_.turn(1 + loop_.watchdog_period_ns());
  EXPECT_EQ(seen_.drags.size(), 2U);
  EXPECT_FALSE(seen_.percepts.empty());
  EXPECT_FALSE(seen_.percepts[0]);
}

// Tries phantom_sensing: no workspace yet
TEST_F(Loop, AStateWithoutAWorkspaceIsInvalid) {
  offer(1, 100);
  loop_.turn(200);
  ASSERT_EQ(seen_.drags.size(), 1U);
  EXPECT_FALSE(seen_.drags[0].valid);
  EXPECT_EQ(seen_.drags[0].version, 0U);
}

TEST_F(Loop, EachStateGivesOneTickWithItsEchoes) {
  give_workspace();
  for (std::uint64_t i = 1; i <= 5; ++i) {
    const auto now = static_cast<core::Nanoseconds>(i) * kNsPerMillisecond;
    offer(i, now);
    loop_.turn(now + 50'000);
    loop_.turn(now + 60'000);  // nothing new: nothing said
  }
  ASSERT_EQ(seen_.drags.size(), 5U);
  for (std::uint64_t i = 1; i <= 5; ++i) {
    EXPECT_TRUE(seen_.drags[i - 1].valid);
    EXPECT_GT(seen_.drags[i - 1].coefficient, 0.0);
    EXPECT_EQ(seen_.drags[i - 1].slave, i);
    EXPECT_EQ(seen_.drags[i - 1].master, i + 1000);
    EXPECT_DOUBLE_EQ(seen_.drags[i - 1].age_s, 50e-6);
    EXPECT_EQ(seen_.drags[i - 1].version, 1U);
  }
}

// Tries phantom_sensing: depth cameras watch the workspace, but not the space around the place
TEST_F(Loop, SR29_APerceptInSpaceThatNoCameraSeesSaysSo) {
  give_workspace();
  core::Nanoseconds now_ns = kNsPerMillisecond;
  std::uint64_t number = 0;
  const auto condition = [&](core::Nanoseconds passed_ns) {
    now_ns += passed_ns;
    offer(++number, now_ns);
    loop_.turn(now_ns);
    EXPECT_TRUE(seen_.drags.back().valid);
    return seen_.conditions.back();
  };
  EXPECT_EQ(condition(0), PerceptCondition::kFresh) << "no camera watches";
  messages::SpaceView view;
  view.origin_m = {-10.0, -10.0, -10.0};
  view.cube_m = 20.0;
  view.size_x = view.size_y = view.size_z = 1;
  view.ages = {messages::kSpaceNeverSeen};
  loop_.know_seen(SeenSpace(view, now_ns));
  EXPECT_EQ(condition(kNsPerMillisecond), PerceptCondition::kSpaceUnseen);
  view.ages = {1};
  loop_.know_seen(SeenSpace(view, now_ns));
  EXPECT_EQ(condition(kNsPerMillisecond), PerceptCondition::kSpaceUnseen) << "for a second more";
  EXPECT_EQ(condition(core::kNsPerSecond), PerceptCondition::kFresh);
  EXPECT_EQ(condition(3 * core::kNsPerSecond), PerceptCondition::kSpaceUnseen) << "nothing was heard for 3 s";
}

/// In free space, of which only that around the tip was never seen.
TEST_F(Loop, InFreeSpaceTheInterestPointThatIsOrWasFastestIsLookedAt) {
  give_workspace();
  PhantomModel with_points = rig::suspended_model();
  with_points.interest_points = {{"carriage", 1, {0.05, 0, 0}}, {"tip", 7, {0, 0, 0}}};
  robot::LinkPoses X_WL;
  with_points.arm.link_poses({-0.5}, X_WL);
  messages::SpaceView view;
  view.cube_m = 0.2;
  view.origin_m = messages::vector_of(X_WL[7].translation_m - Eigen::Vector3d::Constant(0.1));
  view.size_x = view.size_y = view.size_z = 1;
  view.ages = {messages::kSpaceNeverSeen};
  /// The condition after the arm has moved like this, 2 s each.
  struct Motion {
    double sliding_m_s, turning_rad_s;
  };
  const auto condition = [&](double max_view_age_s, const std::vector<Motion>& motions) {
    Config config;
    config.max_view_age_s = max_view_age_s;
    SensingLoop loop(with_points, config, keeper_, seen_);
    std::uint64_t number = 0;
    for (const Motion& motion : motions) {
      SlaveSample sample;
      sample.stamp = {++number, static_cast<core::Nanoseconds>(2 * number) * core::kNsPerSecond, 77};
      sample.received_ns = sample.stamp.monotonic_ns;
      sample.position[0] = -0.5;  // far from the wall
      sample.velocity[0] = motion.sliding_m_s, sample.velocity[2] = motion.turning_rad_s;
      loop.know_seen(SeenSpace(view, sample.received_ns));
      loop.offer(sample);
      loop.turn(sample.received_ns);
    }
    return seen_.conditions.back();
  };
  using enum PerceptCondition;
  const Motion rest{0.0, 0.0}, slides{0.1, 0.0}, turns{0.0, 0.3}, trembles{0.0, 0.001};
  EXPECT_EQ(condition(3.0, {turns}), kSpaceUnseen);
  EXPECT_EQ(condition(0.0, {turns}), kFresh) << "that is not to be said";
  EXPECT_EQ(condition(3.0, {rest}), kSpaceUnseen) << "the arm's tip, if none has moved yet";
  EXPECT_EQ(condition(3.0, {slides, trembles}), kFresh) << "it stands, but for its noise";
  EXPECT_EQ(condition(3.0, {turns, rest, rest}), kSpaceUnseen) << "it stands where no camera sees";
  with_points.interest_points.clear();
  EXPECT_EQ(condition(3.0, {slides}), kSpaceUnseen) << "or if there is none";
}

TEST_F(Loop, TheNewestStateWins) {
  give_workspace();
  for (std::uint64_t i = 1; i <= 7; ++i) offer(i, 1000);
  loop_.turn(2000);
  ASSERT_EQ(seen_.drags.size(), 1U);
  EXPECT_EQ(seen_.drags[0].slave, 7U);
}

// Tries phantom_sensing: slave state older than
TEST_F(Loop, AStaleStateBecomesInvalidInBoundedTimeAndEndsTheAlert) {
  give_workspace();
  offer(1, kNsPerMillisecond);
  loop_.turn(kNsPerMillisecond);
  ASSERT_TRUE(seen_.drags.back().valid);
  const auto raised = seen_.alerts;  // of each link that is near
  ASSERT_FALSE(raised.empty());
  for (const auto& [number, cleared] : raised) EXPECT_FALSE(cleared);
  // The watchdog turns at its period; nothing else happens.
  core::Nanoseconds now = kNsPerMillisecond;
  const core::Nanoseconds staleness = core::from_seconds(config_.staleness_s);
  while (seen_.drags.back().valid) {
    now += loop_.watchdog_period_ns();
    ASSERT_LE(now, kNsPerMillisecond + staleness + loop_.watchdog_period_ns() + 1);
    loop_.turn(now);
  }
  EXPECT_GT(now, kNsPerMillisecond + staleness);
  EXPECT_EQ(seen_.drags.back().coefficient, 0.0);
  ASSERT_EQ(seen_.alerts.size(), 2 * raised.size());
  for (std::size_t i = 0; i < raised.size(); ++i)
    EXPECT_THAT(seen_.alerts, testing::Contains(std::pair(raised[i].first, true)));
  // And recovers with the next state.
  offer(2, now + 1);
  loop_.turn(now + 2);
  EXPECT_TRUE(seen_.drags.back().valid);
}

TEST_F(Loop, AStateThatWasStaleWhenItCameIsNotUsed) {
  give_workspace();
  offer(1, kNsPerMillisecond);
  loop_.turn(kNsPerMillisecond + core::from_seconds(config_.staleness_s) + 1);
  EXPECT_FALSE(seen_.drags.back().valid);
}

TEST_F(Loop, PerceptComesAtItsOwnRate) {
  give_workspace();
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    offer(i, static_cast<core::Nanoseconds>(i) * kNsPerMillisecond);
    loop_.turn(static_cast<core::Nanoseconds>(i) * kNsPerMillisecond);
  }
  EXPECT_EQ(seen_.drags.size(), 1000U);
  EXPECT_NEAR(static_cast<double>(seen_.percepts.size()), 100.0, 1.0);
}

TEST_F(Loop, CountsWhatItDoes) {
  give_workspace();
  loop_.turn(1);
  offer(1, 2 * kNsPerMillisecond);
  loop_.turn(2 * kNsPerMillisecond);
  loop_.turn(3 * kNsPerMillisecond + 500 * kNsPerMillisecond);
  const LoopFigures figures = loop_.figures();
  EXPECT_EQ(figures.ticks, 1U);
  EXPECT_EQ(figures.invalid_turns, 2U);
  EXPECT_TRUE(figures.state_seen);
  EXPECT_EQ(figures.condition, PerceptCondition::kStateStale);
}

// Tries phantom_sensing: no slave state yet
TEST_F(Loop, SaysWhyThereIsNoPercept) {
  loop_.turn(1);
  EXPECT_EQ(seen_.conditions.back(), PerceptCondition::kNoWorkspace);
  give_workspace();
  loop_.turn(1 + loop_.watchdog_period_ns());
  EXPECT_EQ(seen_.conditions.back(), PerceptCondition::kNoState);
  offer(1, core::kNsPerSecond);
  loop_.turn(core::kNsPerSecond);
  EXPECT_EQ(seen_.conditions.back(), PerceptCondition::kFresh);
  loop_.turn(2 * core::kNsPerSecond);
  EXPECT_EQ(seen_.conditions.back(), PerceptCondition::kStateStale);
  EXPECT_FALSE(seen_.drags.back().valid);
}

// Tries phantom_sensing: a version is announced
TEST_F(Loop, APerceptFromAStaleWorkspaceIsMarkedAndThenEnds) {
  give_workspace(1);
  std::uint64_t number = 0;
  const auto at = [&](double t_s) {
    offer(++number, core::from_seconds(t_s));
    loop_.turn(core::from_seconds(t_s));
    return seen_.conditions.back();
  };
  EXPECT_EQ(at(1.0), PerceptCondition::kFresh);
  keeper_.commit({}, {2, rig::wall().grid(), rig::wall().palette(), 1000, 77});
  ASSERT_TRUE(eventually([&] { return keeper_.announced() == 2; }));  // and its bricks do not come
  EXPECT_EQ(at(2.0), PerceptCondition::kFresh);
  EXPECT_EQ(at(2.9), PerceptCondition::kFresh);
  EXPECT_EQ(at(3.1), PerceptCondition::kWorkspaceBehind);
  EXPECT_TRUE(seen_.drags.back().valid) << "marked, and still felt";
  EXPECT_EQ(at(6.9), PerceptCondition::kWorkspaceBehind);
  EXPECT_EQ(at(7.1), PerceptCondition::kWorkspaceStale);
  EXPECT_FALSE(seen_.drags.back().valid);
  EXPECT_EQ(seen_.drags.back().coefficient, 0.0);
  EXPECT_EQ(seen_.drags.back().version, 1U);
  give_workspace(3);
  EXPECT_EQ(at(8.0), PerceptCondition::kFresh);
  EXPECT_TRUE(seen_.drags.back().valid);
}

// Tries phantom_sensing: wva_server ends
TEST_F(Loop, AWorkspaceWithoutItsServerStaysValidAndIsMarked) {
  give_workspace();
  loop_.workspace_watch().attended(false);
  offer(1, 1000);
  loop_.turn(1000);
  EXPECT_EQ(seen_.conditions.back(), PerceptCondition::kWorkspaceUnattended);
  EXPECT_TRUE(seen_.drags.back().valid);
}

// Tries phantom_sensing: a self-test fails while running
TEST_F(Loop, AFailedSelfTestEndsThePerceptUntilOnePasses) {
  give_workspace();
  loop_.self_tested(false);
  offer(1, 1000);
  loop_.turn(1000);
  EXPECT_EQ(seen_.conditions.back(), PerceptCondition::kSelfTestFailed);
  EXPECT_FALSE(seen_.drags.back().valid);
  loop_.self_tested(true);
  offer(2, 2000);
  loop_.turn(2000);
  EXPECT_TRUE(seen_.drags.back().valid);
}

TEST_F(Loop, APermitMutesUntilItsTimeIsOver) {
  give_workspace();
  ContactPermits permits;
  permits.allow({1, percept::AllowedContact::kWholeArm, 5 * kNsPerMillisecond});
  loop_.permit(permits);
  offer(1, 4 * kNsPerMillisecond);
  loop_.turn(4 * kNsPerMillisecond);
  EXPECT_EQ(seen_.drags.back().coefficient, 0.0);
  EXPECT_TRUE(seen_.drags.back().valid);
  EXPECT_EQ(seen_.allowed, 1U);
  EXPECT_GT(seen_.muted, 0U);
  offer(2, 5 * kNsPerMillisecond);
  loop_.turn(5 * kNsPerMillisecond);
  EXPECT_GT(seen_.drags.back().coefficient, 0.0);
  EXPECT_EQ(seen_.allowed, 0U);
  EXPECT_EQ(seen_.muted, 0U);
}

TEST_F(Loop, RunsOnItsOwnThreadAndEnds) {
  give_workspace();
  std::thread thread([&] { loop_.run(); });
  offer(1, core::monotonic_ns());
  EXPECT_TRUE(eventually([&] { return loop_.figures().invalid_turns > 0 || loop_.figures().ticks > 0; }));
  loop_.stop();
  thread.join();
  EXPECT_GE(seen_.drags.size(), 1U);
}

TEST(ElapsedS, StaysWithinASecondWhateverTheWriterSays) {
  constexpr auto kMin = std::numeric_limits<std::int64_t>::min();
  constexpr auto kMax = std::numeric_limits<std::int64_t>::max();
  const auto at = [](std::uint64_t number, std::int64_t monotonic_ns, std::uint64_t session = 5) {
    SlaveSample sample;
    sample.stamp = {number, monotonic_ns, session};
    return sample;
  };
  EXPECT_DOUBLE_EQ(elapsed_s(at(1, 1'000'000), at(2, 3'000'000)), 0.002);
  EXPECT_EQ(elapsed_s(at(1, kMin), at(2, kMax)), 1.0);
  EXPECT_EQ(elapsed_s(at(1, kMax), at(2, kMin)), 0.0);
  EXPECT_EQ(elapsed_s(at(1, 1'000'000), at(2, 3'000'000, 6)), 0.0) << "the writer was restarted";
}

TEST_F(Loop, AnOldWorkspaceIsLetGoOnlyWhenTheTickHasMovedOn) {
  give_workspace(1);
  const workspace::Workspace* first = keeper_.newest().voxels;
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->version, 1U);
  send(rig::wall(), 2, keeper_);
  ASSERT_TRUE(eventually([&] { return keeper_.version() == 2; }));
  EXPECT_EQ(first->version, 1U);  // still ours to read
  EXPECT_TRUE(eventually([&] { return keeper_.versions_kept() == 2; }));
  const workspace::Workspace* second = keeper_.newest().voxels;
  EXPECT_EQ(second->version, 2U);
  EXPECT_TRUE(eventually([&] { return keeper_.versions_kept() == 1; }));
}

// Tries phantom_sensing: a brick that cannot be decoded
TEST_F(Loop, ABrickThatIsNoneIsRefusedAndTheWorkspaceStays) {
  give_workspace(1);
  keeper_.put_brick({}, {0, 0, 0}, 2, {1, 2, 3});
  send(rig::wall(), 3, keeper_);
  ASSERT_TRUE(eventually([&] { return keeper_.version() == 3; }));
  EXPECT_TRUE(eventually([&] { return refused_ == 1; }));
}

// Tries phantom_sensing: that cannot be one (voxel size … sent before
TEST_F(Loop, AVersionThatIsRefusedTakesNoPerceptAway) {
  give_workspace(4);
  workspace::VersionDescription bad{5, rig::wall().grid(), rig::wall().palette(), 1, 1};
  bad.grid.voxel_size_m = std::nan("");
  keeper_.commit({}, bad);
  bad = {3, rig::wall().grid(), rig::wall().palette(), 1, 1};  // lower than what its server said before
  keeper_.commit({}, bad);
  ASSERT_TRUE(eventually([&] { return refused_ == 2; }));
  for (std::uint64_t i = 1; i <= 20; ++i) {
    const core::Nanoseconds now_ns = core::from_seconds(static_cast<double>(i));
    offer(i, now_ns);
    loop_.turn(now_ns);
    ASSERT_EQ(seen_.conditions.back(), PerceptCondition::kFresh) << i << " s";
  }
}

// Tries phantom_sensing: a second process sends a workspace
TEST_F(Loop, ASecondServerIsSetAsideWhileTheFirstIsThere) {
  constexpr workspace::SourceId kOther{7};
  give_workspace(4);
  send(rig::wall(), 9, keeper_, kOther);
  ASSERT_TRUE(eventually([&] { return keeper_.contested(); }));
  send(rig::wall(), 5, keeper_);
  ASSERT_TRUE(eventually([&] { return keeper_.version() == 5; }));
  EXPECT_EQ(keeper_.announced(), 5U);
  EXPECT_EQ(keeper_.source(), workspace::SourceId{});
  for (std::uint64_t i = 1; i <= 20; ++i) {
    const core::Nanoseconds now_ns = core::from_seconds(static_cast<double>(i));
    offer(i, now_ns);
    loop_.turn(now_ns);
    ASSERT_EQ(seen_.conditions.back(), PerceptCondition::kFresh) << i << " s";
    ASSERT_EQ(seen_.drags.back().version, 5U);
  }
  keeper_.gone({});
  EXPECT_TRUE(eventually([&] { return keeper_.version() == 9; }));
  EXPECT_EQ(keeper_.source(), kOther);
  EXPECT_FALSE(keeper_.contested());
}

// Tries phantom_sensing: or one that does not know its width
TEST_F(Loop, FingersAreSensedAtTheWidthThatIsHeardAndAtTheirWidestWhileNoneIs) {
  auto& skin = model_.skin;
  skin.closing_m.assign(skin.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = skin.first[7]; i < skin.first[8]; ++i) skin.closing_m[i].x() = -0.08;
  SensingLoop loop(model_, config_, keeper_, seen_);
  give_workspace();
  const core::Nanoseconds stale_ns = core::from_seconds(config_.staleness_s);
  core::Nanoseconds now_ns = 1'000'000'000;
  std::uint64_t number = 0;
  const auto felt = [&] {
    SlaveSample sample;
    sample.stamp = {++number, now_ns, 77};
    sample.received_ns = now_ns;
    sample.position[0] = 0.15;
    sample.velocity[0] = 0.1;
    loop.offer(sample);
    loop.turn(now_ns);
    return seen_.drags.back().coefficient;
  };
  const auto hear = [&](double width_m, bool known = true) {
    messages::GripperState gripper;
    gripper.stamp = {++number, now_ns, 78};
    gripper.sense = {.known = known, .width_m = width_m};
    gripper.widest_m = 0.1;
    loop.offer(GripperSample(gripper, now_ns));
  };
  const double widest = felt();
  EXPECT_GT(widest, 0.0);
  EXPECT_EQ(seen_.gripper, core::SampleId{});
  hear(0.0);
  const double closed = felt();
  EXPECT_LT(closed, widest) << "closed fingers are farther from the wall";
  EXPECT_EQ(seen_.gripper.sequence_number, number - 1);
  hear(0.1);
  EXPECT_EQ(felt(), widest);
  hear(0.0);
  EXPECT_EQ(felt(), closed);
  now_ns += stale_ns;
  EXPECT_EQ(felt(), closed);
  now_ns += 1;
  EXPECT_EQ(felt(), widest) << "stale";
  EXPECT_EQ(seen_.gripper, core::SampleId{});
  hear(0.0);
  EXPECT_EQ(felt(), closed);
  hear(0.0, false);
  EXPECT_EQ(felt(), widest) << "its drive has not reported";
}

}  // namespace
}  // namespace phantom::phantom_sensing::sensing_loop_test
