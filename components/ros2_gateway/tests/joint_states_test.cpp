#include "components/ros2_gateway/joint_states.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace phantom::ros2_gateway {
namespace {

constexpr core::Nanoseconds kMs = core::kNsPerMillisecond;
constexpr core::Nanoseconds kUtcOffset = 1'790'000'000 * core::kNsPerSecond;

robot::SerialArm two_joints() {
  std::vector<robot::DhRow> rows(2);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i] = {.link = "link_" + std::to_string(i),
               .joint = i == 0 ? "shoulder" : "elbow",
               .a_m = 0.5,
               .lower = -2.0,
               .upper = 2.0,
               .max_speed = 2.0,
               .max_effort = 50.0};
  }
  return robot::SerialArm::from_dh(rows, robot::DhConvention::kClassic, {}).value();
}

struct Bench {
  explicit Bench(JointStatesRules rules = {}) : joints(two_joints(), {"shoulder_pan", "elbow"}, rules) {}

  core::Expected<bool> send(std::vector<std::string> name, std::vector<double> position,
                            std::vector<double> velocity, core::Nanoseconds at_ns,
                            std::optional<core::Nanoseconds> stamp_ns = std::nullopt) {
    return joints.accept({.stamp_ns = stamp_ns.value_or(kUtcOffset + at_ns),
                          .name = name,
                          .position = position,
                          .velocity = velocity},
                         at_ns, kUtcOffset + at_ns, state);
  }
  std::string refusal(std::vector<std::string> name, std::vector<double> position,
                      std::vector<double> velocity = {}, core::Nanoseconds stamp_age_ns = 0) {
    clock_ns += kMs;
    const auto done = send(name, position, velocity, clock_ns, kUtcOffset + clock_ns - stamp_age_ns);
    return done ? "" : done.status().message();
  }

  JointStates joints;
  messages::SlaveState state;
  core::Nanoseconds clock_ns = 1000 * kMs;
};

const std::vector<std::string> kBoth{"elbow", "gripper", "shoulder_pan"};

TEST(JointStates, AreTakenByNameInWhateverOrder) {
  Bench bench;
  const auto done = bench.send(kBoth, {0.2, 9.0, -0.4}, {0.02, 9.0, -0.04}, 1000 * kMs);
  ASSERT_TRUE(done) << done.status().message();
  ASSERT_TRUE(*done);
  EXPECT_EQ(bench.state.joint_count, 2U);
  EXPECT_EQ(bench.state.position[0], -0.4);
  EXPECT_EQ(bench.state.position[1], 0.2);
  EXPECT_EQ(bench.state.velocity[0], -0.04);
  EXPECT_EQ(bench.state.velocity[1], 0.02);
  // Two links of 0.5 m in a plane: the tip moves at |w1 + w2| L from the elbow, and w1 carries the elbow.
  const double w1 = -0.04, w12 = -0.02, q1 = -0.4, q12 = -0.2;
  const double vx = -0.5 * (w1 * std::sin(q1) + w12 * std::sin(q12));
  const double vy = 0.5 * (w1 * std::cos(q1) + w12 * std::cos(q12));
  EXPECT_NEAR(bench.state.tool_speed_m_s, std::hypot(vx, vy), 1e-12);
}

// Tries ros2_gateway: a joint of the arm is in no message; not heard for `staleness_s`
TEST(JointStates, OfSeveralPublishersAreOneArm) {
  Bench bench;
  EXPECT_FALSE(*bench.send({"shoulder_pan"}, {0.1}, {0.0}, 1000 * kMs)) << "the elbow was never heard";
  EXPECT_EQ(bench.joints.missing(1000 * kMs), "elbow");
  EXPECT_TRUE(*bench.send({"elbow"}, {0.3}, {0.0}, 1001 * kMs));
  EXPECT_EQ(bench.joints.missing(1001 * kMs), "");
  EXPECT_FALSE(*bench.send({"gripper"}, {0.3}, {0.0}, 1002 * kMs)) << "nothing of this arm is in it";
  EXPECT_FALSE(*bench.send({"elbow"}, {0.3}, {0.0}, 1110 * kMs)) << "the shoulder is stale";
  EXPECT_EQ(bench.joints.missing(1110 * kMs), "shoulder_pan");
}

