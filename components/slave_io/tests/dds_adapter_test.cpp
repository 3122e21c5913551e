#include "components/slave_io/dds_adapter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>

#include "common/dds/endpoint.hpp"
#include "common/dds/source_guard.hpp"
#include "common/dds/tests/test_network.hpp"
#include "components/slave_io/dds_adapter_convert.hpp"

namespace phantom::slave_io {
namespace {

msg::MasterState good() {
  msg::MasterState master;
  master.stamp().sequence_number(7);
  master.stamp().monotonic_ns(123);
  master.stamp().session(99);
  master.joint_count(7);
  master.state(msg::LINK_COUPLED);
  for (std::size_t j = 0; j < 7; ++j) master.position_rad()[j] = 0.1 * static_cast<double>(j);
  return master;
}

Expectations expected() {
  Expectations e;
  e.joint_count = 7;
  e.lower.fill(-1.0);
  e.upper.fill(1.0);
  e.lower[6] = -std::numeric_limits<double>::infinity();  // turns endlessly
  e.upper[6] = std::numeric_limits<double>::infinity();
  return e;
}

TEST(SlaveAdapter, AMasterBeyondTheJointsLimitsIsRefusedNotFollowed) {
  auto master = good();
  for (const double q : {1.099, -1.099}) {  // 5 % of the range of 2 rad beyond: pushed onto its stop
    master.position_rad()[2] = q;
    EXPECT_EQ(refusal(master, expected()), nullptr) << q;
  }
  for (const double q : {1.101, -1.101, 3.0, -1e9}) {
    master.position_rad()[2] = q;
    EXPECT_THAT(refusal(master, expected()), testing::HasSubstr("far outside of its joint's limits")) << q;
  }
  master = good();
  master.position_rad()[6] = 1e3;
  EXPECT_EQ(refusal(master, expected()), nullptr) << "that joint has no limits";
}

TEST(SlaveAdapter, AValidMasterStateComesThroughWhole) {
  auto master = good();
  master.velocity_rad_s()[2] = -0.4;
  EXPECT_EQ(refusal(master, expected()), nullptr);
  const auto sample = to_sample(master, 5000, 8);
  EXPECT_EQ(sample.received_ns, 5000);
  EXPECT_EQ(sample.stamp.sequence_number, 7U);
  EXPECT_EQ(sample.stamp.monotonic_ns, 123);
  EXPECT_EQ(sample.stamp.session, 99U);
  EXPECT_EQ(sample.state, teleop::LinkState::kCoupled);
  EXPECT_EQ(sample.position, master.position_rad());
  EXPECT_EQ(sample.velocity[2], -0.4);
}

TEST(SlaveAdapter, AnEchoOfATimeThatCannotBeIsNone) {
  auto master = good();
  master.slave_echo().session(8);
  master.slave_echo().sequence_number(5);
  for (const core::Nanoseconds odd_ns :
       {std::numeric_limits<core::Nanoseconds>::min(), core::Nanoseconds{-1}, core::Nanoseconds{5001},
        std::numeric_limits<core::Nanoseconds>::max()}) {
    master.slave_echo().monotonic_ns(odd_ns);
    EXPECT_EQ(to_sample(master, 5000, 8).answers_ns, 0);
  }
  master.slave_echo().monotonic_ns(4000);
  EXPECT_EQ(to_sample(master, 5000, 8).answers_ns, 4000);
}

TEST(SlaveAdapter, WhatIsNotANumberIsRefused) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    auto master = good();
    master.position_rad()[3] = bad;
    EXPECT_THAT(refusal(master, expected()), testing::HasSubstr("position"));
    master = good();
    master.velocity_rad_s()[6] = bad;
    EXPECT_THAT(refusal(master, expected()), testing::HasSubstr("velocity"));
    master = good();
    master.position_rad()[8] = bad;  // beyond the joints: nobody reads it
    EXPECT_EQ(refusal(master, expected()), nullptr);
  }
}

