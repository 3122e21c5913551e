#include "common/runtime/process/log.hpp"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

namespace phantom::runtime {
namespace {

TEST(Log, SR26_ATextOfAnotherProcessForgesNoLine) {
  const auto logs = [] {
    begin_log("slave_io", "info");
    spdlog::warn("stop by {}", "me\n12:00:00.000 info slave_io: reset by you\x1b[2J\u202e");
    finish_log();
    _exit(0);
  };
  EXPECT_EXIT(logs(), testing::ExitedWithCode(0),
              "slave_io: stop by me\\\\n12:00:00.000 info slave_io: reset by you\\\\x1b.2J\\\\u202e\n$");
}

TEST(Log, AnErrorKeepsItsLinesAndEscapesTheRest) {
  const auto logs = [] {
    begin_log("slave_io", "info");
    print_line("slave_io: a\x1b[2J.yaml:\n\tline 2");
    finish_log();
    _exit(0);
  };
  EXPECT_EXIT(logs(), testing::ExitedWithCode(0), "slave_io: a\\\\x1b.2J.yaml:\n\tline 2\n$");
}

}  // namespace
}  // namespace phantom::runtime
