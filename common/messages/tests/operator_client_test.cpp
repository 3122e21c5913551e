#include "common/messages/operator_client.hpp"

#include <gtest/gtest.h>

#include <optional>

#include "common/dds/tests/test_network.hpp"
#include "common/messages/tests/stand_in_side.hpp"

namespace phantom::messages::operator_client_test {
namespace {

using teleop::CommandKind;
using teleop::Side;
using test::eventually;
using State = teleop::SideAnswer::State;

constexpr double kLong_s = 30;  // bounds a failing test only

OperatorCommand command(CommandKind kind, double value = 0) {
  return {.kind = kind, .value = value, .issuer = "test"};
}
const OperatorCommand kStop = command(CommandKind::kEmergencyStop);

class Asking : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(eventually([&] { return master_->matched() && slave_->matched(); }));
    ASSERT_TRUE(eventually([&] { return client_.unconfirmed_stop() == std::nullopt; }));
  }
  dds::Participant own_{"client", dds::test_network()}, master_host_{"master_io", dds::test_network()},
      slave_host_{"slave_io", dds::test_network()};
  std::mutex mutex_;
  std::optional<teleop::CommandAnswers> reported_;
  bool ever_reported_ = false;
  OperatorClient client_{own_, [this](const std::optional<teleop::CommandAnswers>& stop) {
                           const std::lock_guard lock(mutex_);
                           reported_ = stop;
                           ever_reported_ = ever_reported_ || stop.has_value();
                         }};
  std::optional<StandInSide> master_{std::in_place, master_host_, Side::kMaster},
      slave_{std::in_place, slave_host_, Side::kSlave};
};

TEST_F(Asking, AStopIsConfirmedByBothSidesOwnWords) {
  const teleop::CommandAnswers answers = client_.ask(kStop, kLong_s);
  EXPECT_TRUE(answers.done());
  EXPECT_EQ(teleop::stop_words(answers), "stopped: master_io, slave_io");
  EXPECT_EQ(client_.unconfirmed_stop(), std::nullopt);
  const std::lock_guard lock(mutex_);
  EXPECT_TRUE(ever_reported_);
  EXPECT_EQ(reported_, std::nullopt);
}

// Tries synthetic_viewer: a stop that nobody confirms
TEST_F(Asking, AStopIsSentAgainWithTheSameStampUntilTheSilentSideAnswers) {
  slave_->answers = false;
  EXPECT_FALSE(client_.ask(kStop, 0.05).done());
  ASSERT_TRUE(eventually([&] { return slave_->heard().size() >= 8; })) << "long after ask() gave up";
  ASSERT_TRUE(
      eventually([&] { return client_.unconfirmed_stop()->of(Side::kMaster).state == State::kDone; }));
  EXPECT_EQ(teleop::stop_words(*client_.unconfirmed_stop()), "NOT CONFIRMED by slave_io; stopped: master_io");
  const auto heard = slave_->heard();
  for (const OperatorCommand& again : heard) {
    EXPECT_EQ(again.stamp.sequence_number, heard.front().stamp.sequence_number);
    EXPECT_EQ(again.stamp.session, heard.front().stamp.session);
  }
  EXPECT_NE(client_.unconfirmed_stop(), std::nullopt);
  slave_->answers = true;
  ASSERT_TRUE(eventually([&] { return !client_.unconfirmed_stop(); }));
  const std::size_t by_then = slave_->heard().size();
  EXPECT_TRUE(client_.ask(command(CommandKind::kSetPerceptGain, 1), kLong_s).done());
  EXPECT_LE(slave_->heard_of(CommandKind::kEmergencyStop), by_then + 1) << "it is not sent any more";
}

// The other side of a cut cable: nobody was there when the stop was asked for.
TEST_F(Asking, AStopReachesASideThatComesLater) {
  slave_.reset();
  EXPECT_FALSE(client_.ask(kStop, 0.1).done());
  slave_.emplace(slave_host_, Side::kSlave);
  EXPECT_TRUE(eventually([&] { return !client_.unconfirmed_stop(); }));
  EXPECT_GE(slave_->heard_of(CommandKind::kEmergencyStop), 1U);
}

TEST_F(Asking, AResetEndsTheRepeatingOfAStop) {
  slave_->answers = false;
  client_.ask(kStop, 0.1);
  ASSERT_TRUE(eventually([&] { return master_->stop != 0; }));
  OperatorCommand reset = command(CommandKind::kReset);
  reset.master_stop = master_->stop;
  const std::uint64_t number = client_.send(reset, 0.2);
  EXPECT_EQ(client_.unconfirmed_stop(), std::nullopt);
  EXPECT_TRUE(eventually([&] { return client_.wait(number, 0).of(Side::kMaster).state == State::kDone; }));
  ASSERT_TRUE(eventually([&] { return slave_->heard_of(CommandKind::kReset) >= 1; }));
  const std::size_t stops = slave_->heard_of(CommandKind::kEmergencyStop);
  for (int k = 0; k < 3; ++k) client_.ask(command(CommandKind::kSetPerceptGain, k), kLong_s);
  usleep(static_cast<useconds_t>(4 * OperatorClient::kAgain_ns / 1000));
  EXPECT_LE(slave_->heard_of(CommandKind::kEmergencyStop), stops + 1) << "one may have been under way";
}

