// The gripper on the real topics.
#include <gmock/gmock.h>

#include <chrono>
#include <mutex>
#include <thread>

#include "common/dds/tests/test_network.hpp"
#include "common/messages/operator_client.hpp"
#include "components/slave_io/tests/gripper_bench.hpp"

namespace phantom::slave_io {
namespace {

using teleop::CommandKind;
using testing::HasSubstr;

TEST(GripperOnTopics, CommandsAreAnsweredAndItsStateIsPublished) {
  const auto network = dds::test_network();
  GripperBench bench;
  bench.run(0.02);  // before the servo's first tick the gripper is not known, and commands are refused
  DdsAdapter adapter(network, messages::bounds_of(shipped_arm().arm), bench.inbox);
  dds::Participant other("operator", network);
  messages::OperatorClient client(other);
  std::mutex mutex;
  messages::GripperState seen;
  dds::Reader<msg::GripperState> reader(other, dds::kGripperState,
                                        [&](const msg::GripperState& message, const dds::SampleInfo&) {
                                          const auto state = messages::from_idl(message);
                                          if (!state) return false;
                                          const std::lock_guard lock(mutex);
                                          seen = *state;
                                          return true;
                                        });
  std::jthread servo([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      bench.run(0.02);
      adapter.publish(bench.last);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  const auto ask = [&](CommandKind kind, double value) {
    return client.ask({.kind = kind, .value = value, .issuer = "test"}, 30.0).of(teleop::Side::kSlave);
  };
  EXPECT_EQ(ask(CommandKind::kGripperForce, 25.0).state, teleop::SideAnswer::State::kDone);
  EXPECT_EQ(ask(CommandKind::kGripperWidth, 0.0).state, teleop::SideAnswer::State::kDone);
  const teleop::SideAnswer refused = ask(CommandKind::kGripperForce, 1000.0);
  EXPECT_EQ(refused.state, teleop::SideAnswer::State::kRefused);
  EXPECT_THAT(refused.message, HasSubstr("allowed: 3 to 60 N"));
  bool held = false;
  for (int i = 0; i < 3000 && !held; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const std::lock_guard lock(mutex);
    held = seen.holds;
  }
  ASSERT_TRUE(held);
  const std::lock_guard lock(mutex);
  EXPECT_NEAR(seen.sense.width_m, 0.042, 0.002);
  EXPECT_NEAR(seen.sense.force_N, 25.0, 0.1);
}

}  // namespace
}  // namespace phantom::slave_io
