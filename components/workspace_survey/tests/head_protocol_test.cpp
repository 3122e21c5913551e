#include "components/workspace_survey/head/head_protocol.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>
#include <sstream>

#include "common/core/printable.hpp"
#include "components/workspace_survey/head/simulated_head.hpp"

namespace phantom::workspace_survey {
namespace {

using survey::Reading;
using testing::HasSubstr;

survey::RangeHead usual_head() {
  survey::RangeHead head;
  head.min_range_m = 0.5;
  head.max_range_m = 10.0;
  return head;
}

TEST(HeadProtocol, WhatOneEndWritesTheOtherReads) {
  const HeadRequest aim{.id = 7, .operation = HeadOperation::kAim, .pan_rad = -0.25, .tilt_rad = 0.125};
  const auto read = parse_head_request(request_line(aim));
  ASSERT_TRUE(read) << read.status().message();
  EXPECT_EQ(read->id, 7u);
  EXPECT_EQ(read->operation, HeadOperation::kAim);
  EXPECT_EQ(read->pan_rad, -0.25);
  EXPECT_EQ(read->tilt_rad, 0.125);
  EXPECT_EQ(parse_head_request(request_line({.id = 8, .operation = HeadOperation::kMeasure, .readings = 3}))
                ->readings,
            3);
  const HeadDescription description{"a \"head\"", -1.0, 1.5, 0.0, 3.0};
  const auto told = parse_description(reply_line(1, description));
  ASSERT_TRUE(told) << told.status().message();
  EXPECT_EQ(told->driver, description.driver);
  EXPECT_EQ(told->max_pan_rad, 1.5);
  EXPECT_EQ(told->min_tilt_rad, 0.0);
  EXPECT_EQ(*reply_id(reply_line(4, description)), 4u);
  const auto stands = parse_direction(reply_line(2, Reading{0.0, 0.1, 0.2}), {0.0, 0.1001, 0.2});
  ASSERT_TRUE(stands) << stands.status().message();
  EXPECT_EQ(stands->pan_rad, 0.1);
  const std::vector<Reading> readings{{3.5, 0.1, 0.2}, {3.6, 0.1, 0.2}};
  EXPECT_EQ(*parse_readings(reply_line(3, readings), usual_head(), readings[0], 2), readings);
}

TEST(HeadProtocol, EveryFaultOfAReplyIsNamed) {
  const auto description = [](const std::string& line) { return parse_description(line).status().message(); };
  EXPECT_THAT(description("hello"), HasSubstr("'hello' is no JSON object"));
  EXPECT_THAT(description("[1, 2]"), HasSubstr("is no JSON object"));
  EXPECT_THAT(description(R"({"id": 1})"), HasSubstr("contract is missing or another; allowed: 1"));
  EXPECT_THAT(description(R"({"id": 1, "contract": 2})"), HasSubstr("contract"));
  EXPECT_THAT(description(R"({"id": 1, "contract": 1, "driver": ""})"), HasSubstr("driver is missing"));
  EXPECT_THAT(description(R"({"id": 1, "contract": 1, "driver": "d", "pan_rad": [1, -1]})"),
              HasSubstr("pan_rad"));
  EXPECT_THAT(
      description(R"({"id": 1, "contract": 1, "driver": "d", "pan_rad": [-1, 1], "tilt_rad": [0, 99]})"),
      HasSubstr("tilt_rad"));
  EXPECT_THAT(description("{\"id\": 1, \"error\": \"no power\x1b[2J\"}"), HasSubstr("no JSON object"));
  EXPECT_EQ(description(R"({"id": 1, "error": "no power\u001b[2J"})"), "no power\\x1b[2J");
  EXPECT_THAT(reply_id(R"({"id": -1})").status().message(), HasSubstr("id is missing or no whole number"));
  EXPECT_THAT(reply_id(R"({"id": "1"})").status().message(), HasSubstr("id is missing"));

  const auto direction = [](const std::string& line) {
    return parse_direction(line, {0.0, 0.5, 1.0}).status().message();
  };
  EXPECT_THAT(direction(R"({"id": 1, "pan_rad": 0.5})"), HasSubstr("tilt_rad is missing"));
  EXPECT_THAT(direction(R"({"id": 1, "pan_rad": 1e999, "tilt_rad": 1})"), HasSubstr("no JSON object"));
  EXPECT_THAT(direction(R"({"id": 1, "pan_rad": 0.6, "tilt_rad": 1})"),
              HasSubstr("pan_rad is 0.60000; allowed: within 0.0017 of 0.50000"));

  const auto readings = [](const std::string& list) {
    return parse_readings("{\"id\": 1, \"readings\": " + list + "}", usual_head(), {0.0, 0.5, 1.0}, 2)
        .status()
        .message();
  };
  const std::string good = R"({"range_m": 3.5, "pan_rad": 0.5, "tilt_rad": 1})";
  EXPECT_EQ(readings("[" + good + ", " + good + "]"), "");
  EXPECT_THAT(readings("[" + good + "]"), HasSubstr("not a list of 2"));
  EXPECT_THAT(readings("3"), HasSubstr("not a list of 2"));
  EXPECT_THAT(readings("[" + good + ", 3]"), HasSubstr("reading 2: is no JSON object"));
  EXPECT_THAT(readings("[" + good + R"(, {"range_m": 35, "pan_rad": 0.5, "tilt_rad": 1}])"),
              HasSubstr("reading 2: range 35 m; allowed: 0.5 to 10 m"));
  EXPECT_THAT(readings("[" + good + R"(, {"range_m": 3.5, "pan_rad": 0.5, "tilt_rad": 1.1}])"),
              HasSubstr("reading 2: tilt_rad is 1.10000"));
  EXPECT_THAT(readings("[" + good + R"(, {"range_m": null, "pan_rad": 0.5, "tilt_rad": 1}])"),
              HasSubstr("reading 2: range_m is missing or no number"));
}

// Damaged lines: each is refused in one printable sentence, or what is read is within the limits.
TEST(HeadProtocol, WhateverALineIsItIsReadWithinTheLimitsOrRefused) {
  const Reading there{0.0, 0.5, 1.0};
  const std::vector<std::string> lines{
      reply_line(1, HeadDescription{"head", -1.0, 1.0, 0.0, 3.0}), reply_line(2, there),
      reply_line(3, std::vector<Reading>{{3.5, 0.5, 1.0}, {3.6, 0.5, 1.0}}), error_line(4, "no echo")};
  const std::string pieces = "{}[],:\"-+.eE0123456789nulltruef \\\x01\xff";
  std::mt19937_64 random(17);
  int read = 0, refused = 0;
  const auto expect_sentence = [&](const std::string& message) {
    ++refused;
    EXPECT_FALSE(message.empty());
    EXPECT_TRUE(core::is_printable(message)) << message;
  };
  for (int i = 0; i < 20000; ++i) {
    std::string line = lines[random() % lines.size()];
    for (std::uint64_t edits = random() % 4; edits > 0; --edits) {
      const std::size_t at = random() % line.size();
      random() % 2 == 0 ? line.replace(at, 1, 1, pieces[random() % pieces.size()])
                        : line.erase(at, random() % 5);
      if (line.empty()) line = "x";
    }
    if (const auto d = parse_description(line)) {
      ++read;
      EXPECT_LE(d->min_pan_rad, d->max_pan_rad);
      EXPECT_LE(std::abs(d->max_tilt_rad), 6.3);
    } else {
      expect_sentence(d.status().message());
    }
    if (const auto d = parse_direction(line, there)) {
      ++read;
      EXPECT_LE(std::abs(d->pan_rad - there.pan_rad), kHeadTolerance_rad);
    } else {
      expect_sentence(d.status().message());
    }
    if (const auto r = parse_readings(line, usual_head(), there, 2)) {
      ++read;
      for (const Reading& reading : *r) EXPECT_TRUE(survey::check_reading(usual_head(), reading));
    } else {
      expect_sentence(r.status().message());
    }
  }
  EXPECT_GT(read, 1000);
  EXPECT_GT(refused, 10000);
}

TEST(HeadProtocol, EveryFaultOfARequestIsNamed) {
  const auto said = [](const std::string& line) { return parse_head_request(line).status().message(); };
  EXPECT_THAT(said("measure"), HasSubstr("no JSON object"));
  EXPECT_THAT(said(R"({"request": "aim"})"), HasSubstr("id is missing"));
  EXPECT_THAT(said(R"({"id": 1, "request": "shoot"})"),
              HasSubstr("request is 'shoot'; allowed: describe, aim, measure"));
  EXPECT_THAT(said(R"({"id": 1, "request": "aim", "pan_rad": 0})"), HasSubstr("tilt_rad is missing"));
  EXPECT_THAT(said(R"({"id": 1, "request": "measure", "readings": 0})"), HasSubstr("allowed: 1 to 100"));
  EXPECT_THAT(said(R"({"id": 1, "request": "measure", "readings": 1.5})"), HasSubstr("allowed: 1 to 100"));
}

// The shipped driver, over a wall 2 m away.
TEST(SimulatedHead, AnswersEachLineByOne) {
  geometry::TriangleMesh wall;
  wall.vertices_m = {{2, -1, -1}, {2, 1, -1}, {2, 1, 1}, {2, -1, 1}};
  wall.triangles = {{0, 1, 2}, {0, 2, 3}};
  survey::HeadErrors errors;
  errors.range_m = 0.001;
  survey::SimulatedRanger ranger(usual_head(), errors, survey::RangerScene(wall), 1);
  std::istringstream in(
      request_line({.id = 1}) + "\n" +
      request_line({.id = 2, .operation = HeadOperation::kAim, .pan_rad = 0.1, .tilt_rad = 1.5}) + "\n" +
      request_line({.id = 3, .operation = HeadOperation::kMeasure, .readings = 4}) + "\nrubbish\n" +
      request_line({.id = 5, .operation = HeadOperation::kAim, .pan_rad = 4.0, .tilt_rad = 1.5}) + "\n" +
      request_line({.id = 6, .operation = HeadOperation::kAim, .pan_rad = 2.0, .tilt_rad = 1.5}) + "\n" +
      request_line({.id = 7, .operation = HeadOperation::kMeasure}) + "\n");
  std::ostringstream out;
  run_simulated_head(ranger, in, out);
  std::istringstream lines(out.str());
  std::vector<std::string> line(7);
  for (std::string& text : line) ASSERT_TRUE(std::getline(lines, text));
  EXPECT_EQ(parse_description(line[0])->driver, "simulated head");
  const auto stands = parse_direction(line[1], {0.0, 0.1, 1.5});
  ASSERT_TRUE(stands) << stands.status().message();
  const auto readings = parse_readings(line[2], usual_head(), *stands, 4);
  ASSERT_TRUE(readings) << readings.status().message();
  for (const Reading& reading : *readings)
    EXPECT_NEAR(reading.range_m, 2.0 / (std::cos(0.1) * std::sin(1.5)), 0.0025);
  EXPECT_NE((*readings)[0], (*readings)[1]);
  EXPECT_THAT(line[3], HasSubstr("no JSON object"));
  EXPECT_THAT(parse_direction(line[4], {0.0, 4.0, 1.5}).status().message(),
              HasSubstr("allowed: pan -3.1416"));
  EXPECT_TRUE(parse_direction(line[5], {0.0, 2.0, 1.5}));
  EXPECT_EQ(parse_readings(line[6], usual_head(), {0.0, 2.0, 1.5}, 1).status().message(), "no echo");
  std::string more;
  EXPECT_FALSE(std::getline(lines, more));
}

}  // namespace
}  // namespace phantom::workspace_survey
