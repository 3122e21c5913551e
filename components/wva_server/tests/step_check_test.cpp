#include "components/wva_server/step_check.hpp"

#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server {
namespace {

using StepCheck = TestCell;

std::vector<std::string> warnings_of(const std::filesystem::path& file, double weber_fraction) {
  const auto cell = runtime::load_cell(file);
  return unnoticed_step_warnings(cell, runtime::load_bodies(cell, {}), weber_fraction);
}

// 32 ÷ 20 is a step of 60 %, 100 ÷ 32 one of 212 %.
TEST_F(StepCheck, NamesObjectsAndLayersOfStepsThatAreNotFelt) {
  EXPECT_TRUE(warnings_of(cell(), 0.59).empty());
  const auto warnings = warnings_of(cell(), 0.7);
  ASSERT_EQ(warnings.size(), 1U) << "objects of one profile share a warning";
  EXPECT_EQ(warnings[0].find("ball"), 0U) << warnings[0];
  EXPECT_NE(
      warnings[0].find("who notices 70.0 % feels no step from layer 2 to layer 1 (20 to 32 Pa·s/m, 60.0 %)"),
      std::string::npos)
      << warnings[0];
}

TEST_F(StepCheck, AnObjectWithAProfileOfItsOwnIsToldApart) {
  const auto file = cell_with(
      "colour: [1, 0, 0],", "colour: [1, 0, 0], profile: {thickness_vox: [2, 2], mu_Pa_s_per_m: [11, 10]},");
  const auto warnings = warnings_of(file, 0.2);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].find("ball: "), 0U) << warnings[0];
  EXPECT_EQ(warnings[0].find("post"), std::string::npos) << warnings[0];
}

// Water that the ball's layers reach adds to them: (32 + 30) ÷ (20 + 30) is a step of 24 %.
TEST_F(StepCheck, StepsInAMediumAreSmallerThere) {
  const auto with_water_to = [&](const std::string& z_m) {
    return cell_with("objects:\n",
                     "media: [{name: water, mu_Pa_s_per_m: 30, min_m: [-0.05, -0.05, 0.1], "
                     "max_m: [0.05, 0.05, " +
                         z_m + "]}]\nobjects:\n");
  };
  EXPECT_EQ(warnings_of(with_water_to("0.21"), 0.3).size(), 1U);
  EXPECT_TRUE(warnings_of(with_water_to("0.19"), 0.3).empty());
}

}  // namespace
}  // namespace phantom::wva_server