// Tries ros2_gateway: a message with a number that is none
// Tries ros2_gateway: a position beyond the joint's limits
// Tries ros2_gateway: lists of different lengths
// Tries ros2_gateway: a stamp farther from this host's clock than `largest_stamp_age_s`
TEST(JointStates, AreRefusedWithTheReason) {
  using testing::HasSubstr;
  Bench bench;
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_THAT(bench.refusal({"elbow", "shoulder_pan"}, {0.1}), HasSubstr("2 names with 1 positions"));
  EXPECT_THAT(bench.refusal({"elbow"}, {0.1}, {0.1, 0.2}), HasSubstr("2 velocities"));
  EXPECT_THAT(bench.refusal({"elbow"}, {nan}), HasSubstr("position of elbow is nan"));
  EXPECT_THAT(bench.refusal({"elbow"}, {-inf}), HasSubstr("position of elbow is -inf"));
  EXPECT_THAT(bench.refusal({"elbow"}, {2.3}),
              HasSubstr("outside of the joint's range -2.000000 to 2.000000"));
  EXPECT_EQ(bench.refusal({"elbow"}, {2.15}), "") << "pushed onto its stop";
  EXPECT_THAT(bench.refusal({"elbow"}, {0.1}, {inf}), HasSubstr("velocity of elbow"));
  EXPECT_EQ(bench.refusal({"gripper"}, {nan}), "") << "no joint of this arm";
  EXPECT_THAT(bench.refusal({"elbow"}, {0.1}, {}, 600 * kMs), HasSubstr("0.6 s old"));
  EXPECT_THAT(bench.refusal({"elbow"}, {0.1}, {}, -600 * kMs), HasSubstr("0.6 s in the future"));
}

TEST(JointStates, OfARefusedMessageNothingIsTaken) {
  Bench bench;
  ASSERT_TRUE(*bench.send(kBoth, {0.2, 0.0, -0.4}, {0.0, 0.0, 0.0}, 1000 * kMs));
  EXPECT_FALSE(bench.send(kBoth, {0.9, 0.0, 7.0}, {0.0, 0.0, 0.0}, 1001 * kMs).has_value());
  ASSERT_TRUE(*bench.send({"shoulder_pan"}, {-0.4}, {0.0}, 1002 * kMs));
  EXPECT_EQ(bench.state.position[1], 0.2);
}

// Tries ros2_gateway: a second publisher of a joint
TEST(JointStates, OfAJointComeFromOnePublisherAtATime) {
  Bench bench;
  const std::vector<std::string> name{"elbow", "shoulder_pan"};
  const auto send = [&](std::uint8_t publisher, double elbow, core::Nanoseconds at_ns) {
    const std::vector<double> position{elbow, 0.0};
    return bench.joints.accept({.stamp_ns = kUtcOffset + at_ns,
                                .publisher = {publisher},
                                .name = name,
                                .position = position,
                                .velocity = {}},
                               at_ns, kUtcOffset + at_ns, bench.state);
  };
  ASSERT_TRUE(send(1, 0.1, 1000 * kMs));
  const auto second = send(2, 1.5, 1010 * kMs);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.status().message(), testing::HasSubstr("another publisher sends elbow, too"));
  ASSERT_TRUE(*send(1, 0.2, 1020 * kMs));
  EXPECT_EQ(bench.state.position[1], 0.2);
  ASSERT_TRUE(*send(2, 1.5, 1200 * kMs)) << "the first is silent";
  EXPECT_EQ(bench.state.velocity[1], 0.0) << "nothing is differentiated across two robots";
}

