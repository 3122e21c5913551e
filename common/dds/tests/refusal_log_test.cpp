#include "common/dds/admission/refusal_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <sstream>

namespace phantom::dds {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST(RefusalLog, TellsTheFirstAndThenOnceInAWhileAndCountsThemAll) {
  std::ostringstream logged;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(logged)));
  const core::Nanoseconds start_ns = core::kNsPerSecond;
  RefusalLog log("slave_state");
  log.refused("first", start_ns);
  log.refused("second", start_ns + RefusalLog::kEvery_ns - 1);
  log.refused("third", start_ns + RefusalLog::kEvery_ns);
  spdlog::set_default_logger(before);
  EXPECT_THAT(logged.str(),
              AllOf(HasSubstr("slave_state refused: first (1 refused so far)"),
                    HasSubstr("slave_state refused: third (3 refused so far)"), Not(HasSubstr("second"))));
}

}  // namespace
}  // namespace phantom::dds
