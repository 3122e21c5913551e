#include "common/messages/operator_responder.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::messages {
namespace {

using dds::eventually;

constexpr double kHalf = 0.5;

msg::OperatorCommand of_kind(msg::CommandKind kind, double value = 0.0) {
  msg::OperatorCommand command;
  command.kind(kind);
  command.value(value);
  command.joint(-1);
  return command;
}

/// One side's responder, with a servo that the test plays, and somebody who sends it commands.
struct Sides {
  explicit Sides(teleop::Side side, OperatorResponder::Settings settings = {})
      : responder(there, side, stops, std::move(settings)) {}

  /// Stamps a command. What one asker sends arrives in this order.
  msg::OperatorCommand stamped(msg::OperatorCommand command) {
    command.stamp(stamper.next());
    return command;
  }
  /// Sends the command, again and again, until the condition holds: the ends may not know each other yet.
  template <class Condition>
  bool send_until(const msg::OperatorCommand& command, Condition condition) {
    return eventually([&] {
      commands.write(command);
      return eventually(condition, kHalf);
    });
  }
  std::optional<msg::OperatorReply> reply_to(const msg::OperatorCommand& command) {
    const std::lock_guard lock(mutex);
    const auto found = heard.find(command.stamp().sequence_number());
    return found != heard.end() ? std::optional(found->second) : std::nullopt;
  }
  std::string message_to(const msg::OperatorCommand& command) {
    const auto reply = reply_to(command);
    return reply ? reply->message().to_string() : "no reply";
  }
  /// Sends a command that is refused at once, and so shows that all before it has arrived.
  bool all_arrived() {
    const auto last =
        stamped(of_kind(msg::CommandKind::COMMAND_RESET, std::numeric_limits<double>::infinity()));
    return send_until(last, [&] { return reply_to(last).has_value(); });
  }
  teleop::StopRequests::Reset taken_reset(const msg::OperatorCommand& command) {
    teleop::StopRequests::Reset taken;
    EXPECT_TRUE(send_until(command, [&] { return stops.take(taken); }));
    return taken;
  }

  core::NetworkOptions network = dds::test_network();
  teleop::StopRequests stops;
  dds::Participant there{"there", network}, outside{"outside", network};
  OperatorResponder responder;
  std::mutex mutex;
  std::map<std::uint64_t, msg::OperatorReply> heard;
  dds::Stamper stamper{outside};
  dds::Writer<msg::OperatorCommand> commands{outside, dds::kOperatorCommand};
  dds::Reader<msg::OperatorReply> replies{outside, dds::kOperatorReply,
                                          [this](const msg::OperatorReply& reply, const dds::SampleInfo&) {
                                            const std::lock_guard lock(mutex);
                                            heard.emplace(reply.command().sequence_number(), reply);
                                          }};
};

TEST(OperatorResponder, AStopIsRequestedAtOnceAndConfirmedOnlyWhenTheServoReportsIt) {
  Sides sides(teleop::Side::kSlave);
  const auto stop = sides.stamped(of_kind(msg::CommandKind::COMMAND_EMERGENCY_STOP));
  ASSERT_TRUE(sides.send_until(stop, [&] { return sides.stops.stops() == 1; }));
  ASSERT_TRUE(sides.all_arrived());
  sides.responder.on_report(0, false);  // of a tick before the request
  sides.responder.on_report(1, true);
  ASSERT_TRUE(sides.send_until(stop, [&] { return sides.reply_to(stop).has_value(); }));
  EXPECT_EQ(sides.message_to(stop), "stopped");
  EXPECT_TRUE(sides.reply_to(stop)->done());
  EXPECT_EQ(sides.reply_to(stop)->component_name().to_string(), "slave_io");
  EXPECT_EQ(sides.stops.stops(), 1U) << "sent again, it is the same stop";
}

TEST(OperatorResponder, EachSideTakesItsOwnStopOfThoseThatAResetNames) {
  for (const teleop::Side side : teleop::kSides) {
    Sides sides(side);
    auto reset = of_kind(msg::CommandKind::COMMAND_RESET);
    reset.master_stop(7);
    reset.slave_stop(9);
    const auto taken = sides.taken_reset(sides.stamped(reset));
    const bool master = side == teleop::Side::kMaster;
    EXPECT_EQ(taken.names.own, master ? 7U : 9U);
    EXPECT_EQ(taken.names.partner, master ? 9U : 7U);
  }
}

TEST(OperatorResponder, AResetIsAnsweredAsTheServoDecides) {
  Sides sides(teleop::Side::kMaster);
  for (const bool released : {true, false}) {
    const auto reset = sides.stamped(of_kind(msg::CommandKind::COMMAND_RESET));
    const auto taken = sides.taken_reset(reset);
    ASSERT_TRUE(sides.all_arrived());
    sides.stops.give_result({taken.number, released});
    sides.responder.on_report(0, !released);
    ASSERT_TRUE(sides.send_until(reset, [&] { return sides.reply_to(reset).has_value(); }));
    EXPECT_EQ(sides.reply_to(reset)->done(), released);
    EXPECT_EQ(sides.message_to(reset),
              released
                  ? "released"
                  : "another stop is in force than the one that the reset names; look at it, then reset it");
  }
}

TEST(OperatorResponder, WhatThisProcessSaysItselfIsNoRequest) {
  Sides sides(teleop::Side::kMaster);
  auto own = sides.stamped(of_kind(msg::CommandKind::COMMAND_EMERGENCY_STOP));
  own.stamp().session(sides.there.session());
  ASSERT_TRUE(sides.all_arrived());  // the ends know each other
  sides.commands.write(own);
  ASSERT_TRUE(sides.all_arrived());
  EXPECT_EQ(sides.stops.stops(), 0U);
}

TEST(OperatorResponder, SettingsAreForWhoHasThemAndWhatCannotBeIsRefused) {
  std::vector<double> taken;
  std::mutex mutex;
  Sides master(teleop::Side::kMaster, [&](const OperatorCommand& command) {
    const std::lock_guard lock(mutex);
    taken.push_back(command.value);
    return command.value > 10.0 ? core::Status::invalid_argument("allowed: up to 10") : core::Status::ok();
  });
  for (const auto& [value, done, message] :
       {std::tuple{2.0, true, "done"}, std::tuple{11.0, false, "allowed: up to 10"},
        std::tuple{std::numeric_limits<double>::quiet_NaN(), false, "value is not a finite number"}}) {
    const auto gain = master.stamped(of_kind(msg::CommandKind::COMMAND_SET_PERCEPT_GAIN, value));
    ASSERT_TRUE(master.send_until(gain, [&] { return master.reply_to(gain).has_value(); }));
    EXPECT_EQ(master.message_to(gain), message);
    EXPECT_EQ(master.reply_to(gain)->done(), done);
  }
  EXPECT_EQ(taken, (std::vector{2.0, 11.0})) << "once each, and no value that is no number";
}

TEST(OperatorResponder, SettingsOfTheOtherSideAreIgnored) {
  Sides slave(teleop::Side::kSlave);
  const auto gain = slave.stamped(of_kind(msg::CommandKind::COMMAND_SET_PERCEPT_GAIN, 2.0));
  ASSERT_TRUE(slave.all_arrived());
  slave.commands.write(gain);
  ASSERT_TRUE(slave.all_arrived());
  EXPECT_FALSE(slave.reply_to(gain)) << slave.message_to(gain);
}

}  // namespace
}  // namespace phantom::messages
