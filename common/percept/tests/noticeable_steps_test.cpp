#include "common/percept/noticeable_steps.hpp"

#include <gtest/gtest.h>

namespace phantom::percept {
namespace {

workspace::LayerProfile thesis_profile() {
  workspace::LayerProfile profile;
  profile.thickness_vox = {4, 4, 4, 4, 4, 4};
  profile.mu_Pa_s_per_m = {32, 20, 13, 11, 10, 9};
  return profile;
}

// Worked by hand: 10/9, 11/10, 13/11, 20/13, 32/20, 100/32.
TEST(NoticeableSteps, AreThoseOfTheProfileOnTheWayIn) {
  const auto steps = layer_steps(thesis_profile());
  const double wanted[] = {1.0 / 9, 0.1, 2.0 / 11, 7.0 / 13, 0.6, 2.125};
  ASSERT_EQ(steps.size(), std::size(wanted));
  for (std::size_t i = 0; i < steps.size(); ++i) EXPECT_NEAR(steps[i].fraction, wanted[i], 1e-6) << i;
  EXPECT_EQ(steps.front().outer, "layer 6");
  EXPECT_EQ(steps.front().inner, "layer 5");
  EXPECT_EQ(steps.back().inner, "boundary");
}

TEST(NoticeableSteps, ThoseBelowTheWeberFractionAreToldWithTheirLayers) {
  const auto notes = unnoticed_steps(thesis_profile(), 0.15);
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_EQ(notes[0], "from layer 6 to layer 5 (9 to 10 Pa·s/m, 11.1 %)");
  EXPECT_EQ(unnoticed_steps(thesis_profile(), 0.2).size(), 3U);
  EXPECT_TRUE(unnoticed_steps(thesis_profile(), 0.099).empty());
  EXPECT_TRUE(unnoticed_steps(thesis_profile(), 0.1).empty()) << "a step as great is noticed";
}

// In water of 10 Pa·s/m the outermost layer is a step of 90 %, and all others are smaller than in air.
TEST(NoticeableSteps, AMediumMakesThemSmallerAndTheFirstFinite) {
  const auto air = layer_steps(thesis_profile()), water = layer_steps(thesis_profile(), 10.0);
  ASSERT_EQ(water.size(), air.size() + 1);
  EXPECT_EQ(water.front().outer, "medium");
  EXPECT_NEAR(water.front().fraction, 0.9, 1e-6);
  EXPECT_NEAR(water[1].fraction, 1.0 / 19, 1e-6);
  for (std::size_t i = 0; i < air.size(); ++i) EXPECT_LT(water[i + 1].fraction, air[i].fraction);
}

TEST(NoticeableSteps, GoOnInsideASoftBody) {
  workspace::LayerProfile tissue;
  tissue.thickness_vox = {4};
  tissue.mu_Pa_s_per_m = {8};
  tissue.inside_thickness_vox = {2, 2};
  tissue.mu_inside_Pa_s_per_m = {10, 11};
  tissue.mu_skin_Pa_s_per_m = 33;
  const auto steps = layer_steps(tissue);
  ASSERT_EQ(steps.size(), 3U);
  EXPECT_NEAR(steps[0].fraction, 0.25, 1e-6) << "the boundary has layer −1's viscosity";
  EXPECT_EQ(steps[1].inner, "layer -2");
  EXPECT_NEAR(steps[1].fraction, 0.1, 1e-6);
  EXPECT_EQ(steps[2].inner, "interior");
  EXPECT_NEAR(steps[2].fraction, 2.0, 1e-6);
}

}  // namespace
}  // namespace phantom::percept