TEST_F(Asking, OtherCommandsDoNotEndTheRepeatingOfAStop) {
  slave_->answers = false;
  client_.ask(kStop, 0.1);
  EXPECT_TRUE(client_.ask(command(CommandKind::kSetPerceptGain, 2), kLong_s).done());
  for (int k = 0; k < 200; ++k) client_.send(command(CommandKind::kViewNode, 3), 1.0);
  EXPECT_NE(client_.unconfirmed_stop(), std::nullopt);
  const std::size_t stops = slave_->heard_of(CommandKind::kEmergencyStop);
  EXPECT_TRUE(eventually([&] { return slave_->heard_of(CommandKind::kEmergencyStop) > stops + 2; }));
}

// 2, then 1: if the repetition of 2 came after 1, 2 would stand.
TEST_F(Asking, ANewerCommandEndsTheRepeatingOfAnOlderOne) {
  master_->answers = false;
  client_.send(command(CommandKind::kSetPerceptGain, 2), kLong_s);
  ASSERT_TRUE(eventually([&] { return master_->heard().size() >= 3; }));
  client_.send(command(CommandKind::kSetPerceptGain, 1), kLong_s);
  const auto newest_first = [&] {
    const auto heard = master_->heard();
    return heard.back().value == 1 && heard[heard.size() - 2].value == 1 &&
           heard[heard.size() - 3].value == 1;
  };
  EXPECT_TRUE(eventually(newest_first));
  usleep(static_cast<useconds_t>(4 * OperatorClient::kAgain_ns / 1000));
  EXPECT_TRUE(newest_first());
}

TEST_F(Asking, ACommandIsGivenUpAfterItsTime) {
  master_->answers = false;
  EXPECT_EQ(teleop::command_words(client_.ask(command(CommandKind::kSetLaw, 1), 0.12)),
            "no answer from master_io");
  usleep(static_cast<useconds_t>(4 * OperatorClient::kAgain_ns / 1000));
  const std::size_t heard = master_->heard().size();
  usleep(static_cast<useconds_t>(4 * OperatorClient::kAgain_ns / 1000));
  EXPECT_EQ(master_->heard().size(), heard) << "a law must not change minutes after it was asked for";
}

TEST_F(Asking, ARefusalComesWithItsReason) {
  master_->refuses = true;
  const teleop::CommandAnswers answers = client_.ask(command(CommandKind::kSetFeedbackGain, 10), kLong_s);
  EXPECT_TRUE(answers.refused());
  EXPECT_EQ(teleop::command_words(answers), "master_io: not now; allowed is later");
}

TEST_F(Asking, ASidesOwnStateConfirmsWhereItsReplyIsLost) {
  slave_->answers = false;
  client_.ask(kStop, 0.1);
  const core::Nanoseconds later_ns = core::monotonic_ns() + teleop::CommandAnswers::kUnderWay_ns;
  client_.take_state(Side::kSlave, 5, 0, later_ns);
  EXPECT_NE(client_.unconfirmed_stop(), std::nullopt) << "its state says that it is not stopped";
  client_.take_state(Side::kSlave, 5, 99, later_ns);
  EXPECT_EQ(client_.unconfirmed_stop(), std::nullopt);
}

TEST_F(Asking, AStateThatNamesAReleasedStopConfirmsNoNewOne) {
  slave_->answers = false;
  OperatorCommand reset = command(CommandKind::kReset);
  reset.slave_stop = 99;
  client_.ask(reset, 0.05);
  client_.ask(kStop, 0.1);
  const core::Nanoseconds later_ns = core::monotonic_ns() + teleop::CommandAnswers::kUnderWay_ns;
  client_.take_state(Side::kSlave, 5, 99, later_ns);
  EXPECT_NE(client_.unconfirmed_stop(), std::nullopt);
  client_.take_state(Side::kSlave, 5, 100, later_ns);
  EXPECT_EQ(client_.unconfirmed_stop(), std::nullopt);
}

// A second slave_io confirms; the one that moves the arm hangs.
TEST_F(Asking, TheWordOfAnotherProcessInItsPlaceDoesNotCount) {
  client_.take_state(Side::kSlave, slave_host_.session() + 1, 0,
                     core::monotonic_ns() + 600 * core::kNsPerSecond);
  client_.send(kStop, kLong_s);
  ASSERT_TRUE(eventually([&] { return slave_->heard().size() >= 4; })) << "it has answered three times";
  EXPECT_EQ(client_.unconfirmed_stop()->of(Side::kSlave).state, State::kWaiting);
  client_.take_state(Side::kSlave, slave_host_.session(), 0, core::monotonic_ns());
  EXPECT_TRUE(eventually([&] { return !client_.unconfirmed_stop(); }));
}

}  // namespace
}  // namespace phantom::messages::operator_client_test
