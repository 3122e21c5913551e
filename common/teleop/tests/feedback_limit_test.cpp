// The limit of 1/A against an independent oracle: master, link and slave stepped through time, sample by
// sample.
#include "common/teleop/rendering/feedback_limit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <random>

#include "common/teleop/coupling/joint_servo.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// By how much the limit may be wrong: the model replaces sampling by hold and delay.
constexpr double kTolerance = 0.05;

/// A rigid joint under a torque that is held: exact over a period. Velocity as encoders give it.
struct Joint {
  double inertia, period_s, filter_s;
  double q = 0.0, v = 0.0, measured_v = 0.0;

  void pass(double torque_Nm) {
    const double before = q, a = torque_Nm / inertia;
    q += period_s * (v + 0.5 * period_s * a);
    v += period_s * a;
    measured_v += period_s / (period_s + filter_s) * ((q - before) / period_s - measured_v);
  }
};

template <class Value>
class Late {
 public:
  explicit Late(int ticks) : under_way_(static_cast<std::size_t>(ticks), Value{}) {}
  Value pass(Value now) {
    under_way_.push_back(now);
    const Value then = under_way_.front();
    under_way_.pop_front();
    return then;
  }

 private:
  std::deque<Value> under_way_;
};

struct Motion {
  double q = 0.0, v = 0.0;
};
struct Answer {
  Motion motion;
  double loop_Nm = 0.0, external_Nm = 0.0;
};

/// Greatest feedback torque in the last eighth of the time, ÷ that in the eighth in the middle: above 1 the
/// loop swings by itself, with nobody's hand on the master. Both sides tick together.
double growth(BilateralLaw law, const FeedbackLoop& loop, double inverse_a, int there_ticks, int back_ticks,
              bool held, double duration_s = 24.0) {
  Joint master{loop.master_inertia, loop.master_period_s, loop.master_filter_s};
  Joint slave{loop.slave_inertia, loop.slave_period_s, loop.slave_filter_s};
  Late<Motion> there(there_ticks);
  Late<Answer> back(back_ticks);
  Late<double> motor(loop.master_delay_samples), drive(loop.slave_delay_samples);
  master.v = 1.0;
  double first = 0.0, middle = 0.0, last = 0.0, known_Nm = 0.0;
  const int ticks = static_cast<int>(duration_s / loop.master_period_s);
  for (int k = 0; k < ticks; ++k) {
    const Motion asked = there.pass({master.q, master.measured_v});
    const double loop_Nm =
        loop.slave_k_p * (asked.q - slave.q) + loop.slave_k_v * (asked.v - slave.measured_v);
    const double external_Nm = held ? -loop_Nm : 0.0;
    known_Nm += loop.slave_period_s / (loop.slave_period_s + loop.force_lag_s) * (external_Nm - known_Nm);
    const Answer heard = back.pass({{slave.q, slave.measured_v}, loop_Nm, known_Nm});
    const bool exchange = law == BilateralLaw::kPe || law == BilateralLaw::kPeff;
    double felt_Nm = 0.0;  // F_am · A
    if (law == BilateralLaw::kSctfb) felt_Nm = heard.loop_Nm;
    if (law == BilateralLaw::kPfff) felt_Nm = -heard.external_Nm;
    if (exchange) {
      felt_Nm = loop.exchange_k_p * (master.q - heard.motion.q) +
                loop.exchange_k_v * (master.measured_v - heard.motion.v);
    }
    if (law == BilateralLaw::kPeff) felt_Nm -= loop.force_share * heard.external_Nm;
    master.pass(motor.pass(-inverse_a * felt_Nm));
    const double driven_Nm = drive.pass(loop_Nm);
    if (!held) slave.pass(driven_Nm);
    first = std::max(first, std::abs(felt_Nm));
    if (k >= ticks / 2 && k < ticks * 5 / 8) middle = std::max(middle, std::abs(felt_Nm));
    if (k >= ticks * 7 / 8) last = std::max(last, std::abs(felt_Nm));
    if (std::abs(felt_Nm) > 1e100) return kInfinity;
  }
  return last <= 1e-7 * first ? 0.0 : last / middle;  // what is left is rounding
}

