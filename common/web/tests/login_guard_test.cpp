#include "common/web/login_guard.hpp"

#include <gtest/gtest.h>

namespace phantom::web {
namespace {

constexpr core::Nanoseconds kSecond_ns = core::kNsPerSecond;
constexpr LoginLimits kFew{.tries = 3, .each_s = 10, .tries_in_all = 6, .each_in_all_s = 2, .addresses = 4};

TEST(LoginGuarding, AnAddressHasItsTriesAndGetsOneBackAfterATime) {
  LoginGuard guard(kFew);
  const core::Nanoseconds now_ns = 1000 * kSecond_ns;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(guard.take("a", now_ns), 0);
  EXPECT_EQ(guard.take("a", now_ns), 10);
  EXPECT_EQ(guard.take("a", now_ns + kSecond_ns / 2), 10) << "whole seconds, rounded up";
  EXPECT_EQ(guard.take("a", now_ns + 9 * kSecond_ns), 1);
  EXPECT_EQ(guard.take("a", now_ns + 10 * kSecond_ns), 0);
  EXPECT_EQ(guard.take("a", now_ns + 10 * kSecond_ns), 10) << "one came back";
  for (int i = 0; i < 3; ++i) EXPECT_EQ(guard.take("a", now_ns + 1000 * kSecond_ns), 0) << "never more";
  EXPECT_GT(guard.take("a", now_ns + 1000 * kSecond_ns), 0);
}

TEST(LoginGuarding, OneThatGuessesTakesNothingFromOthers) {
  LoginGuard guard(kFew);
  for (int i = 0; i < 1000; ++i) guard.take("guesses", 0);
  EXPECT_EQ(guard.take("other", 0), 0);
}

TEST(LoginGuarding, ARightSecretUsesUpNoTryAndRestoresNone) {
  LoginGuard guard(kFew);
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(guard.take("a", 0), 0);
    guard.give_back("a");
  }
  // Guesses one secret, and proves to know another in between.
  int wrong = 0;
  for (int i = 0; i < 100; ++i) {
    if (guard.take("b", 0) == 0) ++wrong;
    if (guard.take("b", 0) == 0) guard.give_back("b");
  }
  EXPECT_EQ(wrong, 3);
}

TEST(LoginGuarding, ManyAddressesTogetherAreBoundedEvenWhereTheyAreForgotten) {
  LoginGuard guard(kFew);
  int taken = 0;
  for (int i = 0; i < 1000; ++i) taken += guard.take("address " + std::to_string(i), 0) == 0 ? 1 : 0;
  EXPECT_EQ(taken, 6);
  EXPECT_EQ(guard.take("one more", 0), 2);
  EXPECT_EQ(guard.take("one more", 2 * kSecond_ns), 0);
}

TEST(LoginGuarding, ManyAddressesTogetherKeepOutNobodyWhoWasInBefore) {
  LoginGuard guard(kFew);
  ASSERT_EQ(guard.take("operator", 0), 0);
  guard.give_back("operator");
  for (int i = 0; i < 1000; ++i) guard.take("address " + std::to_string(i), 0);
  EXPECT_GT(guard.take("one more", 0), 0);
  EXPECT_EQ(guard.take("operator", 0), 0);
  guard.give_back("operator");
  for (int i = 0; i < 3; ++i) EXPECT_EQ(guard.take("operator", 0), 0);
  EXPECT_EQ(guard.take("operator", 0), 10) << "its own tries are limited as before";
}

}  // namespace
}  // namespace phantom::web
