#include "common/teleop/rendering/feedback_rendering.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/teleop/tests/period.hpp"

namespace phantom::teleop {
namespace {

FeedbackParameters parameters() {
  FeedbackParameters p{.joint_count = 1, .law = BilateralLaw::kSctfb};
  const double inverse_a[] = {0, 0.05, 0.1, 1, 1};
  for (std::size_t law = 0; law < kBilateralLaws; ++law) p.inverse_a[law] = everywhere(inverse_a[law]);
  p.torque_cap_Nm[0] = 4.0;
  p.exchange.k_p[0] = 20.0;
  p.passivity.joint_count = 1;
  p.passivity.enabled = false;
  return p;
}

FeedbackInputs pushing() {
  FeedbackInputs in{.coupled = true, .force_measured = true};
  in.effort.loop_torque_Nm[0] = 20.0;
  in.effort.external_torque_Nm[0] = -15.0;
  in.master.position[0] = 0.05;
  return in;
}

RenderedFeedback run(FeedbackRenderer& renderer, const FeedbackInputs& in, double duration_s) {
  RenderedFeedback out;
  for (double t = 0; t < duration_s; t += kDt) out = renderer.step(in, kDt);
  return out;
}

TEST(FeedbackRendering, EveryLawSettlesAtItsOwnGain) {
  const double expected_Nm[] = {0.0, -0.05 * 20.0, -0.1 * 15.0, -20.0 * 0.05, -20.0 * 0.05 - 15.0};
  FeedbackRenderer renderer(parameters());
  FeedbackInputs in = pushing();
  for (const auto law : {BilateralLaw::kPf, BilateralLaw::kSctfb, BilateralLaw::kPfff, BilateralLaw::kPe,
                         BilateralLaw::kPeff}) {
    in.law = law;
    const auto out = run(renderer, in, 1.0);
    EXPECT_EQ(out.law, law);
    EXPECT_NEAR(out.torque_Nm[0], std::max(-4.0, expected_Nm[static_cast<std::size_t>(law)]), 1e-9)
        << name_of(law);
    EXPECT_EQ(out.torque_limited, law == BilateralLaw::kPeff) << name_of(law);
  }
}

// Bumpless: laws, gains, contact and coupling change at random; no step of the torque exceeds the ramps'.
TEST(FeedbackRendering, SR10_NothingThatIsSwitchedMakesAJump) {
  auto p = parameters();
  p.contact_gain_ratio = 3.0;
  FeedbackRenderer renderer(p);
  std::mt19937 random(11);
  const auto choose = [&random](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  FeedbackInputs in = pushing();
  double before_Nm = 0.0;
  // 1/A moves by at most 1/ramp_up, authority by 1/ramp_down, contact by (ratio − 1)/rise: of a torque whose
  // unscaled value is at most 20 N·m and which is capped at 4.
  const double most_Nm =
      kDt * (4.0 / p.ramp_down_s + 3.0 * 20.0 / p.ramp_up_s + 2.0 * 4.0 / p.contact_rise_s) + 1e-9;
  for (int i = 0; i < 60000; ++i) {
    if (i % 97 == 0) in.law = static_cast<BilateralLaw>(choose(5));
    if (i % 61 == 0) in.inverse_a = everywhere(choose(2) == 0 ? kLawsOwnGain : 0.1 * choose(10));
    if (i % 43 == 0) in.contact = choose(2) == 0;
    if (i % 151 == 0) in.coupled = choose(3) != 0;
    const double now_Nm = renderer.step(in, kDt).torque_Nm[0];
    ASSERT_LE(std::abs(now_Nm - before_Nm), most_Nm) << i;
    ASSERT_LE(std::abs(now_Nm), 4.0 + 1e-12);
    before_Nm = now_Nm;
  }
}

TEST(FeedbackRendering, ContactRaisesTheGainAndLettingGoLowersIt) {
  auto p = parameters();
  p.contact_gain_ratio = 3.0;
  FeedbackRenderer renderer(p);
  FeedbackInputs in = pushing();
  EXPECT_NEAR(run(renderer, in, 1.0).inverse_a[0], 0.05, 1e-12);
  in.contact = true;
  EXPECT_NEAR(run(renderer, in, 0.2).torque_Nm[0], -3.0, 1e-9);
  in.contact = false;
  EXPECT_NEAR(run(renderer, in, 0.5).torque_Nm[0], -1.0, 1e-9);
}

TEST(FeedbackRendering, AGainForOneLawIsNotAnothersGain) {
  FeedbackRenderer renderer(parameters());
  FeedbackInputs in = pushing();
  in.inverse_a = everywhere(0.02);
  EXPECT_NEAR(run(renderer, in, 1.0).inverse_a[0], 0.02, 1e-12);
  in.law = BilateralLaw::kPe;
  in.inverse_a = everywhere(kLawsOwnGain);  // as a change of law asks
  EXPECT_NEAR(run(renderer, in, 1.0).inverse_a[0], 1.0, 1e-12);
}

TEST(FeedbackRendering, ALawThatNeedsAMissingForceSensorIsSaidAndSilent) {
  FeedbackRenderer renderer(parameters());
  FeedbackInputs in = pushing();
  in.force_measured = false;
  in.law = BilateralLaw::kPfff;
  auto out = run(renderer, in, 1.0);
  EXPECT_TRUE(out.force_missing);
  EXPECT_EQ(out.torque_Nm[0], 0.0);
  in.force_measured = true;
  out = run(renderer, in, 1.0);
  EXPECT_FALSE(out.force_missing);
  EXPECT_NEAR(out.torque_Nm[0], -1.5, 1e-9);
}

TEST(FeedbackRendering, SR10_AForceThatIsNoLongerMeasuredFadesWithinTheRampAndComesBackAsSlowly) {
  for (const auto law : {BilateralLaw::kPfff, BilateralLaw::kPeff}) {
    FeedbackRenderer renderer(parameters());
    FeedbackInputs in = pushing();
    in.law = law;
    const double whole_Nm = run(renderer, in, 1.0).torque_Nm[0];
    ASSERT_LT(whole_Nm, -0.5);
    const auto measured = in.effort.external_torque_Nm;
    double before_Nm = whole_Nm;
    for (const bool comes_back : {false, true}) {
      in.force_measured = comes_back;
      in.effort.external_torque_Nm = comes_back ? measured : core::JointArray{};
      const double ramp_s = comes_back ? 0.3 : 0.1;
      for (double t = 0; t < ramp_s + 2 * kDt; t += kDt) {
        const double now_Nm = renderer.step(in, kDt).torque_Nm[0];
        EXPECT_LE(std::abs(now_Nm - before_Nm), 1.01 * std::abs(whole_Nm) * kDt / ramp_s);
        before_Nm = now_Nm;
      }
      EXPECT_NEAR(before_Nm, comes_back ? whole_Nm : 0.0, 1e-9);
    }
  }
}

TEST(FeedbackRendering, SR07_FadesOutWithinTheRampWhenUncoupled) {
  FeedbackRenderer renderer(parameters());
  FeedbackInputs in = pushing();
  run(renderer, in, 1.0);
  in.coupled = false;
  EXPECT_EQ(run(renderer, in, 0.1 + 2 * kDt).torque_Nm[0], 0.0);
}

TEST(FeedbackRendering, WhatASlaveReportsAfterUncouplingIsNotFelt) {
  FeedbackRenderer renderer(parameters());
  FeedbackInputs in = pushing();
  double before_Nm = run(renderer, in, 1.0).torque_Nm[0];
  ASSERT_LT(before_Nm, -0.5);
  in.coupled = false;
  in.effort.loop_torque_Nm[0] = -400.0;  // it holds against something
  for (int i = 0; before_Nm != 0.0; ++i) {
    const double now_Nm = renderer.step(in, kDt).torque_Nm[0];
    ASSERT_GT(now_Nm, before_Nm) << "it fades";
    ASSERT_LE(now_Nm, 0.0) << "and does not change sides";
    before_Nm = now_Nm;
    ASSERT_LT(i, 200);
  }
}

TEST(FeedbackRendering, SR08_SR11_NumbersThatAreNoneGiveNoTorque) {
  FeedbackRenderer renderer(parameters());
  FeedbackInputs in = pushing();
  run(renderer, in, 1.0);
  in.effort.loop_torque_Nm[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(renderer.step(in, kDt).torque_Nm[0], 0.0);
  in.effort.loop_torque_Nm[0] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(renderer.step(in, kDt).torque_Nm[0], 0.0);
}

TEST(FeedbackRendering, AGainThatIsNoneIsTheLawsOwn) {
  FeedbackRenderer renderer(parameters());
  FeedbackInputs in = pushing();
  const double own_Nm = run(renderer, in, 1.0).torque_Nm[0];
  ASSERT_NE(own_Nm, 0.0);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    in.inverse_a = everywhere(bad);
    EXPECT_EQ(FeedbackRenderer(parameters()).step(in, kDt).inverse_a, renderer.step(in, kDt).inverse_a);
    EXPECT_NEAR(run(renderer, in, 1.0).torque_Nm[0], own_Nm, 1e-9);
  }
}

// 6.97 N·m were felt where the cap is 4: the guard's damping came after the cap.
TEST(FeedbackRendering, SR08_TheCapHoldsAfterThePassivityGuardsDamping) {
  auto p = parameters();
  p.passivity.enabled = true;
  p.passivity.damping_limit[0] = 10.0;  // no allowance, no store: it damps as soon as energy is given
  FeedbackRenderer renderer(p);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  FeedbackInputs in = pushing();
  in.inverse_a = everywhere(1.0);
  double greatest_Nm = 0.0;
  int damped = 0;
  for (int i = 0; i < 20000; ++i) {
    in.master.velocity[0] = share(random);
    in.master.position[0] += kDt * in.master.velocity[0];
    in.effort.loop_torque_Nm[0] = -30.0 * in.master.velocity[0];  // pushes the way it goes
    if (i % 3 == 0) in.effort.loop_torque_Nm[0] = 30.0 * share(random);
    const auto out = renderer.step(in, kDt);
    damped += out.passivity_limited;
    greatest_Nm = std::max(greatest_Nm, std::abs(out.torque_Nm[0]));
  }
  EXPECT_GT(damped, 5000);
  EXPECT_LE(greatest_Nm, 4.0);
}

FeedbackLoop shoulder() {
  return {.master_inertia = 0.05, .slave_inertia = 3.35, .slave_k_p = 8464, .slave_k_v = 337};
}

// Tries master_io: the delay grows
TEST(FeedbackRendering, SR13_AGrowingDelayHoldsTheGainAtWhatIsStableThenAndSaysSo) {
  auto p = parameters();
  p.limits = FeedbackLimits({shoulder()});
  p.inverse_a[static_cast<std::size_t>(BilateralLaw::kSctfb)] = everywhere(0.01);
  FeedbackRenderer renderer(p);
  FeedbackInputs in = pushing();
  in.round_trip_s = 0.003;
  auto out = run(renderer, in, 2.0);
  EXPECT_EQ(out.inverse_a[0], 0.01);
  EXPECT_FALSE(out.limited);
  in.round_trip_s = 0.015;
  double before = out.inverse_a[0];
  for (int i = 0; i < 2000; ++i) {  // slower than the ramps: nothing jumps
    out = renderer.step(in, kDt);
    ASSERT_LE(out.inverse_a[0], before);
    ASSERT_GT(out.inverse_a[0], before - 2e-4);
    ASSERT_LE(out.inverse_a[0], p.limits.usable(BilateralLaw::kSctfb, 0, out.round_trip_s));
    before = out.inverse_a[0];
  }
  EXPECT_TRUE(out.limited);
  EXPECT_NEAR(out.round_trip_s, 0.015, 1e-5);
  EXPECT_NEAR(out.inverse_a[0], p.limits.usable(BilateralLaw::kSctfb, 0, 0.015), 1e-5);
  in.round_trip_s = 0.003;
  out = run(renderer, in, 8.0);
  EXPECT_EQ(out.inverse_a[0], 0.01) << "and gives it back";
  EXPECT_FALSE(out.limited);
  in.round_trip_s = 0.2;
  out = run(renderer, in, 2.0);
  EXPECT_EQ(out.inverse_a[0], 0.0);
  EXPECT_EQ(out.torque_Nm[0], 0.0);
}

TEST(FeedbackRendering, ContactsShareIsHeldToWhatIsStableToo) {
  auto p = parameters();
  p.limits = FeedbackLimits({shoulder()});
  p.contact_gain_ratio = 50.0;
  p.inverse_a[static_cast<std::size_t>(BilateralLaw::kSctfb)] = everywhere(0.01);
  FeedbackRenderer renderer(p);
  FeedbackInputs in = pushing();
  in.contact = true;
  const auto out = run(renderer, in, 1.0);
  EXPECT_EQ(out.inverse_a[0], p.limits.usable(BilateralLaw::kSctfb, 0, out.round_trip_s));
  EXPECT_TRUE(out.limited);
}

TEST(FeedbackRendering, EachJointHasItsOwnGain) {
  auto p = parameters();
  p.joint_count = 2;
  p.torque_cap_Nm[1] = 4.0;
  p.passivity.joint_count = 2;
  FeedbackRenderer renderer(p);
  FeedbackInputs in = pushing();
  in.effort.loop_torque_Nm[1] = 20.0;
  in.inverse_a[1] = 0.02;  // and joint 0 the law's own
  const auto out = run(renderer, in, 1.0);
  EXPECT_NEAR(out.torque_Nm[0], -0.05 * 20.0, 1e-9);
  EXPECT_NEAR(out.torque_Nm[1], -0.02 * 20.0, 1e-9);
}

}  // namespace
}  // namespace phantom::teleop