double greater_growth(BilateralLaw law, const FeedbackLoop& loop, double inverse_a, int there, int back) {
  return std::max(growth(law, loop, inverse_a, there, back, false),
                  growth(law, loop, inverse_a, there, back, true));
}

FeedbackLoop joint_of(double master_inertia, double slave_inertia, double k_p, double k_v) {
  const auto gains = gains_for(slave_inertia, 8.0, 1.0, 0.0);
  return {.master_inertia = master_inertia,
          .master_filter_s = 0.002,
          .slave_inertia = slave_inertia,
          .slave_k_p = gains.k_p,
          .slave_k_v = gains.k_v,
          .slave_filter_s = 0.002,
          .exchange_k_p = k_p,
          .exchange_k_v = k_v,
          .force_share = 0.02};
}

const FeedbackLoop kGantry = joint_of(2.0, 53.5, 150.0, 3.0), kShoulder = joint_of(0.05, 3.35, 8.0, 0.1),
                   kTool = joint_of(0.05, 0.3, 8.0, 0.1);

TEST(FeedbackLimit, SR13_JustBelowItTheLoopComesToRestAndJustAboveItSwings) {
  FeedbackLoop on_can = kShoulder;
  on_can.master_period_s = on_can.slave_period_s = 0.002;
  on_can.master_delay_samples = on_can.slave_delay_samples = 2;
  FeedbackLoop observed = on_can;
  observed.force_lag_s = 0.02;
  int tried = 0;
  for (const auto& loop : {kGantry, kShoulder, kTool, on_can, observed}) {
    for (const auto law :
         {BilateralLaw::kSctfb, BilateralLaw::kPfff, BilateralLaw::kPe, BilateralLaw::kPeff}) {
      for (const auto& [there, back] : {std::pair{0, 1}, {2, 2}, {3, 7}, {9, 6}}) {
        const double round_trip_s = (there + back) * loop.master_period_s;
        const double limit = feedback_limit(law, loop, round_trip_s);
        SCOPED_TRACE(testing::Message() << name_of(law) << " on " << loop.slave_inertia << " kg m2, "
                                        << 1e3 * round_trip_s << " ms: limit " << limit);
        if (limit <= 0.0) continue;
        ++tried;
        ASSERT_TRUE(std::isfinite(limit));
        EXPECT_LT(greater_growth(law, loop, (1.0 - kTolerance) * limit, there, back), 1.0);
        EXPECT_GT(greater_growth(law, loop, (1.0 + kTolerance) * limit, there, back), 1.0);
      }
    }
  }
  EXPECT_GE(tried, 60);
}

TEST(FeedbackLimit, NoGainIsStableWhereASpringAnswersTooLate) {
  // Held fast, law b's spring K_p and damping K_v bear a delay of K_v/K_p = 40 ms in all.
  EXPECT_GT(feedback_limit(BilateralLaw::kSctfb, kShoulder, 0.03), 0.0);
  EXPECT_EQ(feedback_limit(BilateralLaw::kSctfb, kShoulder, 0.05), 0.0);
  const double small = 0.05 * feedback_limit(BilateralLaw::kSctfb, kShoulder, 0.004);
  EXPECT_GT(growth(BilateralLaw::kSctfb, kShoulder, small, 25, 25, true), 1.0);
  EXPECT_LT(growth(BilateralLaw::kSctfb, kShoulder, small, 10, 10, true), 1.0);
}

TEST(FeedbackLimit, WhatDoesNotComeBackHasNone) {
  EXPECT_EQ(feedback_limit(BilateralLaw::kPf, kShoulder, 0.1), kInfinity);
  FeedbackLoop none = kShoulder;
  none.exchange_k_p = none.exchange_k_v = none.force_share = 0.0;
  EXPECT_EQ(feedback_limit(BilateralLaw::kPe, none, 0.004), kInfinity);
  EXPECT_EQ(feedback_limit(BilateralLaw::kPeff, none, 0.004), kInfinity);
}

