#include "components/workspace_survey/measurement_file.hpp"

#include <random>

#include "components/workspace_survey/tests/rig.hpp"

namespace phantom::workspace_survey {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kHead = "face,part,node,range_mm,pan_deg,tilt_deg\n";

std::string said(const std::string& text) {
  return refusal([&] { read_measurements_text(text, "points.csv"); });
}

TEST(MeasurementFile, UnitsAreThoseOfTheColumns) {
  const auto a = read_measurements_text(kHead + "# a comment\nA,whole,1,3500,90,45\nA,whole,2,,,\n", "a");
  const auto b = read_measurements_text(
      "node,face,tilt_rad,pan_rad,range_m\r\n1, A , 0.78539816339744831,1.5707963267948966,3.5\r\n", "b");
  ASSERT_EQ(a.size(), 2u);
  EXPECT_NEAR(a[0].reading->range_m, 3.5, 1e-12);
  EXPECT_NEAR(a[0].reading->pan_rad, b[0].reading->pan_rad, 1e-12);
  EXPECT_NEAR(a[0].reading->tilt_rad, b[0].reading->tilt_rad, 1e-12);
  EXPECT_EQ(a[0].place, "a:3");
  EXPECT_FALSE(a[1].reading);
  EXPECT_EQ(b[0].face, "A");
  EXPECT_TRUE(b[0].closed);
}

TEST(MeasurementFile, WhatIsWrittenIsReadAgain) {
  std::vector<survey::Targeting> written{{"top", true, "1", survey::Reading{3.51234, 0.25, 1.0}, {}},
                                         {"side", false, "1", std::nullopt, {}}};
  std::ostringstream text;
  write_measurements(text, written, "two lines\nof comment");
  const auto read = read_measurements_text(text.str(), "x");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_NEAR(read[0].reading->range_m, 3.51234, 1e-5);
  EXPECT_NEAR(read[0].reading->pan_rad, 0.25, 1e-6);
  EXPECT_FALSE(read[1].closed);
  EXPECT_EQ(read[1].node, "1");
}

// Tries workspace_survey: a range of 0; NaN
// Tries workspace_survey: a column without unit; a line with a cell too few
TEST(MeasurementFile, EachFaultIsNamedWithItsPlaceAndWhatIsAllowed) {
  EXPECT_THAT(said(""), HasSubstr("points.csv: holds no measurement"));
  EXPECT_THAT(said(kHead), HasSubstr("holds no measurement"));
  EXPECT_THAT(said("face,node,range_inch,pan_deg,tilt_deg\n"),
              AllOf(HasSubstr("points.csv:1"), HasSubstr("'range_inch'"), HasSubstr("wrong one; allowed:"),
                    HasSubstr("range_m or range_mm")));
  EXPECT_THAT(said("face,node,range,pan_deg,tilt_deg\n"), HasSubstr("'range'"));
  EXPECT_THAT(said("face,node,range_m,range_mm,pan_deg,tilt_deg\n"), HasSubstr("say the same"));
  EXPECT_THAT(said("face,node,range_m,pan_deg\n"), HasSubstr("column 'tilt_deg' is missing"));
  EXPECT_THAT(said(kHead + "A,whole,1,0,1,2\n"),
              AllOf(HasSubstr("points.csv:2"), HasSubstr("range_mm is '0'; allowed: more than 0")));
  EXPECT_THAT(said(kHead + "A,whole,1,-3,1,2\n"), HasSubstr("range_mm is '-3'"));
  EXPECT_THAT(said(kHead + "A,whole,1,nan,1,2\n"), HasSubstr("range_mm is 'nan'; allowed: a finite number"));
  EXPECT_THAT(said(kHead + "A,whole,1,3500,inf,2\n"), HasSubstr("pan_deg is 'inf'"));
  EXPECT_THAT(said(kHead + "A,whole,1,3500mm,1,2\n"), HasSubstr("range_mm is '3500mm'; allowed: a number"));
  EXPECT_THAT(said(kHead + "A,whole,1,3500,1\n"), HasSubstr("has 5 cells; allowed: 6"));
  EXPECT_THAT(said(kHead + "A,half,1,3500,1,2\n"), HasSubstr("part is 'half'; allowed: whole, part"));
  EXPECT_THAT(said(kHead + "A,whole,,3500,1,2\n"), HasSubstr("node is ''"));
  EXPECT_THAT(said("node,face,range_mm,pan_deg,tilt_deg\n1,#A,3500,1,2\n"),
              AllOf(HasSubstr("points.csv:2: face is '#A'"), HasSubstr("without # in front")));
  EXPECT_THAT(said(kHead + "A,whole,1,3500,,2\n"), HasSubstr("some of range, pan and tilt"));
  EXPECT_THAT(refusal([] { read_measurements("/nowhere/points.csv"); }),
              HasSubstr("/nowhere/points.csv: no such file"));
}

/// What of a text ends in a measurement, a refusal that names its place, or nothing else.
void survives(const std::string& text, const Config& config) {
  try {
    const auto measurement =
        survey::register_nodes(config.head, config.errors, read_measurements_text(text, "fuzz.csv"));
    if (!measurement) {
      EXPECT_THAT(measurement.status().message(), HasSubstr("fuzz.csv:"));
      return;
    }
    const auto result = survey::survey_object(shipped_library().models, *measurement, config.options);
    EXPECT_NE(result.object.has_value(), !result.refusal.empty()) << text;
    if (!result.object) return;
    EXPECT_TRUE(result.object->fit.X_WO.translation_m.allFinite());
    EXPECT_LE(result.object->worst_displacement_m, config.options.largest_displacement_m);
  } catch (const core::ConfigError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("fuzz.csv")) << text;
  }
}

// Seeded mutations of a shipped file: bytes, lines, numbers.
TEST(MeasurementFile, NoMutationOfAFileDoesAnythingElseThanBeReadOrBeRefusedByName) {
  const Config config = shipped_config();
  std::ifstream stream(source("deploy/parts/measurements/wedge.csv"));
  const std::string good{std::istreambuf_iterator<char>(stream), {}};
  ASSERT_FALSE(good.empty());
  std::mt19937 random(99);
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const std::vector<std::string> tokens{"nan",   "inf", "0",    "-1",    "1e999",
                                        "1e308", ",",   "\n",   "whole", "part",
                                        "\"",    "é",   "3500", "#",     std::string(1, '\0'),
                                        "1",     "2"};
  for (int i = 0; i < 1500; ++i) {
    std::string text = good;
    for (std::size_t n = 1 + pick(4); n > 0; --n) {
      const std::size_t at = pick(text.size());
      switch (pick(4)) {
        case 0:
          text[at] = static_cast<char>(pick(256));
          break;
        case 1:
          text.insert(at, tokens[pick(tokens.size())]);
          break;
        case 2:
          text.erase(at, 1 + pick(12));
          break;
        default:
          text.insert(at, text.substr(pick(text.size()), 1 + pick(60)));
          break;
      }
      if (text.empty()) text.push_back('x');
    }
    survives(text, config);
  }
}

}  // namespace
}  // namespace phantom::workspace_survey