TEST(SlaveAdapter, AnotherJointCountIsRefused) {
  auto master = good();
  for (const std::uint32_t count : {0U, 6U, 8U, 17U, 4'000'000'000U}) {
    master.joint_count(count);
    EXPECT_THAT(refusal(master, expected()), testing::HasSubstr("joint count"));
  }
}

TEST(SlaveAdapter, AnUnnumberedSampleOrAnUnknownStateIsRefused) {
  auto master = good();
  master.stamp().sequence_number(0);
  EXPECT_NE(refusal(master, expected()), nullptr);
  master = good();
  master.state(static_cast<msg::LinkState>(17));
  EXPECT_THAT(refusal(master, expected()), testing::HasSubstr("state"));
}

TEST(SlaveAdapter, ReorderedAndRepeatedSamplesAreRefusedARestartedMasterIsNot) {
  dds::SourceGuard source;
  auto master = good();
  core::Nanoseconds now_ns = core::kNsPerSecond;
  const auto takes = [&] {
    return source.assess(master.stamp(), now_ns) == dds::SourceGuard::Verdict::kAccepted;
  };
  EXPECT_TRUE(takes());
  EXPECT_FALSE(takes());
  master.stamp().sequence_number(5);
  EXPECT_FALSE(takes());
  master.stamp().session(100);
  now_ns += dds::SourceGuard::kHold_ns;
  EXPECT_TRUE(takes());
}

TEST(SlaveAdapter, AMasterThatAnswersAnotherSlaveIsToldFromOneThatAnswersNobodyYet) {
  auto master = good();
  EXPECT_FALSE(to_sample(master, 5000, 8).answers_another) << "no echo yet";
  master.slave_echo().session(8);
  master.slave_echo().sequence_number(3);
  EXPECT_FALSE(to_sample(master, 5000, 8).answers_another);
  master.slave_echo().session(9);
  EXPECT_TRUE(to_sample(master, 5000, 8).answers_another);
}

// On the real topics: the first writer is followed, the second one refused and told; when the first ends, the
// second takes its place.
TEST(SlaveAdapter, OfTwoMastersOnTheTopicOnlyTheFirstIsFollowed) {
  const auto network = dds::test_network();
  Inbox inbox;
  DdsAdapter adapter(network, expected(), inbox);
  auto first = std::make_unique<dds::Participant>("master_io", network);
  dds::Participant second("master_io", network);
  auto first_writer = std::make_unique<dds::Writer<msg::MasterState>>(*first, dds::kMasterState);
  dds::Writer<msg::MasterState> second_writer(second, dds::kMasterState);
  dds::Stamper first_stamper(*first), second_stamper(second);
  std::mutex mutex;
  std::string told;
  dds::Reader<msg::ComponentStatus> statuses(second, dds::kComponentStatus,
                                             [&](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                                               const std::lock_guard lock(mutex);
                                               told = s.message().to_string();
                                             });
  const auto write = [](auto& writer, auto& stamper, double q) {
    auto master = good();
    master.position_rad().fill(q);
    master.stamp(stamper.next());
    writer.write(master);
  };
  MasterSample sample;
  const auto until = [&](const auto& step, const auto& done) {
    for (int i = 0; i < 3000; ++i) {
      step();
      inbox.master.read(sample);
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  };
  ASSERT_TRUE(
      until([&] { write(*first_writer, first_stamper, 0.5); }, [&] { return sample.position[0] == 0.5; }));
  ASSERT_TRUE(until(
      [&] {
        write(*first_writer, first_stamper, 0.5);
        write(second_writer, second_stamper, 0.9);
        adapter.publish_health({core::ComponentState::kRunning, "", {}, {}});
      },
      [&] {
        const std::lock_guard lock(mutex);
        return told.find("two processes send master_state") != std::string::npos;
      }));
  EXPECT_EQ(sample.position[0], 0.5) << "whoever came first";
  first_writer.reset();
  EXPECT_TRUE(
      until([&] { write(second_writer, second_stamper, 0.9); }, [&] { return sample.position[0] == 0.9; }))
      << "it takes the first one's place";
}

TEST(SlaveAdapter, TheReportBecomesAMessageFieldByField) {
  SlaveReport report;
  report.outputs.state = teleop::LinkState::kDegraded;
  report.outputs.stop = {44, teleop::StopCause::kDriveFault};
  report.outputs.torque.loop_Nm[1] = 3.5;
  report.followed = {41, 42, 43};
  report.position[0] = 0.25;
  report.velocity[0] = -0.5;
  report.force_measured = true;
  report.external_torque_Nm[2] = -4.5;
  report.contact = true;
  report.contact_force_N = 12;
  report.contact_object = 9;
  report.contact_point_W_m = {1, 2, 3};
  report.clearance_m = 0.03;
  report.tool_speed_m_s = 0.2;
  const auto slave = to_message(report, 7);
  EXPECT_TRUE(slave.external_torque_measured());
  EXPECT_EQ(slave.external_torque_Nm()[2], -4.5);
  EXPECT_EQ(slave.joint_count(), 7U);
  EXPECT_EQ(slave.state(), msg::LINK_DEGRADED);
  EXPECT_EQ(slave.stop_cause(), msg::STOP_DRIVE_FAULT);
  EXPECT_EQ(slave.stop(), 44U);
  EXPECT_EQ(slave.loop_torque_Nm()[1], 3.5);
  EXPECT_EQ(slave.master_echo().sequence_number(), 41U);
  EXPECT_EQ(slave.master_echo().monotonic_ns(), 42);
  EXPECT_EQ(slave.master_echo().session(), 43U);
  EXPECT_EQ(slave.position_rad()[0], 0.25);
  EXPECT_EQ(slave.velocity_rad_s()[0], -0.5);
  EXPECT_TRUE(slave.contact());
  EXPECT_EQ(slave.contact_force_N(), 12);
  EXPECT_EQ(slave.contact_object(), 9);
  EXPECT_EQ(slave.contact_point_m().z(), 3);
  EXPECT_EQ(slave.clearance_m(), 0.03);
  EXPECT_EQ(slave.tool_speed_m_s(), 0.2);
}

// The enums travel as numbers: both sides must count alike.
TEST(SlaveAdapter, LinkStatesAreNumberedAsOnTheTopic) {
  EXPECT_EQ(static_cast<int>(teleop::LinkState::kInit), static_cast<int>(msg::LINK_INIT));
  EXPECT_EQ(static_cast<int>(teleop::LinkState::kReady), static_cast<int>(msg::LINK_READY));
  EXPECT_EQ(static_cast<int>(teleop::LinkState::kAligned), static_cast<int>(msg::LINK_ALIGNED));
  EXPECT_EQ(static_cast<int>(teleop::LinkState::kCoupled), static_cast<int>(msg::LINK_COUPLED));
  EXPECT_EQ(static_cast<int>(teleop::LinkState::kDegraded), static_cast<int>(msg::LINK_DEGRADED));
  EXPECT_EQ(static_cast<int>(teleop::LinkState::kStopped), static_cast<int>(msg::LINK_STOPPED));
  EXPECT_EQ(static_cast<int>(teleop::StopCause::kNone), static_cast<int>(msg::STOP_NONE));
  EXPECT_EQ(static_cast<int>(teleop::StopCause::kEmergency), static_cast<int>(msg::STOP_EMERGENCY));
  EXPECT_EQ(static_cast<int>(teleop::StopCause::kDriveFault), static_cast<int>(msg::STOP_DRIVE_FAULT));
}

}  // namespace
}  // namespace phantom::slave_io
