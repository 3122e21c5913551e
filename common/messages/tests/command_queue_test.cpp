#include "common/messages/command_queue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "common/messages/percept.hpp"

namespace phantom::messages {
namespace {

using Queue = CommandQueue<SensingCommand, SensingReply>;
using testing::HasSubstr;

SensingCommand command(std::uint64_t number, std::uint64_t session = 1) {
  SensingCommand made;
  made.stamp = {number, 1000 + static_cast<std::int64_t>(number), session};
  made.request = SensingRequest::kListContacts;
  made.object = "object " + std::to_string(number);
  return made;
}

SensingReply reply(bool done, const std::string& message) {
  SensingReply made;
  made.done = done;
  made.message = message;
  return made;
}

/// Rules that refuse objects called "nothing", and pass over self-tests.
CommandRules<SensingCommand, SensingReply> rules() {
  return {.concerns = [](const auto& c) { return c.request != SensingRequest::kSelfTest; },
          .refusal = [](const auto& c) { return c.object == "nothing" ? "object is nothing" : ""; },
          .refused = [](const auto&, const std::string& why) { return reply(false, why); }};
}

/// The replies that are due now.
std::vector<SensingReply> replies(Queue& queue) {
  queue.close();  // or it would wait for more
  std::vector<SensingReply> due;
  while (auto next = queue.next_reply()) due.push_back(*next);
  return due;
}
std::string only_reply(Queue& queue) {
  const auto due = replies(queue);
  EXPECT_EQ(due.size(), 1U);
  return due.empty() ? "" : due[0].message;
}

TEST(CommandQueue, GivesCommandsOutInTheOrderInWhichTheyCame) {
  Queue queue(rules());
  EXPECT_FALSE(queue.next());
  EXPECT_FALSE(queue.next(0.0));
  for (const std::uint64_t number : {5U, 3U, 9U}) EXPECT_TRUE(queue.receive(command(number)));
  for (const std::uint64_t number : {5U, 3U, 9U}) {
    const auto next = queue.next();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->stamp.sequence_number, number);
  }
  EXPECT_FALSE(queue.next());
  EXPECT_TRUE(replies(queue).empty()) << "there is no first reply unless the rules have one";
}

TEST(CommandQueue, ACommandThatComesAgainIsCarriedOutOnceAndHearsItsReplyAgain) {
  Queue queue(rules());
  EXPECT_TRUE(queue.receive(command(1)));
  EXPECT_FALSE(queue.receive(command(1))) << "while it waits";
  const auto first = queue.next();
  ASSERT_TRUE(first);
  EXPECT_FALSE(queue.receive(command(1))) << "while it is carried out";
  EXPECT_FALSE(queue.next());
  EXPECT_TRUE(replies(queue).empty());
  EXPECT_TRUE(queue.complete(first->stamp, reply(true, "moved")));
  EXPECT_EQ(only_reply(queue), "moved");
  EXPECT_FALSE(queue.receive(command(1))) << "after it was carried out";
  EXPECT_FALSE(queue.next());
  EXPECT_EQ(only_reply(queue), "moved");
  EXPECT_TRUE(queue.receive(command(1, 2))) << "another process's first";
  EXPECT_FALSE(queue.complete(first->stamp, reply(false, "no"))) << "one command has one last word";
  EXPECT_TRUE(replies(queue).empty());
}

TEST(CommandQueue, ARepliesEchoNamesItsCommand) {
  Queue queue(rules());
  queue.receive(command(7, 3));
  queue.complete(queue.next()->stamp, reply(true, ""));
  const auto due = replies(queue);
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due[0].command.session, 3U);
  EXPECT_EQ(due[0].command.sequence_number, 7U);
  EXPECT_EQ(due[0].command.monotonic_ns, 1007);
}

TEST(CommandQueue, CommandsMayEndLaterAndInAnotherOrder) {
  Queue queue(rules());
  queue.receive(command(1));
  queue.receive(command(2));
  const auto first = queue.next(), second = queue.next();
  ASSERT_TRUE(first && second);
  EXPECT_TRUE(queue.complete(second->stamp, reply(true, "second")));
  EXPECT_EQ(only_reply(queue), "second");
  EXPECT_TRUE(queue.complete(first->stamp, reply(true, "first")));
  EXPECT_EQ(only_reply(queue), "first");
}

TEST(CommandQueue, NewsOfACommandUnderWayAreSentAndHeardAgainUntilItEnds) {
  Queue queue(rules());
  EXPECT_FALSE(queue.notify(command(1).stamp, reply(false, "of none"))) << "it never came";
  queue.receive(command(1));
  const auto first = queue.next();
  ASSERT_TRUE(first);
  EXPECT_TRUE(queue.notify(first->stamp, reply(false, "half done")));
  EXPECT_EQ(only_reply(queue), "half done");
  EXPECT_FALSE(queue.receive(command(1))) << "it is carried out once";
  EXPECT_EQ(only_reply(queue), "half done") << "who asks again hears the newest";
  EXPECT_TRUE(queue.notify(first->stamp, reply(false, "nearly done")));
  EXPECT_TRUE(queue.complete(first->stamp, reply(true, "done")));
  EXPECT_FALSE(queue.notify(first->stamp, reply(false, "too late"))) << "nothing follows its end";
  const auto due = replies(queue);
  ASSERT_EQ(due.size(), 2U);
  EXPECT_EQ(due[0].message, "nearly done");
  EXPECT_EQ(due[1].message, "done");
  EXPECT_EQ(due[1].command.sequence_number, 1U);
  EXPECT_FALSE(queue.receive(command(1)));
  EXPECT_EQ(only_reply(queue), "done");
}

