#include "common/web/page_sessions.hpp"

#include <gtest/gtest.h>

#include <set>

namespace phantom::web {
namespace {

runtime::RoleSecrets three_secrets() {
  return runtime::RoleSecrets({"watch-watch-watch", "operate-operate-1", "configure-config"});
}

TEST(Sessions, AreOpenedByASecretAndEndByTimeAndByHand) {
  PageSessions sessions(three_secrets());
  EXPECT_TRUE(sessions.needed());
  EXPECT_FALSE(sessions.open("", 0));
  EXPECT_FALSE(sessions.open("operate", 0));
  const auto opened = sessions.open("operate-operate-1", 5);
  ASSERT_TRUE(opened);
  EXPECT_EQ(opened->role, Role::kOperate);
  EXPECT_EQ(opened->token.size(), 32U);
  EXPECT_EQ(sessions.role_of(opened->token, 5), Role::kOperate);
  EXPECT_EQ(sessions.role_of(opened->token, 4 + PageSessions::kLife_ns), Role::kOperate);
  EXPECT_FALSE(sessions.role_of(opened->token, 5 + PageSessions::kLife_ns));
  EXPECT_FALSE(sessions.role_of(opened->token, 6)) << "it stays ended";
  const auto other = sessions.open("watch-watch-watch", 9);
  EXPECT_EQ(sessions.role_of(other->token, 9), Role::kWatch);
  sessions.close(other->token);
  EXPECT_FALSE(sessions.role_of(other->token, 9));
  EXPECT_FALSE(sessions.role_of("", 9));
  EXPECT_FALSE(PageSessions(std::nullopt).needed());
  EXPECT_FALSE(PageSessions(std::nullopt).open("", 0));
}

TEST(Sessions, AreBoundedAndEachHasItsOwnName) {
  PageSessions sessions(three_secrets());
  std::vector<std::string> tokens;
  for (std::size_t i = 0; i <= PageSessions::kMax; ++i)
    tokens.push_back(sessions.open("configure-config", 0)->token);
  EXPECT_EQ(std::set(tokens.begin(), tokens.end()).size(), tokens.size());
  EXPECT_FALSE(sessions.role_of(tokens.front(), 0));
  EXPECT_EQ(sessions.role_of(tokens[1], 0), Role::kConfigure);
  EXPECT_EQ(sessions.role_of(tokens.back(), 0), Role::kConfigure);
}

TEST(Sessions, ACookieIsFoundByItsWholeName) {
  EXPECT_EQ(cookie_of("a=1; phantom_8080=xyz; b=2", "phantom_8080"), "xyz");
  EXPECT_EQ(cookie_of("phantom_8080=xyz", "phantom_8080"), "xyz");
  EXPECT_EQ(cookie_of("phantom_8080=a=b", "phantom_8080"), "a=b");
  for (const char* none : {"", ";", "phantom_8080", "xphantom_8080=1", "phantom_80801=1", "a=phantom_8080=1",
                           "; ; =", "   ", "Phantom_8080=1"})
    EXPECT_EQ(cookie_of(none, "phantom_8080"), "") << none;
}

}  // namespace
}  // namespace phantom::web
