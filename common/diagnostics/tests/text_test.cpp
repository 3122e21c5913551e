#include "common/diagnostics/text.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace phantom::diagnostics::text_test {
namespace {

using Json = nlohmann::ordered_json;

TEST(Text, ASampleReadsLikeYaml) {
  const Json sample =
      Json::parse(R"({"stamp":{"sequence_number":7,"session":18446744073709551615},"state":"LINK_COUPLED",
    "message":"","closeness":"NaN","x":-0.22374000000000002,"zero":0.0,"valid":true,
    "torque":[0.5,0.0,0.0,0.0,0.0,1.0],"pair":[0,0,0],"none":[],
    "points":[{"name":"elbow","pgv":{"x":1.0,"y":2.0,"z":3.0}},{"name":"wrist","pgv":{"x":0.0,"y":0.0,"z":1e-12}}],
    "small":[{"a":1},{"a":2}]})");
  EXPECT_EQ(to_text(sample),
            "stamp: {sequence_number: 7, session: 18446744073709551615}\n"
            "state: LINK_COUPLED\n"
            "message: \"\"\n"
            "closeness: NaN\n"
            "x: -0.22374\n"
            "zero: 0\n"
            "valid: true\n"
            "torque: [0.5, 0 (×4), 1]\n"
            "pair: [0, 0, 0]\n"
            "none: []\n"
            "points:\n"
            "  - name: elbow\n"
            "    pgv: {x: 1, y: 2, z: 3}\n"
            "  - name: wrist\n"
            "    pgv: {x: 0, y: 0, z: 1e-12}\n"
            "small:\n"
            "  - {a: 1}\n"
            "  - {a: 2}\n");
}

TEST(Text, AStructThatIsTooWideForALineGetsOneForEachMember) {
  Json wide = Json::object();
  for (int i = 0; i < 20; ++i) wide["member_" + std::to_string(i)] = i;
  const std::string text = to_text({{"wide", wide}});
  EXPECT_EQ(text.substr(0, 29), "wide:\n  member_0: 0\n  member_");
}

TEST(Text, TextOfSeveralLinesStaysOnOne) { EXPECT_EQ(to_text({{"m", "a\nb"}}), "m: \"a\\nb\"\n"); }

TEST(Text, ALineOfJsonNeverFails) { EXPECT_EQ(to_line({{"m", "\xff"}}), "{\"m\":\"\uFFFD\"}"); }

}  // namespace
}  // namespace phantom::diagnostics::text_test
