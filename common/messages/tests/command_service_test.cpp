#include "common/messages/command_service.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <set>
#include <thread>

#include "common/dds/endpoints/topics.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/requester.hpp"

namespace phantom::messages {
namespace {

using Service = CommandService<OperatorCommand, OperatorReply>;
using Asker = Requester<OperatorCommand, OperatorReply>;

OperatorReply reply_of(const std::string& component, bool done, const std::string& message) {
  return {.component = component, .done = done, .message = message};
}

/// A component that answers operator commands on a thread of its own; stops last a while.
class Answering {
 public:
  Answering(const core::NetworkOptions& network, const std::string& name)
      : name_(name),
        participant_(name, network),
        service_(
            participant_, dds::kOperatorCommand, dds::kOperatorReply,
            {.refused = [name](const auto&, const std::string& why) { return reply_of(name, false, why); }}),
        thread_([this](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            const auto command = service_.next(0.01);
            if (!command) continue;
            ++carried_out;
            service_.complete(command->stamp, reply_of(name_, true, "stopped"));
          }
        }) {}

  std::atomic<int> carried_out{0};

 private:
  std::string name_;
  dds::Participant participant_;
  Service service_;
  std::jthread thread_;
};

OperatorCommand stop_command() { return {.kind = teleop::CommandKind::kEmergencyStop}; }

TEST(CommandService, AnswersWhatIsAskedAndCarriesItOutOnce) {
  const auto network = dds::test_network();
  Answering slave(network, "slave_io");
  dds::Participant outside("outside", network);
  Asker asker(outside, dds::kOperatorCommand, dds::kOperatorReply);
  for (int i = 1; i <= 3; ++i) {
    std::string message;
    EXPECT_TRUE(asker.ask(stop_command(), 30.0, [&](const OperatorReply& reply) {
      message = reply.message;
      return true;
    }));
    EXPECT_EQ(message, "stopped");
    EXPECT_EQ(slave.carried_out, i);
  }
}

TEST(CommandService, OneCommandIsAnsweredByAllWhomItConcerns) {
  const auto network = dds::test_network();
  Answering master(network, "master_io");
  auto slave = std::make_unique<Answering>(network, "slave_io");
  dds::Participant outside("outside", network);
  Asker asker(outside, dds::kOperatorCommand, dds::kOperatorReply);
  std::set<std::string> answered;
  const auto both = [&](const OperatorReply& reply) {
    answered.insert(reply.component);
    return answered.size() == 2;
  };
  EXPECT_TRUE(asker.ask(stop_command(), 30.0, both));
  EXPECT_EQ(master.carried_out, 1);
  EXPECT_EQ(slave->carried_out, 1);
  slave.reset();
  answered.clear();
  EXPECT_FALSE(asker.ask(stop_command(), 0.5, both)) << "one of the two is gone";
  EXPECT_EQ(answered, std::set<std::string>{"master_io"});
}

TEST(CommandService, AReplyIsStillSentWhenTheServiceEnds) {
  const auto network = dds::test_network();
  dds::Participant there("there", network), outside("outside", network);
  auto service = std::make_unique<Service>(there, dds::kOperatorCommand, dds::kOperatorReply,
                                           Service::Rules{.refused = [](const auto&, const std::string& why) {
                                             return reply_of("x", false, why);
                                           }});
  std::thread carrying_out([&] {
    for (const char* word : {"first word", "last word"}) {  // with the first, both ends know each other
      std::optional<OperatorCommand> command;
      while (!command) command = service->next(0.1);
      service->complete(command->stamp, reply_of("x", true, word));
    }
    service.reset();
  });
  Asker asker(outside, dds::kOperatorCommand, dds::kOperatorReply);
  std::string message;
  for (int i = 0; i < 2; ++i) {
    asker.ask(stop_command(), 30.0, [&](const OperatorReply& reply) {
      message = reply.message;
      return true;
    });
  }
  carrying_out.join();
  EXPECT_EQ(message, "last word");
}

TEST(CommandService, WakesWhoCarriesOutAndRefusesAloud) {
  const auto network = dds::test_network();
  dds::Participant there("there", network), outside("outside", network);
  std::atomic<int> woken{0};
  Service service(there, dds::kOperatorCommand, dds::kOperatorReply,
                  {.refusal = [](const auto& c) { return c.value > 1.0 ? "value is above 1" : ""; },
                   .refused = [](const auto&, const std::string& why) { return reply_of("x", false, why); }},
                  [&] { ++woken; });
  Asker asker(outside, dds::kOperatorCommand, dds::kOperatorReply);
  OperatorCommand bad = stop_command();
  bad.value = 2.0;
  std::string message;
  EXPECT_TRUE(asker.ask(bad, 30.0, [&](const OperatorReply& reply) {
    message = reply.message;
    return !reply.done;
  }));
  EXPECT_EQ(message, "value is above 1");
  EXPECT_EQ(woken, 0);
  EXPECT_FALSE(service.next());
  std::thread carrying_out([&] {
    EXPECT_TRUE(test::eventually([&] { return woken == 1; }));
    const auto command = service.next();
    ASSERT_TRUE(command);
    service.complete(command->stamp, reply_of("x", true, ""));
  });
  EXPECT_TRUE(asker.ask(stop_command(), 30.0, [](const OperatorReply& reply) { return reply.done; }));
  carrying_out.join();
}

}  // namespace
}  // namespace phantom::messages
