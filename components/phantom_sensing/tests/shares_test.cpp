// A skin that several processes share is felt exactly as one process feels it, however they come and go.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>

#include "common/core/errors.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/phantom_sensing/tests/shares_rig.hpp"
#include "components/phantom_sensing/workspace/share_inbox.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/files.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing {
namespace {

using rig::balls, rig::random_inputs, rig::share_of, rig::shared_model;
using testing::HasSubstr;

/// The suspended arm with sensors that read zones on two of its links, which both point into one layer.
PhantomModel clustered(PhantomModel model) {
  auto parts = robot::test_worlds::tubes();
  parts[3].segments[0].cluster = robot::ClusterSpec{2, robot::ClusterShape::kSphere};
  parts[5].segments[0].cluster = robot::ClusterSpec{1, robot::ClusterShape::kCube};
  model.skin = *robot::lay_out_skin(model.arm, parts, {.voxel_size_m = 0.01});
  return model;
}

void expect_same_percept(const StepOutputs& a, const StepOutputs& b) {
  EXPECT_EQ(a.valid, b.valid);
  EXPECT_EQ(a.percept.mu, b.percept.mu);
  EXPECT_EQ(a.percept.sensor, b.percept.sensor);
  EXPECT_EQ(a.percept.link, b.percept.link);
  EXPECT_EQ(a.percept.object, b.percept.object);
  EXPECT_EQ(a.percept.position_W_m, b.percept.position_W_m);
  EXPECT_EQ(a.percept.gradient.pgv_W_m, b.percept.gradient.pgv_W_m);
  EXPECT_EQ(a.percept.velocity_W_m_s, b.percept.velocity_W_m_s);
  EXPECT_EQ(a.percept.motion, b.percept.motion);
  EXPECT_EQ(a.percept.rule, b.percept.rule);
  EXPECT_EQ(a.muted_sensors, b.muted_sensors);
  EXPECT_EQ(a.worst.mu, b.worst.mu);
  EXPECT_EQ(a.worst.sensor, b.worst.sensor);
  const auto threats = [](const StepOutputs& out) {
    std::vector<std::tuple<std::size_t, std::size_t, std::uint16_t, double, percept::HitRule, bool>> all;
    for (const Threat& threat : out.threats)
      all.emplace_back(threat.link, threat.sensor, threat.object, threat.contact.time_s, threat.rule,
                       threat.raises);
    return all;
  };
  EXPECT_EQ(threats(a), threats(b));
  const auto numbers = [](const auto& alerts) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
    for (const percept::Alert& alert : alerts) all.emplace_back(alert.number, alert.at.link);
    return all;
  };
  EXPECT_EQ(numbers(a.alerts.raised), numbers(b.alerts.raised));
  EXPECT_EQ(numbers(a.alerts.cleared), numbers(b.alerts.cleared));
}

struct Law {
  bool directional, clusters, mutes;
};

class Shares : public testing::TestWithParam<Law> {};

