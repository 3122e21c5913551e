#include "components/slave_io/dds_adapter.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <mutex>
#include <thread>

#include "common/dds/admission/source_guard.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::slave_io {
namespace {

msg::MasterState good() {
  msg::MasterState master;
  master.stamp().sequence_number(7);
  master.stamp().monotonic_ns(123);
  master.stamp().session(99);
  master.joint_count(7);
  master.state(msg::LinkState::LINK_COUPLED);
  for (std::size_t j = 0; j < 7; ++j) master.position_rad()[j] = 0.1 * static_cast<double>(j);
  return master;
}

messages::ArmBounds expected() {
  messages::ArmBounds arm;
  arm.joint_count = 7;
  arm.lower.fill(-1.0);
  arm.upper.fill(1.0);
  return arm;
}

// Tries slave_io: master restarts
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

// On the real topics: the first writer is followed, the second one refused and told; when the first ends, the
// second takes its place.
// Tries slave_io: a second process sends master_state
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
  std::string reported;
  msg::ComponentState state{};
  dds::Reader<msg::ComponentStatus> statuses(second, dds::kComponentStatus,
                                             [&](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                                               const std::lock_guard lock(mutex);
                                               reported = s.message().to_string();
                                               state = s.state();
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
        return reported.find("two processes send master_state") != std::string::npos &&
               state == msg::ComponentState::COMPONENT_DEGRADED;
      }));
  EXPECT_EQ(sample.position[0], 0.5) << "whoever came first";
  first_writer.reset();
  EXPECT_TRUE(
      until([&] { write(second_writer, second_stamper, 0.9); }, [&] { return sample.position[0] == 0.9; }))
      << "it takes the first one's place";
}

// Tries slave_io: master_state invalid
TEST(SlaveAdapter, AnInvalidSampleIsRefusedCountedAndLeavesTheLastGoodOne) {
  const auto network = dds::test_network();
  Inbox inbox;
  DdsAdapter adapter(network, expected(), inbox);
  dds::Participant master("master_io", network);
  dds::Writer<msg::MasterState> writer(master, dds::kMasterState);
  dds::Stamper stamper(master);
  std::atomic<std::uint64_t> refused{0};
  dds::Reader<msg::ComponentStatus> statuses(master, dds::kComponentStatus,
                                             [&](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                                               for (const auto& topic : s.topics())
                                                 if (topic.topic() == "master_state" && !topic.writer())
                                                   refused = topic.refused();
                                             });
  auto sample = good();
  const auto send = [&] {
    sample.stamp(stamper.next());
    writer.write(sample);
    adapter.publish_health({core::ComponentState::kRunning, "", {}, {}});
  };
  MasterSample taken;
  ASSERT_TRUE(dds::eventually([&] {
    send();
    return inbox.master.read(taken);
  }));
  const auto held = taken.position;
  sample.position_rad()[2] = std::nan("");
  EXPECT_TRUE(dds::eventually([&] {
    send();
    return refused >= 3;
  }));
  inbox.master.read(taken);
  EXPECT_EQ(taken.position, held);
  sample = good();
  sample.position_rad().fill(0.7);
  EXPECT_TRUE(dds::eventually([&] {
    send();
    return inbox.master.read(taken) && taken.position[0] == 0.7;
  })) << "the next good one is taken";
}

}  // namespace
}  // namespace phantom::slave_io
