#include "common/core/recent_map.hpp"

#include <gtest/gtest.h>

#include <string>

namespace phantom::core {
namespace {

TEST(RecentMap, KeepsWhatWasUsedLastAndCountsWhatItDrops) {
  RecentMap<std::string, int> map(2);
  EXPECT_TRUE(map.find_or_add("a", 1).second);
  EXPECT_TRUE(map.find_or_add("b", 2).second);
  EXPECT_FALSE(map.find_or_add("a", 9).second);  // used again: b is the oldest now
  EXPECT_EQ(map.oldest(), 2);
  EXPECT_TRUE(map.find_or_add("c", 3).second);
  EXPECT_FALSE(map.contains("b"));
  EXPECT_EQ(map.find_or_add("a", 9).first, 1);
  EXPECT_EQ(map.dropped(), 1U);
}

TEST(RecentMap, DoesNotGrowWithTheNumberOfKeys) {
  RecentMap<int, int> map(256);
  for (int key = 0; key < 300'000; ++key) {
    map.find_or_add(key, key);
    ASSERT_LE(map.size(), 256U);
  }
  EXPECT_EQ(map.dropped(), 300'000U - 256U);
  EXPECT_TRUE(map.full());
}

TEST(RecentMap, WhatIsErasedLeavesRoom) {
  RecentMap<std::string, int> map(2);
  map.find_or_add("a", 1);
  map.find_or_add("b", 2);
  map.erase("a");
  map.erase("nobody");
  map.find_or_add("c", 3);
  EXPECT_EQ(map.dropped(), 0U);
  std::vector<std::string> keys;
  map.for_each([&](const std::string& key, int) { keys.push_back(key); });
  EXPECT_EQ(keys, (std::vector<std::string>{"b", "c"}));
  map.find_or_add("d", 4);
  EXPECT_FALSE(map.contains("b")) << "the oldest that is left";
}

TEST(RecentMap, ALookChangesNoAge) {
  RecentMap<std::string, int> map(2);
  map.find_or_add("a", 1);
  map.find_or_add("b", 2);
  ASSERT_NE(map.find("a"), nullptr);
  EXPECT_EQ(*map.find("a"), 1);
  map.find_or_add("c", 3);
  EXPECT_EQ(map.find("a"), nullptr) << "it is still the oldest";
  EXPECT_NE(map.find("b"), nullptr);
}

}  // namespace
}  // namespace phantom::core
