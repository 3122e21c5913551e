#include "common/dds/endpoints/fast_dds_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <fastdds/dds/log/Log.hpp>

namespace phantom::dds {
namespace {

using eprosima::fastdds::dds::Log;

void log_late() {
  Log::QueueLog("late", Log::Context{__FILE__, __LINE__, __func__, "TEST"}, Log::Kind::Error);
  Log::Flush();
}

// Fast DDS's log thread outlives the project's log at a process's end.
TEST(FastDdsLog, WhatIsLoggedWhileTheProcessEndsDoesNoHarm) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        Log::Flush();           // makes Fast DDS's log,
        std::atexit(log_late);  // which ends after this
        spdlog::set_default_logger(spdlog::stderr_logger_st("to stderr"));
        take_over_fast_dds_log();
        std::exit(0);
      },
      testing::ExitedWithCode(0), testing::Not(testing::HasSubstr("late")));
}

}  // namespace
}  // namespace phantom::dds
