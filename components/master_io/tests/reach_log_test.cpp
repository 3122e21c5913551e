#include "components/master_io/reaches/reach_log.hpp"

#include <gtest/gtest.h>

namespace phantom::master_io {
namespace {

ReachObservation reach(std::int32_t number, double percept_Nm) {
  ReachObservation seen;
  seen.number = number;
  seen.index = 2;
  seen.percept = number % 2 == 0;
  seen.percept_Nm[3] = -percept_Nm;
  return seen;
}

TEST(ReachLog, KeepsOnsetPeakAndContactOfEachReach) {
  ReachLog log;
  SlaveSample slave;
  log.step(reach(-1, 0), slave, 1.0);
  EXPECT_EQ(log.size(), 0U);
  slave.clearance_m = 0.1, slave.tool_speed_m_s = 0.4;
  log.step(reach(0, 0.0), slave, 1.0);
  slave.clearance_m = 0.08;
  log.step(reach(0, 0.5), slave, 1.0);
  slave.clearance_m = 0.01, slave.tool_speed_m_s = 0.2;
  log.step(reach(0, 1.5), slave, 1.0);
  slave.contact = true, slave.contact_object = 5, slave.tool_speed_m_s = 0.05;
  log.step(reach(0, 2.0), slave, 1.0);
  slave.contact = false;
  log.step(reach(0, 3.0), slave, 1.0);  // on the way back: no longer of interest
  log.step(reach(1, 0.0), slave, 1.0);
  ASSERT_EQ(log.size(), 2U);
  EXPECT_TRUE(log[0].percept);
  EXPECT_EQ(log[0].index, 2U);
  EXPECT_DOUBLE_EQ(log[0].start_s, 2.0);
  EXPECT_DOUBLE_EQ(log[0].onset_clearance_m, 0.08);
  EXPECT_DOUBLE_EQ(log[0].peak_percept_Nm, 1.5);
  EXPECT_DOUBLE_EQ(log[0].contact_s, 5.0);
  EXPECT_DOUBLE_EQ(log[0].contact_speed_m_s, 0.2);
  EXPECT_EQ(log[0].contact_object, 5);
  EXPECT_FALSE(log[1].percept);
  EXPECT_LT(log[1].contact_s, 0.0);
}

TEST(ReachLog, IsFullAtItsCapacity) {
  ReachLog log;
  for (std::int32_t n = 0; n < static_cast<std::int32_t>(ReachLog::kCapacity) + 10; ++n)
    log.step(reach(n, 0.1), {}, 1.0);
  EXPECT_EQ(log.size(), ReachLog::kCapacity);
}

}  // namespace
}  // namespace phantom::master_io
