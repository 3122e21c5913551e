#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/simulation/master_plant.hpp"
#include "common/simulation/operator_model.hpp"
#include "common/simulation/reach_script.hpp"
#include "common/teleop/tests/period.hpp"

namespace phantom::simulation {
namespace {

using teleop::kDt;

OperatorParameters hand(OperatorKind kind) {
  OperatorParameters p{.joint_count = 1, .kind = kind};
  const bool servo = kind == OperatorKind::kConstantVelocity;
  p.stiffness[0] = servo ? 400 : 60, p.damping[0] = servo ? 20 : 3, p.max_force[0] = servo ? 50 : 5;
  return p;
}

MasterPlant device() {
  MasterPlantParameters p{.joint_count = 1, .joints = {}, .torque_limit_Nm = {}, .encoder_resolution = {}};
  p.joints[0] = {.inertia = 0.02, .viscous = 0.02, .coulomb = 0.01};
  p.torque_limit_Nm[0] = 10;
  p.encoder_resolution[0] = 1e-5;
  return {p, {}};
}

core::JointArray at(double q) { return {q}; }

// Moves the device by the hand against a damper; returns the time to the end of the reference and the
// greatest speed.
struct Outcome {
  double time_s = 0, peak_speed = 0, peak_torque = 0, end_q = 0, greatest_lag = 0;
};
Outcome reach(OperatorKind kind, double damper, double limit_s = 30) {
  auto plant = device();
  OperatorModel model(hand(kind), {});
  model.move_to(at(1.0), 2.0);
  Outcome out;
  while (!model.arrived() && out.time_s < limit_s) {
    const auto& torque = model.step(plant.true_position(), plant.true_velocity(), true, kDt);
    plant.step(torque, at(-damper * plant.velocity()[0]), kDt);
    out.time_s += kDt;
    out.peak_speed = std::max(out.peak_speed, plant.true_velocity()[0]);
    out.peak_torque = std::max(out.peak_torque, std::abs(torque[0]));
    out.greatest_lag = std::max(out.greatest_lag, model.reference()[0] - plant.true_position()[0]);
  }
  for (int i = 0; i < 1000; ++i)
    plant.step(model.step(plant.true_position(), plant.true_velocity(), true, kDt), {}, kDt);
  out.end_q = plant.true_position()[0];
  return out;
}

TEST(Profiles, StartAndEndAtRestAndCoverTheWay) {
  for (const double ramp : {0.05, 0.2, 0.5}) {
    double way = 0;
    for (int i = 0; i < 100000; ++i) way += constant_velocity((i + 0.5) / 1e5, ramp).rate / 1e5;
    EXPECT_NEAR(way, 1.0, 1e-6);
    EXPECT_NEAR(constant_velocity(1.0, ramp).share, 1.0, 1e-12);
    EXPECT_NEAR(constant_velocity(0.5, ramp).share, 0.5, 1e-12);
  }
  EXPECT_EQ(minimum_jerk(0).share, 0.0);
  EXPECT_EQ(minimum_jerk(1).share, 1.0);
  EXPECT_EQ(minimum_jerk(2).share, 1.0);
  EXPECT_EQ(minimum_jerk(1).rate, 0.0);
  EXPECT_NEAR(minimum_jerk(0.5).rate, 1.875, 1e-12);
  for (double p = 0.05; p < 1; p += 0.1) {
    EXPECT_NEAR((minimum_jerk(p + 1e-6).share - minimum_jerk(p - 1e-6).share) / 2e-6, minimum_jerk(p).rate,
                1e-6);
  }
}

TEST(Operator, ReachesInFreeSpaceInAboutTheNominalTime) {
  const auto out = reach(OperatorKind::kMinimumJerk, 0.0);
  EXPECT_NEAR(out.time_s, 2.0, 0.1);
  EXPECT_NEAR(out.peak_speed, 1.875 / 2.0, 0.05);
  EXPECT_NEAR(out.end_q, 1.0, 0.01);
}

TEST(Operator, DragSlowsThePersonWithoutALagThatBuildsUp) {
  const auto free = reach(OperatorKind::kMinimumJerk, 0.0);
  const auto light = reach(OperatorKind::kMinimumJerk, 2.0);
  const auto heavy = reach(OperatorKind::kMinimumJerk, 8.0);
  EXPECT_LT(light.peak_speed, free.peak_speed);
  EXPECT_LT(heavy.peak_speed, 0.7 * light.peak_speed);
  EXPECT_LE(heavy.peak_torque, 5.0);
  EXPECT_LE(heavy.greatest_lag, 2 * 5.0 / 60.0);
  EXPECT_NEAR(heavy.end_q, 1.0, 0.01);
}

TEST(Operator, AWallStopsTheReferenceInsteadOfWindingItUp) {
  OperatorModel model(hand(OperatorKind::kMinimumJerk), {});
  model.move_to(at(1.0), 2.0);
  for (int i = 0; i < 20000; ++i) {
    model.step(at(0.0), at(0.0), true, kDt);  // the device does not move at all
    ASSERT_LE(model.torque_Nm()[0], 5.0);
  }
  EXPECT_LT(model.reference()[0], 0.15);
}

TEST(Operator, VelocityServoKeepsItsSpeedAndPaysWithTorque) {
  const auto free = reach(OperatorKind::kConstantVelocity, 0.0);
  const auto drag = reach(OperatorKind::kConstantVelocity, 6.0);
  EXPECT_NEAR(drag.time_s, free.time_s, 2e-3);
  EXPECT_NEAR(drag.peak_speed, free.peak_speed, 0.05);
  EXPECT_NEAR(drag.peak_torque - free.peak_torque, 6.0 * free.peak_speed, 0.5);  // MLT follows the drag
}

TEST(Operator, ACautiousPersonIsSlowerInTheSameDragAndWaitsWellBelowHerStrength) {
  const auto run = [](double yield, double stop) {
    auto plant = device();
    auto p = hand(OperatorKind::kMinimumJerk);
    p.yield_share = yield, p.stop_share = stop, p.recovery_bandwidth_Hz = 1;
    OperatorModel model(p, {});
    model.move_to(at(1.0), 2.0);
    Outcome out;
    while (!model.arrived() && out.time_s < 60) {
      plant.step(model.step(plant.true_position(), plant.true_velocity(), true, kDt),
                 at(-4.0 * plant.velocity()[0]), kDt);
      out.time_s += kDt;
      out.peak_torque = std::max(out.peak_torque, std::abs(model.torque_Nm()[0]));
    }
    return out;
  };
  const auto bold = run(0.25, 1.0), cautious = run(0.05, 0.3);
  EXPECT_GT(cautious.time_s, 1.3 * bold.time_s);
  EXPECT_LT(cautious.peak_torque, 0.5 * 5.0);
}

TEST(Operator, ALoadIsFeltOnlyAfterTheReactionTime) {
  auto p = hand(OperatorKind::kMinimumJerk);
  p.reaction_delay_s = 0.15;
  OperatorModel model(p, {});
  model.move_to(at(1.0), 2.0);
  double first_slower_s = -1.0;
  for (int i = 0; i < 1000 && first_slower_s < 0; ++i) {
    model.step(at(-0.2), at(0.0), true, kDt);  // held back with all the hand's force from the start
    if (model.pace() < 1.0) first_slower_s = (i + 1) * kDt;
  }
  EXPECT_NEAR(first_slower_s, 0.151, 1e-9);
}

// Pace after a second of the warning `heard` and `seen`, and when it first fell.
std::pair<double, double> pace_after(const Attention& hearing, const Attention& sight, double heard,
                                     double seen) {
  auto p = hand(OperatorKind::kMinimumJerk);
  p.hearing = hearing, p.sight = sight;
  OperatorModel model(p, {});
  model.move_to(at(1.0), 1e3);  // hardly a load
  double first_s = -1.0;
  for (int i = 0; i < 1000; ++i) {
    model.notice(heard, seen);
    model.step(model.reference(), at(0.0), true, kDt);
    if (first_s < 0 && model.pace() < 1.0) first_s = (i + 1) * kDt;
  }
  return {model.pace(), first_s};
}

TEST(Operator, WhoHeedsAToneOrAViewSlowsDownAfterHerReactionTimeAndCreepsOn) {
  const Attention heeds{.heed_from = 0.2, .creep_from = 0.8, .creep_pace = 0.1, .reaction_delay_s = 0.2};
  for (const bool by_ear : {true, false}) {
    const Attention &hearing = by_ear ? heeds : Attention{}, &sight = by_ear ? Attention{} : heeds;
    const auto at_warning = [&](double w) {
      return pace_after(hearing, sight, by_ear ? w : 0.0, by_ear ? 0.0 : w);
    };
    EXPECT_EQ(at_warning(0.19).first, 1.0);
    EXPECT_NEAR(at_warning(0.5).first, 0.55, 1e-6);
    EXPECT_NEAR(at_warning(0.8).first, 0.1, 1e-6);
    EXPECT_NEAR(at_warning(1.0).first, 0.1, 1e-6);
    EXPECT_NEAR(at_warning(1.0).second, 0.201, 1e-9);
  }
  EXPECT_EQ(pace_after({}, {}, 1.0, 1.0).first, 1.0) << "another person's";
}

TEST(Operator, OfWhatIsHeardAndSeenTheSlowerPaceCounts) {
  const Attention ear{.heed_from = 0.0, .creep_from = 0.5, .creep_pace = 0.4, .reaction_delay_s = 0.0};
  const Attention eye{.heed_from = 0.0, .creep_from = 0.5, .creep_pace = 0.2, .reaction_delay_s = 0.0};
  EXPECT_NEAR(pace_after(ear, eye, 1.0, 1.0).first, 0.2, 1e-6);
  EXPECT_NEAR(pace_after(ear, eye, 1.0, 0.0).first, 0.4, 1e-6);
}

TEST(Operator, TremorHasTheAskedForSizeAndBandAndItsSeedDecidesIt) {
  const auto shake = [](std::uint32_t seed) {
    auto p = hand(OperatorKind::kMinimumJerk);
    p.stiffness[0] = 1, p.damping[0] = 0, p.max_force[0] = 100;  // torque = shaking of the reference, at rest
    p.tremor_rms[0] = 0.004, p.tremor_Hz = 10, p.seed = seed;
    OperatorModel model(p, {});
    std::vector<double> seen;
    for (int i = 0; i < 20000; ++i) seen.push_back(model.step(at(0), at(0), true, kDt)[0]);
    return seen;
  };
  const auto one = shake(1);
  double square = 0;
  int crossings = 0;
  for (std::size_t i = 1; i < one.size(); ++i) {
    square += one[i] * one[i];
    crossings += one[i - 1] < 0 && one[i] >= 0;
  }
  EXPECT_NEAR(std::sqrt(square / static_cast<double>(one.size())), 0.004, 0.0003);
  EXPECT_NEAR(crossings / 20.0, 10.0, 2.0);
  EXPECT_EQ(one, shake(1));
  EXPECT_NE(one, shake(2));
}

TEST(Operator, WaitsWhileNotCoupled) {
  OperatorModel model(hand(OperatorKind::kMinimumJerk), at(0.2));
  model.move_to(at(1.0), 2.0);
  for (int i = 0; i < 1000; ++i) model.step(at(0.2), {}, false, kDt);
  EXPECT_EQ(model.reference()[0], 0.2);
  EXPECT_FALSE(model.arrived());
}

struct Seen {
  std::vector<std::int32_t> numbers;
  std::vector<bool> percept;
  std::vector<std::size_t> index;
  std::vector<double> start_s;
  double deepest = 0.0;
};

// Runs the script on the device; a wall's contact flag is raised beyond `wall`.
Seen play(ReachScriptParameters p, double wall, double duration_s) {
  auto plant = device();
  OperatorModel model(hand(OperatorKind::kMinimumJerk), {});
  ReachScript script(p, model);
  Seen seen;
  for (double t = 0; t < duration_s; t += kDt) {
    script.step(plant.true_position(), true, plant.true_position()[0] > wall, kDt);
    plant.step(model.step(plant.true_position(), plant.true_velocity(), true, kDt), {}, kDt);
    seen.deepest = std::max(seen.deepest, plant.true_position()[0]);
    if (script.number() >= 0 && (seen.numbers.empty() || seen.numbers.back() != script.number())) {
      seen.numbers.push_back(script.number());
      seen.percept.push_back(script.percept_on());
      seen.index.push_back(script.index());
      seen.start_s.push_back(t);
    }
  }
  return seen;
}

ReachScriptParameters two_reaches() {
  ReachScriptParameters p;
  p.joint_count = 1;
  p.reaches = {{at(0.0), at(0.8)}, {at(0.2), at(0.6)}};
  return p;
}

TEST(ReachScript, EachReachWithThenWithoutThePerceptInTurn) {
  const auto seen = play(two_reaches(), 10, 45);
  ASSERT_GE(seen.numbers.size(), 5U);
  EXPECT_EQ(std::vector(seen.numbers.begin(), seen.numbers.begin() + 5),
            (std::vector<std::int32_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(std::vector(seen.percept.begin(), seen.percept.begin() + 5),
            (std::vector<bool>{true, false, true, false, true}));
  EXPECT_EQ(std::vector(seen.index.begin(), seen.index.begin() + 5),
            (std::vector<std::size_t>{0, 0, 1, 1, 0}));
}

TEST(ReachScript, AsksTheGripperAtTheEndOfTheWayInAndLeavesOutWhatIsMadeOnce) {
  ReachScriptParameters p = two_reaches();
  p.percept = PerceptSchedule::kOn;
  p.reaches = {{at(0.0), at(0.8), GripperAction::kClose, 1.5, true},
               {at(0.2), at(0.6), GripperAction::kOpen},
               {at(0.1), at(0.5)}};
  EXPECT_EQ(play(p, 10, 60).index, (std::vector<std::size_t>{0, 1, 2, 1, 2, 1, 2, 1}));

  auto plant = device();
  OperatorModel model(hand(OperatorKind::kMinimumJerk), {});
  ReachScript script(p, model);
  double held_s = 0.0;
  for (double t = 0; t < 14; t += kDt) {
    const bool asked = script.gripper_asked() > 0;
    script.step(plant.true_position(), true, false, kDt);
    plant.step(model.step(plant.true_position(), plant.true_velocity(), true, kDt), {}, kDt);
    if (!asked && script.gripper_asked() == 1) {
      EXPECT_EQ(script.phase(), ReachPhase::kHold);
      EXPECT_NEAR(plant.true_position()[0], 0.8, 0.02) << "it is there";
    }
    if (script.number() == 0 && script.phase() == ReachPhase::kHold) held_s += kDt;
  }
  EXPECT_EQ(script.gripper_asked(), 2U);
  EXPECT_EQ(script.gripper_action(), GripperAction::kOpen);
  EXPECT_NEAR(held_s, 1.5, 2 * kDt) << "longer than the script's, to grip";
}

TEST(ReachScript, TwoPairsFitIntoThirtySeconds) { EXPECT_GE(play(two_reaches(), 10, 29).numbers.size(), 4U); }

TEST(ReachScript, SameSeedSameReachesOtherSeedOthers) {
  auto p = two_reaches();
  p.duration_scatter = 0.1;
  EXPECT_EQ(play(p, 10, 30).start_s, play(p, 10, 30).start_s);
  auto other = p;
  other.seed = 2;
  EXPECT_NE(play(p, 10, 30).start_s, play(other, 10, 30).start_s);
}

TEST(ReachScript, LetsGoAfterTheReactionTimeAndRetreats) {
  auto p = two_reaches();
  auto plant = device();
  OperatorModel model(hand(OperatorKind::kMinimumJerk), {});
  ReachScript script(p, model);
  double touch_s = -1, let_go_s = -1, deepest = 0, t = 0;
  for (; t < 12 && script.number() < 1; t += kDt) {
    const bool contact = plant.true_position()[0] > 0.4;
    script.step(plant.true_position(), true, contact, kDt);
    plant.step(model.step(plant.true_position(), plant.true_velocity(), true, kDt), {}, kDt);
    if (contact && touch_s < 0) touch_s = t;
    if (touch_s >= 0 && let_go_s < 0 && script.phase() == ReachPhase::kHold) let_go_s = t;
    deepest = std::max(deepest, plant.true_position()[0]);
  }
  ASSERT_GE(touch_s, 0);
  EXPECT_NEAR(let_go_s - touch_s, 0.2, 0.005);
  EXPECT_LT(deepest, 0.6);
  EXPECT_EQ(script.number(), 1);
}

TEST(ReachScript, GoesOnThroughAContactWhereItIsToPress) {
  ReachScriptParameters p = two_reaches();
  p.reaches.pop_back();
  EXPECT_LT(play(p, 0.4, 12).deepest, 0.6);
  p.reaches[0].presses = true;
  EXPECT_NEAR(play(p, 0.4, 12).deepest, 0.8, 0.02);
}

TEST(ReachScript, ASlaveThatCannotComeIsMetAndTheReachGivenUp) {
  auto plant = device();
  OperatorModel model(hand(OperatorKind::kMinimumJerk), {});
  ReachScript script(two_reaches(), model);
  const auto tick = [&](bool go) {
    plant.step(model.step(plant.true_position(), plant.true_velocity(), go || script.meeting(), kDt), {},
               kDt);
  };
  while (plant.true_position()[0] < 0.5) {
    script.step(plant.true_position(), true, false, kDt);
    tick(true);
  }
  ASSERT_EQ(script.phase(), ReachPhase::kIn);
  for (int i = 0; i < 500; ++i)
    script.step(plant.true_position(), false, true, kDt), tick(false);  // the slave is lost
  // Heard again, it comes within two seconds or is met.
  for (int i = 0; i < 1900; ++i) script.meet(at(0.4), kDt), tick(false);
  EXPECT_FALSE(script.meeting());
  EXPECT_GT(plant.true_position()[0], 0.45);
  for (int i = 0; i < 3000; ++i) script.meet(at(0.4), kDt), tick(false);
  EXPECT_TRUE(script.meeting());
  EXPECT_NEAR(plant.true_position()[0], 0.4, 0.02);
  script.step(plant.true_position(), true, true, kDt);
  EXPECT_FALSE(script.meeting());
  EXPECT_EQ(script.phase(), ReachPhase::kHold);
  for (int i = 0; i < 20000 && script.number() == 0; ++i) {
    script.step(plant.true_position(), true, false, kDt);
    tick(true);
  }
  EXPECT_EQ(script.number(), 1) << "the next reach comes";
}

TEST(ReachScript, NothingHappensWhileNotCoupled) {
  OperatorModel model(hand(OperatorKind::kMinimumJerk), {});
  ReachScript script(two_reaches(), model);
  for (int i = 0; i < 10000; ++i) script.step({}, false, false, kDt);
  EXPECT_EQ(script.number(), -1);
  EXPECT_EQ(script.phase(), ReachPhase::kWait);
}

}  // namespace
}  // namespace phantom::simulation