// Tries ros2_gateway: a stamp that is not newer than the last of that joint
TEST(JointStates, ComeInOrderAndASetClockIsAcceptedAfterARun) {
  Bench bench({.largest_stamp_age_s = 0.0});
  const auto send = [&](double position, core::Nanoseconds stamp_ns) {
    bench.clock_ns += kMs;
    return bench.send(kBoth, {position, 0.0, 0.0}, {}, bench.clock_ns, stamp_ns).has_value();
  };
  ASSERT_TRUE(send(0.1, 5000 * kMs));
  EXPECT_FALSE(send(0.5, 5000 * kMs)) << "the same once more";
  EXPECT_FALSE(send(0.5, 4999 * kMs)) << "overtaken on the way";
  EXPECT_TRUE(send(0.2, 5001 * kMs));
  for (int i = 1; i < JointStates::kRun; ++i) EXPECT_FALSE(send(0.3, i * kMs)) << i;
  EXPECT_TRUE(send(0.3, 100 * kMs)) << "a simulation was started anew";
  EXPECT_EQ(bench.state.velocity[1], 0.0) << "nothing is differentiated across it";
  EXPECT_TRUE(send(0.3, 101 * kMs));
}

TEST(JointStates, GivePositionsADerivativeWithTheStatedLag) {
  constexpr double kFilter_s = 0.01, kPeriod_s = 0.004;
  Bench bench({.velocity_filter_s = kFilter_s});
  const double amplitude = 0.5, omega = 2.0;
  double worst = 0.0, worst_without_lag = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const double t_s = i * kPeriod_s;
    const core::Nanoseconds at_ns = 1000 * kMs + core::from_seconds(t_s);
    ASSERT_TRUE(*bench.send(kBoth, {amplitude * std::sin(omega * t_s), 0.0, 0.0}, {}, at_ns));
    if (t_s < 0.2) continue;
    const double lag_s = kFilter_s + 0.5 * kPeriod_s;
    const auto truth = [&](double at_s) { return amplitude * omega * std::cos(omega * at_s); };
    worst = std::max(worst, std::abs(bench.state.velocity[1] - truth(t_s - lag_s)));
    worst_without_lag = std::max(worst_without_lag, std::abs(bench.state.velocity[1] - truth(t_s)));
  }
  EXPECT_LT(worst, 0.002);
  EXPECT_GT(worst_without_lag, 0.015) << "the lag that is stated is there";
}

TEST(JointStates, WithoutStampsAreJudgedByArrival) {
  Bench bench;
  for (int i = 0; i <= 20; ++i)
    ASSERT_TRUE(*bench.send(kBoth, {0.001 * i, 0.0, 0.0}, {}, 1000 * kMs + i * 10 * kMs, 0));
  EXPECT_NEAR(bench.state.velocity[1], 0.1, 1e-3);
  ASSERT_TRUE(*bench.send(kBoth, {0.5, 0.0, 0.0}, {}, 2000 * kMs, 0));
  EXPECT_EQ(bench.state.velocity[1], 0.0) << "how it moved in the gap is not known";
}

TEST(JointStates, WhateverComesLeavesAFiniteStateWithinTheLimits) {
  Bench bench;
  std::mt19937 random(7);
  const std::vector<double> odd{0.0, 1.9, -2.0, 2.05, 3.0, 1e308, std::nan(""), INFINITY, -INFINITY, 5e-324};
  const std::vector<std::string> names{"elbow", "shoulder_pan", "elbow", "", "gripper"};
  const auto some = [&](const auto& list) {
    std::remove_cvref_t<decltype(list)> chosen;
    for (std::size_t i = random() % 4; i > 0; --i) chosen.push_back(list[random() % list.size()]);
    return chosen;
  };
  int complete = 0;
  for (int i = 0; i < 20000; ++i) {
    bench.clock_ns += static_cast<core::Nanoseconds>(random() % 20) * kMs;
    const core::Nanoseconds stamp_ns =
        random() % 8 == 0 ? static_cast<core::Nanoseconds>(random()) : kUtcOffset + bench.clock_ns;
    const auto done = bench.send(some(names), some(odd), some(odd), bench.clock_ns, stamp_ns);
    if (!done || !*done) continue;
    ++complete;
    for (int j = 0; j < 2; ++j) {
      EXPECT_LE(std::abs(bench.state.position[j]), 2.2);
      EXPECT_TRUE(std::isfinite(bench.state.velocity[j]));
    }
  }
  EXPECT_GT(complete, 30);
}

}  // namespace
}  // namespace phantom::ros2_gateway
