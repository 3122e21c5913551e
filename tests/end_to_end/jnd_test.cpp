// A just noticeable difference, measured as docs/commissioning.md has it: the shipped drag bench with its
// simulated operator, and the command beside it.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/running_system.hpp"
#include "tests/support/child_process.hpp"

namespace phantom::end_to_end {
namespace {

TEST(JndSystem, TheCommandMeasuresOnTheRunningMasterWhatItsHandFeels) {
  RunningSystem system(0.0, "drag_bench", "",
                       {{"master_io",
                         {{"percept: alternate", "percept: on"},
                          {"in_s: 3 ", "in_s: 2 "},
                          {"pause_s: 0.3", "pause_s: 0.0"}}}});
  const auto json = system.folder() / "jnd.json";
  const auto measure = [&](const std::string& words) {
    return test::run_line(
        PHANTOM_BIN_DIR "/master_io jnd --joint x --simulated-operator 0.2 --moving-s 0.2 " + words +
        " --json " + json.string() + " --deployment " + (system.folder() / "topology.yaml").string() +
        " --domain " + std::to_string(system.network().domain));
  };
  test::Said said;
  ASSERT_TRUE(eventually(
      [&] {
        said = measure("--reversals 4 --seed 5 --gain 15");
        return said.exit_code != 3;  // no master is heard yet
      },
      120.0));
  ASSERT_EQ(said.exit_code, 0) << said.output << system.output();
  const auto outcome = nlohmann::json::parse(read_text(json));
  EXPECT_GT(outcome.at("trials").size(), 8U);
  const double reference = outcome.at("reference_felt");
  for (const auto& trial : outcome.at("trials")) {
    const double first = trial.at("first_felt"), second = trial.at("second_felt"),
                 wanted = 1.0 + trial.at("fraction").get<double>();
    EXPECT_NEAR(std::max(first, second) / std::min(first, second), wanted, 0.05 * wanted);
    EXPECT_NEAR(std::min(first, second), reference, 0.05 * reference) << "the fluid is even";
  }
  // So few reversals tell little; percept_test measures how often the interval holds the truth.
  EXPECT_GT(outcome.at("weber_fraction").get<double>(), 0.03);
  EXPECT_LT(outcome.at("weber_fraction").get<double>(), 1.0);

  said = measure("--gain 900 --first-fraction 0.1");
  EXPECT_EQ(said.exit_code, 1) << said.output;
  EXPECT_NE(said.output.find("the drag on the hand was limited"), std::string::npos) << said.output;
  system.stop();
  EXPECT_EQ(system.wait(), 0) << system.output();
}

}  // namespace
}  // namespace phantom::end_to_end