// Tries wva_server: are being carried out
TEST(CommandQueue, NewsLeaveItsPlaceAmongThoseThatWait) {
  Queue queue(rules());
  for (std::uint64_t i = 1; i <= 64; ++i) queue.receive(command(i));
  const auto first = queue.next();
  ASSERT_TRUE(first && queue.notify(first->stamp, reply(false, "begun")));
  EXPECT_FALSE(queue.receive(command(65))) << "it is still open";
  queue.complete(first->stamp, reply(true, "done"));
  EXPECT_TRUE(queue.receive(command(65)));
}

// Tries wva_server: 64 commands wait
TEST(CommandQueue, TheSixtyFifthIsRefusedAloudAndMayBeSentAgain) {
  Queue queue(rules());
  for (std::uint64_t i = 1; i <= 64; ++i) EXPECT_TRUE(queue.receive(command(i)));
  EXPECT_TRUE(replies(queue).empty());
  EXPECT_FALSE(queue.receive(command(65)));
  const auto due = replies(queue);
  ASSERT_EQ(due.size(), 1U);
  EXPECT_FALSE(due[0].done);
  EXPECT_EQ(due[0].command.sequence_number, 65U);
  EXPECT_EQ(due[0].message, "64 commands are waiting already; send it again later");
  const auto first = queue.next();
  ASSERT_TRUE(first);
  EXPECT_FALSE(queue.receive(command(65))) << "what is being carried out counts: nothing grows without bound";
  queue.complete(first->stamp, reply(true, ""));
  EXPECT_TRUE(queue.receive(command(65)));
}

TEST(CommandQueue, RefusesWhatTheRulesOrTheCodecRefuseAndPassesOverWhatIsNotForIt) {
  Queue queue(rules());
  SensingCommand bad = command(1);
  bad.object = "nothing";
  EXPECT_FALSE(queue.receive(bad));
  EXPECT_EQ(only_reply(queue), "object is nothing");
  EXPECT_FALSE(queue.receive(command(1), "link is odd"));
  EXPECT_EQ(only_reply(queue), "link is odd") << "its codec's refusal";
  SensingCommand other = command(2);
  other.request = SensingRequest::kSelfTest;
  EXPECT_FALSE(queue.receive(other));
  EXPECT_TRUE(replies(queue).empty());
  EXPECT_FALSE(queue.next());
}

TEST(CommandQueue, AFirstReplySaysHowManyAreBefore) {
  auto with_first = rules();
  with_first.accepted = [](const auto&, std::size_t before) { return reply(false, std::to_string(before)); };
  Queue queue(with_first);
  queue.receive(command(1));
  EXPECT_EQ(only_reply(queue), "0");
  queue.receive(command(2));
  EXPECT_EQ(only_reply(queue), "1");
  queue.receive(command(1));
  EXPECT_EQ(only_reply(queue), "0") << "repeated, as it was";
  const auto first = queue.next();
  queue.receive(command(3));
  EXPECT_EQ(only_reply(queue), "2") << "what is being carried out is before it, too";
  queue.complete(first->stamp, reply(true, "done"));
  queue.receive(command(1));
  EXPECT_EQ(replies(queue).back().message, "done");
}

TEST(CommandQueue, RemembersABoundedNumberOfRepliesAndEveryCommandThatIsOpen) {
  Queue queue(rules());
  queue.receive(command(1));  // stays open throughout
  const auto open = queue.next();
  for (std::uint64_t i = 2; i <= Queue::kMaxRemembered + 2; ++i) {
    ASSERT_TRUE(queue.receive(command(i)));
    ASSERT_TRUE(queue.complete(queue.next()->stamp, reply(true, std::to_string(i))));
  }
  EXPECT_FALSE(queue.receive(command(1)));
  EXPECT_TRUE(queue.complete(open->stamp, reply(true, "at last")));
  EXPECT_EQ(replies(queue).size(), Queue::kMaxReplies) << "what nobody fetches does not grow, either";
  EXPECT_FALSE(queue.receive(command(Queue::kMaxRemembered + 2)));
  EXPECT_TRUE(replies(queue).back().done);
  EXPECT_FALSE(queue.receive(command(2))) << "its reply is forgotten; it is not carried out again";
  EXPECT_THAT(only_reply(queue), HasSubstr("carried out long ago; allowed: a new one"));
  EXPECT_TRUE(queue.receive(command(2, 2))) << "another process's";
}

TEST(CommandQueue, WakesWhoWaitsForCommandsAndForReplies) {
  Queue queue(rules());
  std::thread sender([&] { queue.receive(command(7)); });
  const auto next = queue.next(30.0);
  sender.join();
  ASSERT_TRUE(next);
  std::optional<SensingReply> heard;
  std::thread fetcher([&] { heard = queue.next_reply(); });
  queue.complete(next->stamp, reply(true, "woken"));
  fetcher.join();
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->message, "woken");
}

TEST(CommandQueue, ManyThreadsLoseNoCommandAndCarryOutNoneTwice) {
  Queue queue(rules());
  constexpr std::uint64_t kEach = 300;
  std::vector<std::thread> senders;
  for (std::uint64_t session = 1; session <= 3; ++session) {
    senders.emplace_back([&queue, session] {
      for (std::uint64_t i = 1; i <= kEach; ++i) {
        while (!queue.receive(command(i, session))) std::this_thread::yield();  // refused while it is full
        queue.receive(command(i, session));
      }
    });
  }
  std::uint64_t carried_out = 0;
  while (carried_out < 3 * kEach) {
    const auto next = queue.next(30.0);
    ASSERT_TRUE(next);
    ++carried_out;
    EXPECT_TRUE(queue.complete(next->stamp, reply(true, "")));
  }
  for (std::thread& sender : senders) sender.join();
  EXPECT_FALSE(queue.next());
}

}  // namespace
}  // namespace phantom::messages