// Tries phantom_sensing: the process of a share of the skin is not there, ends, or is late
TEST_P(Shares, SR20_AreFeltAsByOneProcessWhoeverSensesThem) {
  PerceptSettings settings;
  settings.directional.enabled = GetParam().directional;
  const auto made = [](PhantomModel model) {
    model.medium = {{.mu_Pa_s_per_m = 2.0, .current_m_s = {0.1, 0.0, -0.2}}};
    model.soft_bodies = {rig::soft_balls()};
    return GetParam().clusters ? clustered(std::move(model)) : std::move(model);
  };
  const PhantomModel one_model = made(rig::suspended_model()), arm_model = made(shared_model()),
                     upper_model = made(shared_model(0)), hand_model = made(shared_model(1));
  PhantomSensing one(one_model, settings), alone(arm_model, settings), arm(arm_model, settings),
      upper(upper_model, settings), hand(hand_model, settings);
  std::mt19937 random(7);
  int felt = 0, worst_elsewhere = 0, alerts = 0, pressed = 0;
  for (int trial = 0; trial < 300; ++trial) {
    StepInputs inputs = random_inputs(arm_model, random);
    if (GetParam().mutes) inputs.allowed.add(1, trial % 8);
    StepOutputs by_one, by_arm_alone, by_arm, of_upper, of_hand;
    one.step(inputs, by_one);
    alone.step(inputs, by_arm_alone);
    upper.step(inputs, of_upper);
    hand.step(inputs, of_hand);
    const SensedShare upper_share = share_of(of_upper), hand_share = share_of(of_hand);
    SensedShares shares{};
    if (trial % 4 != 1) shares[0] = &upper_share;  // now and then one is late, or both
    if (trial % 4 != 1 && trial % 4 != 2) shares[1] = &hand_share;
    {
      const test::HeapGuard guard;
      arm.begin(inputs, by_arm);
      const std::size_t here = arm.end(inputs, shares, by_arm);
      EXPECT_EQ(here, trial % 4 == 1 ? 2U : trial % 4 == 2 ? 1U : 0U);
    }
    expect_same_percept(by_arm, by_one);
    expect_same_percept(by_arm, by_arm_alone);
    EXPECT_EQ(by_arm.drag, by_arm_alone.drag) << "bit for bit, whoever senses the shares";
    EXPECT_EQ(by_arm.percept.drag_torque, by_arm_alone.percept.drag_torque);
    EXPECT_EQ(by_arm.reaction, by_arm_alone.reaction) << "of soft bodies, too";
    pressed += rig::expect_same_reaction(by_arm.reaction, by_one.reaction) ? 1 : 0;
    double greatest = 0.0;
    for (const double b : by_one.drag.coupled) greatest = std::max(greatest, b);
    for (std::size_t j = 0; j < core::kMaxJoints; ++j) {
      EXPECT_NEAR(by_arm.drag.plus[j], by_one.drag.plus[j], 1e-12 * greatest) << j;
      EXPECT_NEAR(by_arm.drag.minus[j], by_one.drag.minus[j], 1e-12 * greatest) << j;
      EXPECT_NEAR(by_arm.drag.drift[j], by_one.drag.drift[j], 1e-9) << j;
    }
    for (std::size_t i = 0; i < robot::kPackedMatrix; ++i)
      EXPECT_NEAR(by_arm.drag.coupled[i], by_one.drag.coupled[i], 1e-12 * greatest);
    EXPECT_NE(by_arm.drag.drift, core::JointArray{}) << "the current is felt";
    felt += by_one.percept.mu > 0.0 ? 1 : 0;
    worst_elsewhere += arm_model.shares[1].links[by_one.percept.link] ? 1 : 0;
    alerts += static_cast<int>(by_one.alerts.raised.size());
  }
  EXPECT_GT(felt, 150);
  EXPECT_GT(pressed, 20);
  EXPECT_GT(worst_elsewhere, 20);
  EXPECT_GT(alerts, 1);
}

INSTANTIATE_TEST_SUITE_P(Every, Shares,
                         testing::Values(Law{false, false, false}, Law{true, false, false},
                                         Law{true, true, false}, Law{false, true, true}));

TEST(Shares, AShareThatRestsOnOtherVoxelsIsSensedHere) {
  const PhantomModel model = shared_model();
  PhantomSensing arm(model, {}), twin(model, {});
  std::mt19937 random(3);
  StepOutputs out, expected;
  int refused = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const StepInputs inputs = random_inputs(model, random);
    twin.step(inputs, expected);
    // As of another workspace: a sensor that meets nothing of the kind here.
    SensedShare wrong{{}, 100.0F, model.skin.first[2] + static_cast<std::size_t>(trial), 0, {}};
    wrong.drag.plus[0] = 1e6;
    arm.begin(inputs, out);
    const std::size_t here = arm.end(inputs, {&wrong, nullptr}, out);
    if (here < 2) continue;  // it does happen to meet it
    ++refused;
    EXPECT_EQ(out.drag, expected.drag);
    expect_same_percept(out, expected);
  }
  EXPECT_GT(refused, 30);
  const StepInputs inputs = random_inputs(model, random);
  twin.step(inputs, expected);
  const SensedShare beyond{{}, 32.0F, model.skin.size(), 0, {}}, unknown{{}, 31.0F, 0, 0, {}};
  arm.begin(inputs, out);
  EXPECT_EQ(arm.end(inputs, {&beyond, &unknown}, out), 2U);
  EXPECT_EQ(out.drag, expected.drag);
}

