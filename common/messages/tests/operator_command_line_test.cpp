#include "common/messages/operator_command_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <thread>

#include "common/core/clock.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/tests/stand_in_side.hpp"

namespace phantom::messages {
namespace {

using teleop::OperatorOutcome;
using teleop::Side;
using testing::HasSubstr;
using testing::Not;

/// Master and slave, stopped, each of which can be kept from saying so.
class CommandLineTest : public testing::Test {
 protected:
  CommandLineTest() {
    master_.stop = 11;
    slave_.stop = 22;
    publishing_ = std::jthread([this](const std::stop_token& end) {
      while (!end.stop_requested()) {
        publish(masters_, master_stamper_, master_, master_publishes);
        publish(slaves_, slave_stamper_, slave_, slave_publishes);
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
    });
  }
  template <class State>
  static void publish(dds::Writer<State>& writer, dds::Stamper& stamper, const StandInSide& side,
                      bool publishes) {
    if (!publishes) return;
    State state;
    state.stamp(stamper.next());
    state.joint_count(7);
    state.state(side.stop != 0 ? msg::LinkState::LINK_STOPPED : msg::LinkState::LINK_INIT);
    state.stop(side.stop);
    writer.write(state);
  }
  OperatorOutcome reset(double timeout_s) {
    printed_.str("");
    return run_operator_request(dds::test_network(), "test",
                                {.kind = teleop::CommandKind::kReset, .timeout_s = timeout_s}, printed_);
  }

  dds::Participant master_host_{"master_io", dds::test_network()},
      slave_host_{"slave_io", dds::test_network()};
  StandInSide master_{master_host_, Side::kMaster}, slave_{slave_host_, Side::kSlave};
  dds::Stamper master_stamper_{master_host_}, slave_stamper_{slave_host_};
  dds::Writer<msg::MasterState> masters_{master_host_, dds::kMasterState};
  dds::Writer<msg::SlaveState> slaves_{slave_host_, dds::kSlaveState};
  std::atomic<bool> master_publishes{true}, slave_publishes{true};
  std::ostringstream printed_;
  std::jthread publishing_;
};

TEST_F(CommandLineTest, AResetNamesTheStopsThatAreHeard) {
  EXPECT_EQ(reset(30), OperatorOutcome::kDone) << printed_.str();
  EXPECT_EQ(master_.stop, 0U);
  EXPECT_EQ(slave_.stop, 0U);
}

// On a busy site it takes seconds until a newcomer hears everybody.
TEST_F(CommandLineTest, AResetWaitsUntilBothSidesAreHeard) {
  slave_publishes = false;
  std::jthread later([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));
    slave_publishes = true;
  });
  EXPECT_EQ(reset(30), OperatorOutcome::kDone) << printed_.str();
  EXPECT_EQ(slave_.stop, 0U);
}

TEST_F(CommandLineTest, ASideThatIsNotHeardKeepsItsStopAndIsTold) {
  slave_publishes = false;
  EXPECT_EQ(reset(0.5), OperatorOutcome::kNotDone);
  EXPECT_THAT(printed_.str(), HasSubstr("slave_io: no state received; its stop is not named"));
  EXPECT_THAT(printed_.str(), Not(HasSubstr("master_io: not heard")));
  EXPECT_EQ(slave_.stop, 22U);
}

}  // namespace
}  // namespace phantom::messages
