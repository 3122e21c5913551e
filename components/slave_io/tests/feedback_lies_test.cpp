// Drives with feedback that cannot be true, under the servo, on a clock of the test's own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "components/slave_io/tests/arm_bench.hpp"

namespace phantom::slave_io {
namespace {

using teleop::LinkState;
using testing::HasSubstr;
using Lie = std::function<void(simulated_drive::Misbehaviour&)>;

constexpr std::size_t kLyingJoint = 3;

struct LyingDrive {
  const char* name;
  Lie begin;
  const char* reason;  // part of the sentence for the operator
  double most_s;       // until it is found
  double most_rad;     // that the joint moves otherwise than its master, until it is found
};

const LyingDrive kLies[] = {
    {"stuck encoder", [](auto& m) { m.stuck_encoder = true; },
     "reports a constant position while its torque changed", 0.05, 0.05},
    {"mirrored encoder", [](auto& m) { m.mirrored_encoder = true; }, "more than its torque gave it", 0.1,
     0.15},
    {"random velocity", [](auto& m) { m.garbage_speed_rad_s = 20.0; }, "does not fit its position", 0.05,
     0.02},
    {"jump of 2^31 counts", [](auto& m) { m.count_jump = std::int64_t{1} << 31; }, "position that jumped by",
     0.01, 0.01},
    {"all frozen", [](auto& m) { m.frozen_feedback = true; }, "reports the same position and torque for", 0.2,
     0.1},
    {"negated velocity", [](auto& m) { m.negated_velocity = true; }, "does not fit its position", 0.06, 0.05},
};

class FeedbackLies : public testing::TestWithParam<LyingDrive> {};

// Tries slave_io: a drive with feedback that cannot be true
// Also where the drive has no greatest speed of its own (0x6080).
TEST_P(FeedbackLies, SR12_AreFoundBeforeTheJointRunsAwayAndNameJointAndReason) {
  const LyingDrive& lie = GetParam();
  ArmBench bench(can_config(), shipped_arm().home,
                 [](std::size_t, simulated_drive::DriveOptions& o) { o.keeps_max_speed = false; });
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  const double dt = bench.config.period_s, away = shipped_arm().home[kLyingJoint] > 0.0 ? -1.0 : 1.0;
  const auto lead = [&](double for_s, const std::function<bool()>& until) {
    double t = 0.0;
    for (; t < for_s && !until(); t += dt) {
      bench.master.velocity[kLyingJoint] = 0.4 * away;
      bench.master.position[kLyingJoint] += bench.master.velocity[kLyingJoint] * dt;
      bench.tick();
    }
    return t;
  };
  lead(0.5, [] { return false; });
  ASSERT_EQ(bench.state(), LinkState::kCoupled) << bench.arm->health().message;
  bench.fastest = 0.0;
  lie.begin(bench.drives[kLyingJoint]->misbehaviour);
  double off_rad = 0.0;
  const double found_s = lead(3.0, [&] {
    off_rad = std::max(off_rad, std::abs(bench.joint(kLyingJoint) - bench.master.position[kLyingJoint]));
    return bench.state() == LinkState::kStopped;
  });
  RecordProperty("found_ms", static_cast<int>(1e3 * found_s));
  RecordProperty("off_mrad", static_cast<int>(1e3 * off_rad));
  RecordProperty("fastest_percent", static_cast<int>(1e2 * bench.fastest));
  EXPECT_LE(found_s, lie.most_s);
  EXPECT_LE(off_rad, lie.most_rad);
  EXPECT_THAT(bench.arm->health().message, HasSubstr("j4_elbow "));
  EXPECT_THAT(bench.arm->health().message, HasSubstr(lie.reason));
  bench.run(0.5);
  EXPECT_LT(bench.fastest, 3.0) << "of its greatest speed; it runs away at more than 10 times that";
  EXPECT_EQ(bench.speed(kLyingJoint), 0.0);
}

// Position and velocity mirrored together, on a drive with a greatest speed of its own (0x6080): nothing in
// them gives it away. In torque mode the energy does; where the drive closes the loop, the way from its
// target.
TEST(MirroredFeedback, SR12_IsFoundBelowTheGreatestSpeedInEachMode) {
  using enum can::DriveMode;
  for (const can::DriveMode mode : {kTorque, kVelocity, kPosition}) {
    ArmBench bench(can_config(mode));
    ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
    const double dt = bench.config.period_s, away = shipped_arm().home[kLyingJoint] > 0.0 ? -1.0 : 1.0;
    const auto lead = [&](double for_s) {
      for (double t = 0.0; t < for_s && bench.state() == LinkState::kCoupled; t += dt) {
        bench.master.velocity[kLyingJoint] = 0.4 * away;
        bench.master.position[kLyingJoint] += bench.master.velocity[kLyingJoint] * dt;
        bench.tick();
      }
    };
    lead(0.5);
    ASSERT_EQ(bench.state(), LinkState::kCoupled) << bench.arm->health().message;
    bench.fastest = 0.0;
    bench.drives[kLyingJoint]->misbehaviour.mirrored_encoder = true;
    const double began = bench.joint(kLyingJoint);
    lead(3.0);
    EXPECT_EQ(bench.state(), LinkState::kStopped);
    EXPECT_THAT(bench.arm->health().message, HasSubstr("j4_elbow "));
    const auto energy = HasSubstr("more than its torque gave it"), way = HasSubstr("away from its target");
    EXPECT_THAT(bench.arm->health().message, testing::AnyOf(energy, mode == kTorque ? energy : way));
    bench.run(0.5);
    EXPECT_LT(std::abs(bench.joint(kLyingJoint) - began), 0.6) << "rad, until it stands";
    EXPECT_LT(bench.fastest, 1.1);
    EXPECT_EQ(bench.speed(kLyingJoint), 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Each, FeedbackLies, testing::ValuesIn(kLies), [](const auto& info) {
  std::string name = info.param.name;
  std::erase_if(name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
  return name;
});

}  // namespace
}  // namespace phantom::slave_io
