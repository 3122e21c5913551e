#include "components/dds_spy/config.hpp"

#include <gtest/gtest.h>

#include "common/core/errors.hpp"
#include "tests/support/files.hpp"

namespace phantom::dds_spy {
namespace {

TEST(Config, TheShippedFileSaysTheDefaults) {
  const Config shipped = load_config(PHANTOM_SOURCE_DIR "/components/dds_spy/dds_spy.yaml"), none;
  EXPECT_EQ(shipped.discovery_s, none.discovery_s);
  EXPECT_EQ(shipped.measure_s, none.measure_s);
  EXPECT_EQ(shipped.refresh_s, none.refresh_s);
  EXPECT_EQ(shipped.quiet_s, none.quiet_s);
  EXPECT_EQ(shipped.most_events, none.most_events);
}

TEST(Config, WhatIsNotAllowedIsNamed) {
  for (const char* text : {"refresh_s: 0", "most_events: 0", "quiet_s: -1", "refresh: 1"}) {
    try {
      load_config(test::new_file(text));
      FAIL() << text;
    } catch (const core::ConfigError& problem) {
      EXPECT_NE(std::string(problem.what()).find(":1: "), std::string::npos) << problem.what();
    }
  }
}

}  // namespace
}  // namespace phantom::dds_spy
