#include "components/phantom_sensing/tools/probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "common/core/errors.hpp"
#include "components/phantom_sensing/tests/rig.hpp"

namespace phantom::phantom_sensing {
namespace {

using testing::HasSubstr;

std::vector<robot::Joint> two_joints() {
  robot::Joint shoulder, slide;
  shoulder.name = "shoulder";
  shoulder.lower = -10, shoulder.upper = 10;
  slide.name = "slide";
  slide.type = robot::JointType::kPrismatic;
  slide.lower = -3, slide.upper = 3;
  return {shoulder, slide};
}

std::string probe_refusal(const std::string& csv) {
  std::istringstream stream(csv);
  try {
    read_probe_rows(stream, "poses.csv", two_joints());
  } catch (const core::ConfigError& error) {
    return error.what();
  }
  ADD_FAILURE() << "was accepted: " << csv;
  return {};
}

TEST(Probe, ReadsColumnsInAnyOrder) {
  std::istringstream csv("v1, q2, t, q1, v2\r\n1,2,3,4,5\n\n-1,-2,4,1e-3,0\n");
  const auto rows = read_probe_rows(csv, "poses.csv", two_joints());
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].t_s, 3.0);
  EXPECT_EQ(rows[0].position[0], 4.0);
  EXPECT_EQ(rows[0].position[1], 2.0);
  EXPECT_EQ(rows[0].velocity[0], 1.0);
  EXPECT_EQ(rows[1].position[0], 1e-3);
}

TEST(ProbeRefuses, WhatDoesNotFitTheArmNamingTheLine) {
  EXPECT_THAT(probe_refusal(""), HasSubstr("poses.csv:1: is empty"));
  EXPECT_THAT(probe_refusal("t,q1,q2,q3,v1,v2\n"),
              HasSubstr("poses.csv:1: column 'q3' is unknown; allowed: t, q1…q2"));
  EXPECT_THAT(probe_refusal("t,q1,v1\n"), HasSubstr("poses.csv:1: has 3 columns"));
  EXPECT_THAT(probe_refusal("t,q1,q1,v1,v2\n"), HasSubstr("column 'q1' stands twice"));
  EXPECT_THAT(probe_refusal("t,q1,q2,v1,v2\n0,1,2,3\n"), HasSubstr("poses.csv:2: has 4 values; allowed: 5"));
  EXPECT_THAT(probe_refusal("t,q1,q2,v1,v2\n0,1,nan,3,4\n"),
              HasSubstr("poses.csv:2: q2: 'nan' is not a finite number"));
  EXPECT_THAT(probe_refusal("t,q1,q2,v1,v2\n0,1,2x,3,4\n"), HasSubstr("'2x'"));
  EXPECT_THAT(probe_refusal("t,q1,q2,v1,v2\n1,0,0,0,0\n0,0,0,0,0\n"), HasSubstr("poses.csv:3: t: goes back"));
  EXPECT_THAT(
      probe_refusal("t,q1,q2,v1,v2\n0,0,0,0,0\n1,100,0,0,0\n"),
      HasSubstr("poses.csv:3: q1: 100 is beyond the limits of joint shoulder; allowed: -10 to 10 rad"));
  EXPECT_THAT(probe_refusal("t,q1,q2,v1,v2\n0,0,-3.5,0,0\n"),
              HasSubstr("q2: -3.5 is beyond the limits of joint slide; allowed: -3 to 3 m"));
}

TEST(Probe, WritesWhatTheStepGives) {
  const PhantomModel model = rig::suspended_model();
  ProbeRow row;
  row.position[0] = 0.2;
  row.velocity[0] = 0.3;
  std::ostringstream csv;
  csv.precision(17);
  const ProbePeaks peaks = run_probe_rows(model, {}, rig::wall(), {row}, {}, csv);
  PhantomSensing sensing(model, {});
  StepOutputs out;
  sensing.step(rig::hanging(0.2, 0.3, 0.0), out);
  std::istringstream lines(csv.str());
  std::string header, values;
  std::getline(lines, header);
  std::getline(lines, values);
  EXPECT_THAT(header, testing::StartsWith("t,tau1,tau2,tau3,tau4,tau5,tau6,tau7,b1,"));
  std::ostringstream expected;
  expected.precision(17);
  expected << "0," << out.percept.drag_torque[0] << ',';
  EXPECT_THAT(values, testing::StartsWith(expected.str()));
  EXPECT_THAT(values, HasSubstr(",dangerous,2,"));
  EXPECT_EQ(peaks.speed[0], 0.3);
  EXPECT_EQ(peaks.torque[0], std::abs(out.percept.drag_torque[0]));
}

TEST(Probe, WritesTheDriftOfAnArmInAMedium) {
  PhantomModel model = rig::suspended_model();
  model.medium = {{.mu_Pa_s_per_m = 2.0, .current_m_s = {0.1, 0.0, 0.0}}};
  ProbeRow row;
  row.position[0] = -0.4;  // in free water
  row.velocity[0] = 0.3;
  std::ostringstream csv;
  run_probe_rows(model, {}, rig::wall(), {row}, {}, csv);
  EXPECT_THAT(csv.str(), HasSubstr(",b7,drift1,drift2,"));
  EXPECT_THAT(csv.str(), HasSubstr(",drift7,mu,"));
  EXPECT_THAT(csv.str(), testing::ContainsRegex("\n0,.*,0\\.1[0-9]*,"));
}

}  // namespace
}  // namespace phantom::phantom_sensing
