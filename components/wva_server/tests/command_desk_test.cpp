#include "components/wva_server/command_desk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "common/runtime/pose_text.hpp"

namespace phantom::wva_server {
namespace {

Request request(std::uint64_t number, std::uint64_t session = 1) {
  Request made;
  made.id = {session, number};
  made.command.object = "object " + std::to_string(number);
  return made;
}

TEST(CommandDesk, GivesCommandsOutInTheOrderInWhichTheyCame) {
  CommandDesk desk;
  EXPECT_FALSE(desk.next(0.0));
  for (const std::uint64_t number : {5U, 3U, 9U})
    EXPECT_EQ(desk.take_in(request(number)).outcome, Outcome::kAccepted);
  for (const std::uint64_t number : {5U, 3U, 9U}) {
    const auto next = desk.next(0.0);
    ASSERT_TRUE(next);
    EXPECT_EQ(next->id.number, number);
  }
  EXPECT_FALSE(desk.next(0.0));
}

TEST(CommandDesk, ACommandThatComesAgainIsNotCarriedOutAgainAndHearsItsLastReply) {
  CommandDesk desk;
  EXPECT_EQ(desk.take_in(request(1)).outcome, Outcome::kAccepted);
  EXPECT_EQ(desk.take_in(request(1)).outcome, Outcome::kAccepted);
  ASSERT_TRUE(desk.next(0.0));
  EXPECT_FALSE(desk.next(0.0));
  Reply done;
  done.outcome = Outcome::kDone;
  done.version = 44;
  desk.replied({1, 1}, done);
  EXPECT_EQ(desk.take_in(request(1)).outcome, Outcome::kDone);
  EXPECT_EQ(desk.take_in(request(1)).version, 44U);
  EXPECT_FALSE(desk.next(0.0));
  EXPECT_EQ(desk.take_in(request(1, 2)).outcome, Outcome::kAccepted);  // another process's first
  EXPECT_TRUE(desk.next(0.0));
}

TEST(CommandDesk, RefusesWhatItHasNoRoomFor) {
  CommandDesk desk;
  for (std::uint64_t i = 1; i <= CommandDesk::kMostWaiting; ++i)
    EXPECT_EQ(desk.take_in(request(i)).outcome, Outcome::kAccepted);
  const Reply refused = desk.take_in(request(1000));
  EXPECT_EQ(refused.outcome, Outcome::kRefused);
  EXPECT_THAT(refused.message, testing::HasSubstr("64 commands are waiting"));
  ASSERT_TRUE(desk.next(0.0));
  EXPECT_EQ(desk.take_in(request(1000)).outcome, Outcome::kAccepted);  // sent again later
}

TEST(CommandDesk, WakesWhoWaits) {
  CommandDesk desk;
  std::thread sender([&] { desk.take_in(request(7)); });
  const auto next = desk.next(30.0);
  sender.join();
  ASSERT_TRUE(next);
  EXPECT_EQ(next->id.number, 7U);
}

TEST(PoseText, IsSixNumbersThereAndBack) {
  const auto pose = runtime::parse_pose("0.1, -0.2 0.3 10 -20 130");
  ASSERT_TRUE(pose);
  EXPECT_EQ(runtime::pose_text(*pose), "0.1 -0.2 0.3 10 -20 130");
  for (const char* bad : {"", "1 2 3", "1 2 3 4 5 6 7", "1 2 3 4 5 x", "1 2 3 4 5 nan", "1e9 0 0 0 0 0"})
    EXPECT_FALSE(runtime::parse_pose(bad)) << bad;
}

}  // namespace
}  // namespace phantom::wva_server
