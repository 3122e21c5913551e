// Feedback gains on both sides as they run: servos, controllers, simulated device and arm, messages, a link
// with delay. What is accepted does not shake the arm; what shook it is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "components/slave_io/tests/fixture.hpp"
#include "tests/faults/pair.hpp"

namespace phantom::faults {
namespace {

using teleop::BilateralLaw;

/// What the hand felt over some seconds, by joint.
struct Felt {
  std::array<double, kJoints> reversals_per_s{};  ///< of the master's velocity, while the hand rests
  std::array<double, kJoints> feedback_per_s{};   ///< of the feedback torque's sign, above a tenth of its cap
  double greatest_over_cap = 0.0;                 ///< of percept and feedback, by their caps
  double greatest_step_over_rate = 0.0;           ///< of the motors' torque from tick to tick, by the rate
  double damped_share = 0.0;

  double reversals() const { return *std::max_element(reversals_per_s.begin(), reversals_per_s.end()); }
  double swings() const { return *std::max_element(feedback_per_s.begin(), feedback_per_s.end()); }
};

master_io::Config config_with(BilateralLaw law) {
  master_io::Config config = Pair::master_config();
  config.feedback.law = law;
  return config;
}

/// As it was: any gain comes into force.
master_io::Config unlimited(BilateralLaw law) {
  master_io::Config config = config_with(law);
  config.feedback.limits = {};
  return config;
}

void couple(Pair& pair) {
  for (int ms = 0; ms < 20'000 && pair.master_state() != teleop::LinkState::kCoupled; ++ms) pair.step();
  ASSERT_EQ(pair.master_state(), teleop::LinkState::kCoupled);
}

Felt feel(Pair& pair, double duration_s) {
  const master_io::Config& config = Pair::master_config();
  Felt felt;
  std::array<double, kJoints> moved{}, pushed{}, motor{};
  for (std::size_t j = 0; j < kJoints; ++j) motor[j] = pair.master_now.outputs.motor_Nm[j];
  const int ticks = static_cast<int>(duration_s / kTick_s);
  for (int k = 0; k < ticks; ++k) {
    pair.step();
    const auto& now = pair.master_now;
    felt.damped_share += now.feedback_damped ? 1.0 / ticks : 0.0;
    for (std::size_t j = 0; j < kJoints; ++j) {
      // Noise of a count is no reversal: a speed of ten counts per tick, through the filter.
      const double slow = 3.0 * config.device.encoder_resolution[j] / kTick_s;
      if (std::abs(now.velocity[j]) > slow) {
        felt.reversals_per_s[j] += now.velocity[j] * moved[j] < 0.0 ? 1.0 / duration_s : 0.0;
        moved[j] = now.velocity[j];
      }
      const double feedback = now.feedback_torque_Nm[j], cap = config.feedback.torque_cap_Nm[j];
      if (std::abs(feedback) > 0.1 * cap) {
        felt.feedback_per_s[j] += feedback * pushed[j] < 0.0 ? 1.0 / duration_s : 0.0;
        pushed[j] = feedback;
      }
      felt.greatest_over_cap =
          std::max({felt.greatest_over_cap, std::abs(feedback) / cap,
                    std::abs(now.percept_torque_Nm[j]) / config.percept.torque_cap_Nm[j]});
      const double step = std::abs(now.outputs.motor_Nm[j] - motor[j]);
      felt.greatest_step_over_rate =
          std::max(felt.greatest_step_over_rate, step / (config.torque_rate_Nm_per_s[j] * kTick_s));
      motor[j] = now.outputs.motor_Nm[j];
    }
  }
  return felt;
}

std::string told(const Felt& felt) {
  std::ostringstream text;
  text << "reversals/s";
  for (const double r : felt.reversals_per_s) text << ' ' << r;
  text << "; feedback's sign/s";
  for (const double r : felt.feedback_per_s) text << ' ' << r;
  text << "; of cap " << felt.greatest_over_cap << "; of rate " << felt.greatest_step_over_rate << "; damped "
       << felt.damped_share;
  return text.str();
}

Felt feel_unlimited(double inverse_a, double& delay_s) {
  Pair pair(unlimited(BilateralLaw::kSctfb));
  couple(pair);
  pair.settings.feedback_gain = teleop::everywhere(inverse_a);
  const Felt felt = feel(pair, 10.0);
  delay_s = pair.master_now.outputs.feedback_delay_s;
  std::printf("1/A %g unlimited: %s\n", inverse_a, told(felt).c_str());
  return felt;
}

// The findings, with the limits off: what the check is against, and that the loop is their cause.
TEST(FeedbackGain, WithoutLimitsTenShakesAlmostAllJointsAndTheCapsHoldAllTheSame) {
  double delay_s = 0.0;
  const Felt felt = feel_unlimited(10.0, delay_s);
  EXPECT_GT(felt.reversals(), 40.0) << told(felt);
  EXPECT_GT(felt.damped_share, 0.1);
  EXPECT_LE(felt.greatest_over_cap, 1.0 + 1e-12);
}

TEST(FeedbackGain, WithoutLimitsATenthShakesTheJointsWhoseLimitIsLessUnseenByTheGuard) {
  double delay_s = 0.0;
  const Felt felt = feel_unlimited(0.1, delay_s);
  EXPECT_EQ(felt.damped_share, 0.0);
  int shaken = 0;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const double limit =
        teleop::feedback_limit(BilateralLaw::kSctfb, Pair::master_config().feedback_loops[j], delay_s);
    SCOPED_TRACE(testing::Message() << "joint " << j << " limit " << limit << ": " << felt.feedback_per_s[j]);
    // Between the two, friction and the hand decide. The arm's joints are coupled: those that shake move the
    // others, too, which therefore do not rest.
    if (limit < 0.08) {
      EXPECT_GT(felt.feedback_per_s[j], 40.0);
    } else if (limit > 0.1) {
      EXPECT_LT(felt.feedback_per_s[j], 40.0);
    }
    shaken += felt.feedback_per_s[j] > 40.0;
  }
  EXPECT_EQ(shaken, 2);
}

/// The greatest 1/A that the page may set on each joint, with the delay in force.
core::JointArray greatest_accepted(const Pair& pair, BilateralLaw law) {
  const auto rules = master_io::gain_rules(Pair::master_config(), master_io::shipped_arm().arm);
  core::JointArray gains{};
  for (std::size_t j = 0; j < kJoints; ++j) {
    master_io::Settings settings;
    settings.law = law;
    const double delay_s = pair.master_now.outputs.feedback_delay_s;
    messages::OperatorCommand command{
        .kind = teleop::CommandKind::kSetFeedbackGain, .value = 10.0, .joint = static_cast<std::int32_t>(j)};
    const std::string why = master_io::apply_setting(command, rules, delay_s, settings).message();
    gains[j] = command.value = why.empty() ? 10.0 : std::stod(why.substr(why.rfind(' ')));
    EXPECT_TRUE(master_io::apply_setting(command, rules, delay_s, settings)) << why;
  }
  return gains;
}

TEST(FeedbackGain, TheGreatestThatIsAcceptedDoesNotShakeTheHand) {
  for (const auto law : {BilateralLaw::kSctfb, BilateralLaw::kPfff, BilateralLaw::kPe, BilateralLaw::kPeff}) {
    for (const core::Nanoseconds delay_ns : {200'000, 3'000'000, 8'000'000}) {
      Pair pair(config_with(law));
      pair.up.delay_ns = pair.down.delay_ns = delay_ns;
      couple(pair);
      for (int ms = 0; ms < 3000; ++ms) pair.step();  // until the delay is known
      pair.settings.feedback_gain = greatest_accepted(pair, law);
      const Felt felt = feel(pair, 10.0);
      SCOPED_TRACE(testing::Message() << name_of(law) << ", delay " << 1e-6 * static_cast<double>(delay_ns)
                                      << " ms each way: " << told(felt));
      std::printf("%s %g ms each way, round trip %g ms: %s\n", name_of(law),
                  1e-6 * static_cast<double>(delay_ns), 1e3 * pair.master_now.outputs.feedback_delay_s,
                  told(felt).c_str());
      EXPECT_LT(felt.reversals(), 6.0);
      EXPECT_LT(felt.swings(), 6.0);
      EXPECT_LE(felt.greatest_over_cap, 1.0 + 1e-12);
      EXPECT_LE(felt.greatest_step_over_rate, 1.0 + 1e-9);
      EXPECT_LT(felt.damped_share, 0.02);
    }
  }
}

// Tries master_io: the delay grows
TEST(FeedbackGain, ADelayThatGrowsLaterHoldsTheGainAndIsSaid) {
  Pair pair(config_with(BilateralLaw::kSctfb));
  couple(pair);
  for (int ms = 0; ms < 3000; ++ms) pair.step();
  EXPECT_FALSE(pair.master_now.feedback_limited);
  EXPECT_EQ(pair.master_now.feedback_gain, 0.01);
  pair.up.delay_ns = pair.down.delay_ns = 8'000'000;
  for (int ms = 0; ms < 2000; ++ms) pair.step();
  const auto& out = pair.master_now;
  EXPECT_TRUE(out.feedback_limited);
  EXPECT_LT(out.feedback_gain, 0.006);
  EXPECT_TRUE(messages::to_idl(pair.master_now).feedback_limited());
  EXPECT_NEAR(out.outputs.feedback_delay_s, 0.018, 0.003);
  EXPECT_LT(feel(pair, 5.0).swings(), 6.0);
}

// The master knows the slave's position loop by its own parameters: both sides' must be the same.
TEST(FeedbackGain, TheShippedSlavesLoopIsWhatTheShippedMasterTakesItFor) {
  const auto& arm = master_io::shipped_arm();
  const auto loops_of = [&](const std::filesystem::path& slave_file,
                            const std::filesystem::path& master_file) {
    const auto slave = slave_io::load_config(slave_file, arm.arm, arm.home);
    const auto master =
        master_io::load_config(master_file, master_io::hot_cell().file, arm.arm, arm.home, {});
    ASSERT_EQ(master.feedback_loops.size(), kJoints);
    for (std::size_t j = 0; j < kJoints; ++j) {
      const teleop::FeedbackLoop& loop = master.feedback_loops[j];
      EXPECT_DOUBLE_EQ(loop.slave_k_p, slave.gains[j].k_p) << slave_file;
      EXPECT_DOUBLE_EQ(loop.slave_k_v, slave.gains[j].k_v) << slave_file;
      EXPECT_DOUBLE_EQ(loop.slave_inertia, slave.plant.joints[j].inertia) << slave_file;
      EXPECT_DOUBLE_EQ(loop.slave_period_s, slave.period_s) << slave_file;
      EXPECT_EQ(loop.slave_delay_samples, slave.driver == slave_io::Driver::kCan ? 2 : 0) << slave_file;
      EXPECT_EQ(loop.force_lag_s, slave.force_observer ? slave.force_observer->lag_s : 0.0) << slave_file;
    }
  };
  loops_of(slave_io::kShipped, master_io::kShipped);
  const std::filesystem::path can = PHANTOM_SOURCE_DIR "/deploy/can";
  loops_of(can / "hot_cell_slave_io.yaml", can / "hot_cell_master_io.yaml");
}

}  // namespace
}  // namespace phantom::faults