TEST(Shares, OneProcessPerLinkAddsUpToTheSameWorstSensor) {
  const PhantomModel model = rig::suspended_model();
  robot::SkinSensing whole(model.skin, {.gradient = true}), parts(model.skin, {.gradient = true});
  std::mt19937 random(5);
  for (int trial = 0; trial < 50; ++trial) {
    robot::LinkPoses X_WL;
    model.arm.link_poses(random_inputs(model, random).position, X_WL);
    whole.sense(X_WL, 7, balls());
    parts.sense(X_WL, 7, balls(), {});
    EXPECT_FALSE(parts.worst().found);
    EXPECT_EQ(parts.active(), 0U);
    std::array<std::size_t, 7> order{1, 2, 3, 4, 5, 6, 7};
    std::shuffle(order.begin(), order.end(), random);
    for (const std::size_t link : order) parts.sense_also(X_WL, 7, balls(), robot::LinkSet().set(link));
    EXPECT_EQ(parts.worst().found, whole.worst().found);
    EXPECT_EQ(parts.worst().sensor, whole.worst().sensor);
    EXPECT_EQ(parts.worst().voxel, whole.worst().voxel);
    EXPECT_EQ(parts.active(), whole.active());
    for (std::size_t link = 1; link <= 7; ++link) {
      EXPECT_EQ(parts.sums()[link].mu_dd, whole.sums()[link].mu_dd);
      EXPECT_EQ(parts.sums()[link].gradient_moment, whole.sums()[link].gradient_moment);
    }
  }
}

class Inbox : public testing::Test {
 protected:
  static constexpr double kWait_s = 0.05;
  static ShareBasis basis(std::uint64_t number) {
    return {{number, 5, 7}, {}, 3, robot::DragMode::kSeparable};
  }
  void offer(std::uint64_t number, std::size_t share = 0) {
    messages::DragField field;
    field.slave_echo = {number, 5, 7};
    field.workspace_version = 3;
    field.drag.plus[0] = static_cast<double>(number);
    field.drag.valid = true;
    field.reaction.torque[1] = 2.0 * static_cast<double>(number);
    field.reaction.stiffness[1] = 7.0;
    messages::Percept percept;
    percept.slave_echo = field.slave_echo;
    percept.workspace_version = 3;
    percept.valid = true;
    percept.mu_Pa_s_per_m = 32.0;
    percept.sensor = 12;
    inbox_.offer(share, field);
    inbox_.offer(share, percept);
  }
  const std::vector<SkinShare> model_ = std::vector<SkinShare>{{"upper", {}}, {"hand", {}}};
  ShareInbox inbox_{model_, kWait_s};
};

TEST_F(Inbox, HandsOnWhatRestsOnTheSameAndNothingElse) {
  offer(4);
  const SensedShares sensed = inbox_.await(basis(4));
  ASSERT_NE(sensed[0], nullptr);
  EXPECT_EQ(sensed[0]->drag.plus[0], 4.0);
  EXPECT_EQ(sensed[0]->reaction.torque[1], 8.0);
  EXPECT_EQ(sensed[0]->reaction.stiffness[1], 7.0);
  EXPECT_EQ(sensed[0]->mu, 32.0F);
  EXPECT_EQ(sensed[0]->sensor, 12U);
  EXPECT_EQ(sensed[1], nullptr);
  const auto refused = [&](auto change) {
    offer(4);
    ShareBasis other = basis(4);
    change(other);
    return inbox_.await(other)[0] == nullptr;
  };
  EXPECT_FALSE(refused([](ShareBasis&) {}));
  EXPECT_TRUE(refused([](ShareBasis& b) { b.slave.sequence_number = 5; }));
  EXPECT_TRUE(refused([](ShareBasis& b) { b.slave.session = 8; }));
  EXPECT_TRUE(refused([](ShareBasis& b) { b.gripper.sequence_number = 1; }));
  EXPECT_TRUE(refused([](ShareBasis& b) { b.workspace_version = 4; }));
  EXPECT_TRUE(refused([](ShareBasis& b) { b.mode = robot::DragMode::kCoupled; }));
}

TEST_F(Inbox, WaitsForWhatComesAndNotLongerThanItMay) {
  offer(1, 0), offer(1, 1);
  const SensedShares first = inbox_.await(basis(1));
  ASSERT_TRUE(first[0] != nullptr && first[1] != nullptr);
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    offer(2, 0), offer(2, 1);
  });
  const SensedShares second = inbox_.await(basis(2));
  EXPECT_TRUE(second[0] != nullptr && second[1] != nullptr);
  later.join();
  const auto start_ns = core::monotonic_ns();
  const SensedShares third = inbox_.await(basis(3));
  const double took_s = core::seconds(core::monotonic_ns() - start_ns);
  EXPECT_TRUE(third[0] == nullptr && third[1] == nullptr);
  EXPECT_GE(took_s, 0.9 * kWait_s);
}

