// The assistant steers a head: a simulated one, in this process, over a part in front of a wall.
#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "components/workspace_survey/tests/assist_rig.hpp"

namespace phantom::workspace_survey {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Ten heads, each mounted a little differently: the object is found within what is stated.
TEST_F(AssistHead, AimsMeasuresAndFitsWithinWhatIsStated) {
  int within = 0;
  double worst_m = 0.0;
  constexpr int kHeads = 10;
  for (std::uint64_t seed = 1; seed <= kHeads; ++seed) {
    mount(seed);
    std::map<std::uint32_t, std::size_t> names;
    std::string typed;
    for (const survey::VisibleFace& face : faces()) typed += person().face_lines(face, names);
    const std::string said = dialogue(typed + "save x\n");
    ASSERT_EQ(exit_code_, 0) << said;
    ASSERT_THAT(said, AllOf(HasSubstr("Head: in this process"), HasSubstr("the head stands at pan"),
                            HasSubstr("part:        v_groove_block"), HasSubstr("A pose is found"),
                            HasSubstr("the head's mounting alone")));
    const auto measurement = survey::register_nodes(config_.head, config_.errors, saved_);
    ASSERT_TRUE(measurement);
    const auto result = survey::survey_object(shipped_library().models, *measurement, config_.options);
    ASSERT_TRUE(result.object) << result.refusal;
    const double off_m = survey::displacement_between_m(part(), result.object->fit.X_WO, X_WO_);
    within += off_m <= result.object->worst_displacement_m;
    worst_m = std::max(worst_m, off_m);
    EXPECT_GT(result.object->mounting_displacement_m, 0.004) << "0.05 degrees and 1 mm";
  }
  EXPECT_GE(within, kHeads - 1) << "stated for 99 %";
  EXPECT_LT(worst_m, 0.012);
  EXPECT_GT(worst_m, 0.0005);
}

// After one face the model says where the next corners are: the head turns there.
TEST_F(AssistHead, NextTurnsTheHeadToTheCornersOfTheNextFace) {
  mount(3);
  const auto seen = faces();
  ASSERT_GE(seen.size(), 2u);
  std::map<std::uint32_t, std::size_t> names;
  const std::string first = person().face_lines(seen[0], names);
  const std::string said = dialogue("next\n" + first + "next\nnext\n");
  const auto done = said.find("corner 1> ", said.find("face B"));
  ASSERT_NE(done, std::string::npos) << said;
  EXPECT_THAT(said.substr(0, done), HasSubstr("no part is placed yet"));
  EXPECT_THAT(said.substr(done), HasSubstr("if it is v_groove_block: corner 1 of"));
  // Whatever it proposes: a direction is that of a corner of the part that was not measured, or it is a node.
  std::istringstream lines(said.substr(done));
  int proposals = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("which is node") != std::string::npos) ++proposals;
    const auto at = line.find("the head stands at pan ");
    if (at == std::string::npos) continue;
    double pan_deg = 0.0, tilt_deg = 0.0;
    ASSERT_EQ(std::sscanf(line.c_str() + at, "the head stands at pan %lf deg, tilt %lf", &pan_deg, &tilt_deg),
              2);
    double nearest_deg = 180.0;
    for (std::uint32_t node = 0; node < part().nodes_O_m.size(); ++node) {
      if (names.contains(node)) continue;
      const auto to = survey::aim(mounted_, X_WO_ * part().nodes_O_m[node]);
      nearest_deg = std::min(nearest_deg, std::hypot(to->pan_rad / core::kRadPerDegree - pan_deg,
                                                     to->tilt_rad / core::kRadPerDegree - tilt_deg));
    }
    EXPECT_LT(nearest_deg, 0.4) << "25 mm at 3.5 m";
    ++proposals;
  }
  EXPECT_EQ(proposals, 2);
}

// Tries workspace_survey: the spot lies over an edge
TEST_F(AssistHead, ASpotOverAnEdgeIsRefusedAndAWholeOneIsTaken) {
  config_.errors = shipped_config().errors;  // the head jitters
  mount(4);
  const survey::VisibleFace face = faces().front();
  const Eigen::Vector3d a = X_WO_ * part().nodes_O_m[face.nodes[0]],
                        b = X_WO_ * part().nodes_O_m[face.nodes[1]];
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::uint32_t node : face.nodes)
    middle += X_WO_ * part().nodes_O_m[node] / static_cast<double>(face.nodes.size());
  std::string over_edge;
  for (int i = 0; i < 12; ++i) over_edge += person().aim_line(0.5 * (a + b)) + "measure\n";
  EXPECT_THAT(dialogue(over_edge), HasSubstr("refused: 5 readings differ by"));
  EXPECT_THAT(dialogue(person().aim_line(middle) + "measure\n"),
              AllOf(HasSubstr("node 1:"), Not(HasSubstr("readings differ"))));
}

// Tries workspace_survey: the head does not reach a direction; has no echo
TEST_F(AssistHead, WhatCannotBeDoneIsSaid) {
  mount(5);
  const std::string said = dialogue(
      "help\nmeasure\njog 1 0\naim 200 90\naim 10\naim 1 x\naim 0 170\nmeasure\njog 0 -90\nagain 1\n");
  EXPECT_THAT(said, AllOf(HasSubstr("jog DPAN DTILT"), HasSubstr("the head was not aimed yet; aim it first"),
                          HasSubstr("does not reach pan 200.000 deg"),
                          HasSubstr("needs two angles in degrees: aim PAN TILT"), HasSubstr("no echo"),
                          HasSubstr("stands at pan 0.0000 deg, tilt 79.99")));
  EXPECT_EQ(exit_code_, 1);
}

}  // namespace
}  // namespace phantom::workspace_survey
