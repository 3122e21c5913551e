#include "components/simulated_drive/motion_record.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "tests/support/files.hpp"
#include "tests/support/local_bus.hpp"

namespace phantom::simulated_drive {
namespace {

using testing::HasSubstr;

std::vector<std::vector<std::string>> rows_of(const std::filesystem::path& file) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(test::read_text(file));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

class MotionRecords : public testing::Test {
 protected:
  MotionRecords() : drive_({.node = 3, .motor = {.start_rad = 0.4}}, bus_.connect("drive")) {}
  simulation::LocalBus bus_;
  SimulatedDrive drive_;
  std::filesystem::path file_ = test::new_file("", ".csv");
};

TEST_F(MotionRecords, ADriveHasARowWhenItChangesAndNowAndThen) {
  auto record = MotionRecord::open(file_).value();
  core::Nanoseconds now_ns = core::kNsPerSecond;
  for (int i = 0; i < 45; ++i, now_ns += core::kNsPerMillisecond) {
    if (i == 30) drive_.trip(0x3210);
    drive_.step(now_ns);
    record.note(0, drive_, now_ns);
  }
  ASSERT_TRUE(record.flush());
  const auto rows = rows_of(file_);
  ASSERT_EQ(rows.size(), 3U);  // at the start, after 20 ms, at the fault after 30 ms
  EXPECT_EQ(rows[0], (std::vector<std::string>{"1000000000", "3", "disabled", "0", "0.400000", "0", "true"}));
  EXPECT_EQ(rows[1][0], "1020000000");
  EXPECT_EQ(rows[2][0], "1030000000");
  EXPECT_EQ(rows[2][2], "fault");
}

// Tries simulated_drive: its record cannot be written
TEST_F(MotionRecords, WhatWasThereStaysAndAFileThatCannotBeIsAnError) {
  for (int i = 0; i < 2; ++i) {
    auto record = MotionRecord::open(file_).value();
    drive_.step(core::kNsPerSecond + i);
    record.note(0, drive_, core::kNsPerSecond + i);
  }
  EXPECT_EQ(rows_of(file_).size(), 2U);
  const auto refused = MotionRecord::open("/no/such/folder/record.csv");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.status().message(), HasSubstr("/no/such/folder/record.csv"));
}

}  // namespace
}  // namespace phantom::simulated_drive
