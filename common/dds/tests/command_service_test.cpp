#include "common/dds/command_service.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <set>
#include <thread>

#include "common/dds/requester.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::dds {
namespace {

using Service = CommandService<msg::OperatorCommand, msg::OperatorReply>;
using Asker = Requester<msg::OperatorCommand, msg::OperatorReply>;

msg::OperatorReply reply_of(const std::string& component, bool done, const std::string& message) {
  msg::OperatorReply reply;
  reply.component_name(component);
  reply.done(done);
  reply.message(message);
  return reply;
}

/// A component that answers operator commands on a thread of its own; stops last a while.
class Answering {
 public:
  Answering(const core::NetworkOptions& network, const std::string& name)
      : name_(name),
        participant_(name, network),
        service_(
            participant_, kOperatorCommand, kOperatorReply,
            {.refused = [name](const auto&, const std::string& why) { return reply_of(name, false, why); }}),
        thread_([this](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            const auto command = service_.next(0.01);
            if (!command) continue;
            ++carried_out;
            service_.complete(id_of(command->stamp()), reply_of(name_, true, "stopped"));
          }
        }) {}

  std::atomic<int> carried_out{0};

 private:
  std::string name_;
  Participant participant_;
  Service service_;
  std::jthread thread_;
};

msg::OperatorCommand stop_command() {
  msg::OperatorCommand command;
  command.kind(msg::COMMAND_EMERGENCY_STOP);
  return command;
}

TEST(CommandService, AnswersWhatIsAskedAndCarriesItOutOnce) {
  const auto network = test_network();
  Answering slave(network, "slave_io");
  Participant outside("outside", network);
  Asker asker(outside, kOperatorCommand, kOperatorReply);
  for (int i = 1; i <= 3; ++i) {
    std::string said;
    EXPECT_TRUE(asker.ask(stop_command(), 30.0, [&](const msg::OperatorReply& reply) {
      said = reply.message().to_string();
      return true;
    }));
    EXPECT_EQ(said, "stopped");
    EXPECT_EQ(slave.carried_out, i);
  }
}

TEST(CommandService, OneCommandIsAnsweredByAllWhomItConcerns) {
  const auto network = test_network();
  Answering master(network, "master_io");
  auto slave = std::make_unique<Answering>(network, "slave_io");
  Participant outside("outside", network);
  Asker asker(outside, kOperatorCommand, kOperatorReply);
  std::set<std::string> answered;
  const auto both = [&](const msg::OperatorReply& reply) {
    answered.insert(reply.component_name().to_string());
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
  const auto network = test_network();
  Participant there("there", network), outside("outside", network);
  auto service = std::make_unique<Service>(there, kOperatorCommand, kOperatorReply,
                                           Service::Rules{.refused = [](const auto&, const std::string& why) {
                                             return reply_of("x", false, why);
                                           }});
  std::thread carrying_out([&] {
    for (const char* word : {"first word", "last word"}) {  // with the first, both ends know each other
      std::optional<msg::OperatorCommand> command;
      while (!command) command = service->next(0.1);
      service->complete(id_of(command->stamp()), reply_of("x", true, word));
    }
    service.reset();
  });
  Asker asker(outside, kOperatorCommand, kOperatorReply);
  std::string said;
  for (int i = 0; i < 2; ++i) {
    asker.ask(stop_command(), 30.0, [&](const msg::OperatorReply& reply) {
      said = reply.message().to_string();
      return true;
    });
  }
  carrying_out.join();
  EXPECT_EQ(said, "last word");
}

TEST(CommandService, WakesWhoCarriesOutAndRefusesAloud) {
  const auto network = test_network();
  Participant there("there", network), outside("outside", network);
  std::atomic<int> woken{0};
  Service service(there, kOperatorCommand, kOperatorReply,
                  {.refusal = [](const auto& c) { return c.value() > 1.0 ? "value is above 1" : ""; },
                   .refused = [](const auto&, const std::string& why) { return reply_of("x", false, why); }},
                  [&] { ++woken; });
  Asker asker(outside, kOperatorCommand, kOperatorReply);
  msg::OperatorCommand bad = stop_command();
  bad.value(2.0);
  std::string said;
  EXPECT_TRUE(asker.ask(bad, 30.0, [&](const msg::OperatorReply& reply) {
    said = reply.message().to_string();
    return !reply.done();
  }));
  EXPECT_EQ(said, "value is above 1");
  EXPECT_EQ(woken, 0);
  EXPECT_FALSE(service.next());
  std::thread carrying_out([&] {
    EXPECT_TRUE(eventually([&] { return woken == 1; }));
    const auto command = service.next();
    ASSERT_TRUE(command);
    service.complete(id_of(command->stamp()), reply_of("x", true, ""));
  });
  EXPECT_TRUE(asker.ask(stop_command(), 30.0, [](const msg::OperatorReply& reply) { return reply.done(); }));
  carrying_out.join();
}

}  // namespace
}  // namespace phantom::dds
