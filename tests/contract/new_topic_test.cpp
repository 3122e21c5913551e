// The topic of docs/new_topic.md, which two edits have added to a copy of the IDL: its codec as it was made.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/messages/codecs/teleoperation_codec.hpp"

namespace phantom::messages {
namespace {

using testing::HasSubstr;

msg::ToolTemperature a_temperature() {
  msg::ToolTemperature message;
  message.stamp().sequence_number(7);
  message.sensor("tip");
  message.kind(msg::TemperatureKind::TEMPERATURE_RADIATION);
  message.least_K(290.0), message.greatest_K(310.0), message.spread_K(-1.0);
  return message;
}

TEST(NewTopic, ItsSampleHasWhatTheMessageSays) {
  const auto sample = from_idl(a_temperature());
  ASSERT_TRUE(sample) << sample.status().message();
  EXPECT_EQ(sample->stamp.sequence_number, 7U);
  EXPECT_EQ(sample->sensor, "tip");
  EXPECT_EQ(sample->kind, TemperatureKind::kRadiation);
  EXPECT_EQ(sample->greatest_K, 310.0);
  EXPECT_EQ(to_idl(*sample), a_temperature());
  EXPECT_EQ(ToolTemperature().spread_K, -1.0) << "unknown, until it is known";
}

TEST(NewTopic, ItsRangesAndItsRuleAreChecked) {
  const auto refusal = [](auto change) {
    msg::ToolTemperature message = a_temperature();
    change(message);
    return from_idl(message).status().message();
  };
  EXPECT_EQ(refusal([](auto& m) { m.greatest_K(5001.0); }), "greatest_K is 5001; allowed: 0 to 5000");
  EXPECT_EQ(refusal([](auto& m) { m.least_K(std::nan("")); }), "least_K is not finite");
  EXPECT_EQ(refusal([](auto& m) { m.spread_K(-2.0); }), "spread_K is -2; allowed: -1 to 100");
  EXPECT_EQ(refusal([](auto& m) { m.kind(static_cast<msg::TemperatureKind>(2)); }),
            "kind is 2; allowed: 0 to 1");
  EXPECT_THAT(refusal([](auto& m) { m.sensor("two\nlines"); }), HasSubstr("sensor has control characters"));
  EXPECT_EQ(refusal([](auto& m) { m.least_K(311.0); }), "least_K is above greatest_K; allowed: at most that");
  SlaveState state;
  EXPECT_EQ(from_idl(to_idl(state)).status().message(), "stamp.sequence_number is 0; allowed: 1 or more")
      << "the family's other topics are as they were";
}

}  // namespace
}  // namespace phantom::messages