TEST_F(Inbox, DoesNotWaitForOneThatHasGoneAndTakesItAgainWhenItIsBack) {
  EXPECT_EQ(inbox_.resting(), 0b11U) << "until it has come";
  for (std::uint64_t n = 1; n <= 3; ++n) offer(n, 0), inbox_.await(basis(n));
  EXPECT_EQ(inbox_.resting(), 0b10U);
  std::uint64_t n = 4;
  for (std::uint32_t i = 0; i < ShareInbox::kMissesToRest; ++i) {
    EXPECT_FALSE(inbox_.resting()[0]);
    inbox_.await(basis(n++));
  }
  EXPECT_TRUE(inbox_.resting()[0]);
  const auto start_ns = core::monotonic_ns();
  for (std::uint32_t i = 0; i < ShareInbox::kRetryEvery; ++i) inbox_.await(basis(n++));
  EXPECT_LT(core::seconds(core::monotonic_ns() - start_ns), 10 * kWait_s) << "one retry in so many, not each";
  offer(n, 0);
  EXPECT_NE(inbox_.await(basis(n))[0], nullptr);
  EXPECT_FALSE(inbox_.resting()[0]);
}

TEST(SharePartitions, MeetOnlyWhoWouldSenseTheSame) {
  const PhantomModel model = shared_model();
  Config config;
  config.file = test::new_file("threads: 1\n");
  const auto names = share_partitions("hall/cell", config, model, {});
  ASSERT_EQ(names.size(), 2U);
  EXPECT_THAT(names[0], testing::MatchesRegex("hall/cell/skin-[0-9a-f]*-upper"));
  EXPECT_EQ(share_partitions("hall/cell", config, shared_model(1), {}), names);
  EXPECT_THAT(share_partitions("", config, model, {})[1], testing::StartsWith("skin-"));
  EXPECT_NE(share_partitions("hall/cell", config, clustered(shared_model()), {}), names);
  PhantomModel soft = shared_model();
  soft.soft_bodies = {rig::soft_balls()};
  EXPECT_NE(share_partitions("hall/cell", config, soft, {}), names);
  percept::AllowedContact contacts;
  contacts.add(3, 2);
  EXPECT_NE(share_partitions("hall/cell", config, model, contacts), names);
  config.file = test::new_file("threads: 2\n");
  EXPECT_NE(share_partitions("hall/cell", config, model, {}), names);
  EXPECT_TRUE(share_partitions("", config, rig::suspended_model(), {}).empty());
}

TEST(ShareConfig, NamesLinksOfTheArmAndOneOfTheSharesForAProcess) {
  const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  const auto config = [&](const std::string& shares) {
    return load_config(test::new_file("skin: {pitch_vox: 3}\nsharing: {shares: [" + shares + "]}"));
  };
  const auto refusal = [&](const Config& of) -> std::string {
    try {
      load_model(cell, of);
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "";
  };
  Config good = config("{name: hand, links: [tool]}");
  const PhantomModel model = load_model(cell, good);
  ASSERT_EQ(model.shares.size(), 1U);
  EXPECT_TRUE(model.shares[0].links[model.arm.joint_count()]);
  EXPECT_EQ(model.shares[0].links.count(), 1U);
  good.own_share = "hand";
  EXPECT_TRUE(load_model(cell, good).interest_points.empty()) << "the arm's process watches them";
  good.own_share = "foot";
  EXPECT_THAT(refusal(good), HasSubstr("--share: 'foot' is none of sharing.shares in"));
  EXPECT_THAT(refusal(good), HasSubstr("allowed: hand"));
  EXPECT_THAT(refusal(config("{name: a, links: [tail]}")), HasSubstr("'tail' is no moving link"));
  EXPECT_THAT(refusal(config("{name: a, links: [tool]}, {name: b, links: [gripper]}")),
              HasSubstr("'gripper' moves with a link that is named already"));
}

}  // namespace
}  // namespace phantom::phantom_sensing
