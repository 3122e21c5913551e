#include "components/slave_io/contact_log.hpp"

#include <gtest/gtest.h>

namespace phantom::slave_io {
namespace {

simulation::ContactReport touch(double force_N) {
  simulation::ContactReport report;
  report.contact = true;
  report.force_N = force_N;
  report.object = 4;
  return report;
}

TEST(ContactLog, KeepsEpisodesWithSpeedBeforeAndGreatestForce) {
  ContactLog log;
  for (int i = 0; i < 100; ++i) log.step({}, 0.3, 0.001);
  log.step(touch(5), 0.2, 0.001);
  log.step(touch(9), 0.1, 0.001);
  log.step({}, 0.1, 0.001);  // chatter: the same touch
  log.step(touch(7), 0.1, 0.001);
  for (int i = 0; i < 100; ++i) log.step({}, 0.05, 0.001);
  log.step(touch(1), 0.0, 0.001);
  ASSERT_EQ(log.size(), 2U);
  EXPECT_DOUBLE_EQ(log[0].tool_speed_m_s, 0.3);
  EXPECT_DOUBLE_EQ(log[0].peak_force_N, 9);
  EXPECT_EQ(log[0].object, 4);
  EXPECT_NEAR(log[0].duration_s, 0.003, 1e-9);
  EXPECT_DOUBLE_EQ(log[1].tool_speed_m_s, 0.05);
}

TEST(ContactLog, IsFullAtItsCapacityButGoesOnCounting) {
  ContactLog log;
  for (std::size_t i = 0; i < ContactLog::kCapacity + 5; ++i) {
    log.step({}, 0.1, 1.0);
    log.step(touch(1), 0.1, 0.001);
  }
  EXPECT_EQ(log.size(), ContactLog::kCapacity);
  EXPECT_EQ(log.seen(), ContactLog::kCapacity + 5);
}

}  // namespace
}  // namespace phantom::slave_io
