#include "common/teleop/rendering/percept_set.hpp"

#include <gtest/gtest.h>

#include <array>

namespace phantom::teleop {
namespace {

using enum BilateralLaw;
using enum PerceptRole;

// The rows of Table 6.1 as section 6.11.1 describes them: haptic, audio, view.
TEST(PerceptSet, EveryRowOfTheTableHasItsRoles) {
  struct Row {
    const char* name;
    BilateralLaw law;
    Counterbalance counterbalance;
    PerceptRole haptic, audio, view;
  };
  using enum Counterbalance;
  constexpr std::array kRows{
      Row{"a:", kPf, kMechanical, kEssential, kHelpful, kHelpful},
      Row{"b1:", kSctfb, kMechanical, kEssential, kHelpful, kHelpful},
      Row{"b2: SCTFB, weight felt", kSctfb, kNone, kHelpful, kEssential, kEssential},
      Row{"b2: SCTFB, counterbalanced", kSctfb, kAutomatic, kEssential, kHelpful, kHelpful},
      Row{"c:", kPfff, kMechanical, kEssential, kHelpful, kHelpful},
      Row{"d1:", kPe, kMechanical, kWeak, kEssential, kEssential},
      Row{"d2:", kPeff, kMechanical, kWeak, kEssential, kEssential},
  };
  for (const Row& row : kRows) {
    const PerceptSet set = percept_set(row.law, row.counterbalance);
    EXPECT_EQ(std::string_view(set.row).substr(0, std::string_view(row.name).size()), row.name);
    EXPECT_EQ(set.haptic, row.haptic) << row.name;
    EXPECT_EQ(set.audio, row.audio) << row.name;
    EXPECT_EQ(set.view, row.view) << row.name;
    EXPECT_EQ(percepts_beside(row.law),
              (PerceptChoice{row.haptic != kWeak, row.audio != kWeak, row.view != kWeak, true}));
  }
}

TEST(PerceptSet, WeightMattersInCaseBAlone) {
  for (const BilateralLaw law : {kPf, kPfff, kPe, kPeff}) {
    for (const auto by : {Counterbalance::kNone, Counterbalance::kAutomatic})
      EXPECT_STREQ(percept_set(law, by).row, percept_set(law, Counterbalance::kMechanical).row);
  }
}

TEST(PerceptChoice, EveryColumnHasANumberANameAndWords) {
  struct Column {
    int number;
    const char *name, *words;
  };
  constexpr std::array kColumns{
      Column{0, "none", "no percept"},
      Column{1, "drag", "drag"},
      Column{2, "tone", "tone"},
      Column{3, "drag,tone", "drag and tone"},
      Column{4, "views", "views"},
      Column{5, "views,drag", "drag and views"},
      Column{6, "tone,views", "tone and views"},
      Column{7, "all", "drag, tone and views"},
      Column{7, "tone,drag,views", "drag, tone and views"},
      Column{8, "law", "tone and views"},
      Column{8, "automatic", "tone and views"},
  };
  for (const Column& column : kColumns) {
    EXPECT_EQ(percepts_from_name(column.name), column.number) << column.name;
    const PerceptChoice choice = percepts_of(column.number, kPe);
    EXPECT_EQ(words_of(choice), column.words);
    EXPECT_EQ(choice.automatic, column.number == kAutomaticPercepts);
    EXPECT_EQ(choice.drag, (column.number & 1) != 0);
  }
  EXPECT_EQ(percepts_of(kAutomaticPercepts, kPf), percepts_beside(kPf));
  for (const char* bad : {"", "drag,", ",", "drag,drag", "Drag", "drag tone", "all,tone", "8", "drag,smell"})
    EXPECT_EQ(percepts_from_name(bad), std::nullopt) << bad;
}

// A weight that turns with the pose, on a joint that is held.
TEST(GravityFeedForward, FadesInAndOutAndSaysWhatCarriesTheWeight) {
  GravityFeedForward weight(false, false);
  const core::JointArray gravity_Nm{8.0, -3.0};
  EXPECT_EQ(weight.in_force(), Counterbalance::kNone);
  EXPECT_EQ(weight.step(false, gravity_Nm, 0.001)[0], 0.0);
  double before_Nm = 0.0, steepest_Nm = 0.0;
  for (int tick = 0; tick < 1001; ++tick) {
    EXPECT_EQ(weight.in_force(), Counterbalance::kNone) << "some of it still stands in the loops";
    const core::JointArray torque_Nm = weight.step(true, gravity_Nm, 0.001);
    EXPECT_NEAR(torque_Nm[1] / torque_Nm[0], -3.0 / 8.0, 1e-12);
    steepest_Nm = std::max(steepest_Nm, torque_Nm[0] - before_Nm);
    before_Nm = torque_Nm[0];
    if (torque_Nm[0] == 8.0) break;
  }
  EXPECT_EQ(before_Nm, 8.0);
  EXPECT_LE(steepest_Nm, 8.0 * 0.001 / GravityFeedForward::kFade_s + 1e-12) << "never a kick";
  EXPECT_EQ(weight.in_force(), Counterbalance::kAutomatic);
  EXPECT_LT(weight.step(false, gravity_Nm, 0.001)[0], 8.0);
  EXPECT_EQ(weight.in_force(), Counterbalance::kNone);
}

TEST(GravityFeedForward, IsInForceFromTheStartIfConfiguredAndNeverOnABalancedArm) {
  GravityFeedForward heavy(false, true), balanced(true, true);
  EXPECT_EQ(heavy.in_force(), Counterbalance::kAutomatic);
  EXPECT_EQ(heavy.step(true, {5.0}, 0.001)[0], 5.0);
  for (int tick = 0; tick < 3000; ++tick) EXPECT_EQ(balanced.step(true, {5.0}, 0.001)[0], 0.0);
  EXPECT_EQ(balanced.in_force(), Counterbalance::kMechanical);
}

}  // namespace
}  // namespace phantom::teleop