TEST(FeedbackLimit, ALighterHandleAHeavierArmAndMoreDelayAllowLess) {
  const auto limit = [](const FeedbackLoop& loop, double round_trip_s) {
    return feedback_limit(BilateralLaw::kSctfb, loop, round_trip_s);
  };
  FeedbackLoop light = kShoulder;
  light.master_inertia *= 0.5;
  EXPECT_NEAR(limit(light, 0.004), 0.5 * limit(kShoulder, 0.004), 1e-9);
  EXPECT_LT(limit(joint_of(0.05, 6.7, 8, 0.1), 0.004), 0.51 * limit(kShoulder, 0.004));
  for (double s = 0.001; s < 0.03; s += 0.001)
    EXPECT_LT(limit(kShoulder, s + 0.001), limit(kShoulder, s)) << s;
}

TEST(FeedbackLimits, TheTableIsHalfTheLimitAndNeverRisesWithTheDelay) {
  const FeedbackLimits limits({kGantry, kShoulder, kTool});
  const std::vector<FeedbackLoop> loops{kGantry, kShoulder, kTool};
  for (const auto law : {BilateralLaw::kSctfb, BilateralLaw::kPfff, BilateralLaw::kPe, BilateralLaw::kPeff}) {
    for (std::size_t j = 0; j < loops.size(); ++j) {
      double before = kInfinity, least = kInfinity;
      for (double s = 0.0005; s < 0.3; s *= 1.07) {
        const double usable = limits.usable(law, j, s);
        EXPECT_LE(usable, before) << name_of(law) << j << ' ' << s;
        before = usable;
        least = std::min(least, feedback_limit(law, loops[j], s));
        if (s > FeedbackLimits::kMax_s) {
          EXPECT_EQ(usable, 0.0);
        } else {
          EXPECT_LE(usable, 0.5 * least * 1.2) << name_of(law) << j << ' ' << s;
          if (s >= 0.02) continue;
          EXPECT_GE(usable, 0.5 * least * 0.9) << name_of(law) << j << ' ' << s;
        }
      }
      EXPECT_EQ(limits.usable(law, j, std::numeric_limits<double>::quiet_NaN()), 0.0) << name_of(law) << j;
    }
  }
  EXPECT_EQ(limits.usable(BilateralLaw::kSctfb, 1, kInfinity), 0.0);
  EXPECT_EQ(limits.usable(BilateralLaw::kSctfb, 1, -1.0), limits.usable(BilateralLaw::kSctfb, 1, 0.0));
  EXPECT_EQ(limits.usable(BilateralLaw::kPf, 1, 0.2), kInfinity);
  EXPECT_EQ(FeedbackLimits{}.usable(BilateralLaw::kSctfb, 0, 0.2), kInfinity) << "knows of none";
  const test::HeapGuard guard;
  EXPECT_GT(limits.usable(BilateralLaw::kSctfb, 1, 0.004), 0.0);
}

TEST(FeedbackLimits, ARefusalNamesTheJointThatBearsLeastAndWhatItSaysIsAccepted) {
  const FeedbackLimits limits({kGantry, kShoulder, kTool});
  const std::vector<std::string> names{"j1_gantry", "j2_shoulder", "j3_tool"};
  const auto why = [&](const core::JointArray& inverse_a, double ratio = 1.0) {
    return why_feedback_is_unstable(limits, BilateralLaw::kSctfb, inverse_a, ratio, 0.004, names);
  };
  core::JointArray all{};
  all.fill(10.0);
  EXPECT_THAT(why(all),
              testing::StartsWith(
                  "1/A 10 is not stable on j2_shoulder with law sctfb and 4 ms delay; allowed: up to 0.01"));
  for (const double ratio : {1.0, 3.0}) {
    const std::string text = why(all, ratio);
    core::JointArray limit{};
    limit.fill(std::stod(text.substr(text.rfind(' '))));
    EXPECT_EQ(why(limit, ratio), "") << text;
    for (double& value : limit) value *= 1.11;  // two digits are told, rounded down
    EXPECT_NE(why(limit, ratio), "") << text;
  }
  core::JointArray one{};
  one[2] = 0.1;
  EXPECT_EQ(why(one), "") << "what is too much for the shoulder is not for the tool";
  one[2] = 1.0;
  EXPECT_THAT(why(one), testing::HasSubstr("j3_tool"));
  one[2] = 0.0;
  EXPECT_EQ(why_feedback_is_unstable(limits, BilateralLaw::kSctfb, one, 1.0, 1.0, names), "")
      << "no feedback is stable with any delay";
}

}  // namespace
}  // namespace phantom::teleop
