#include "common/core/event_ring.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <thread>

namespace phantom::core {
namespace {

TEST(EventRing, GivesEveryEventOnceInOrderAndRefusesWhatFindsNoRoom) {
  EventRing<int, 4> ring;
  int event = -1;
  EXPECT_FALSE(ring.take(event));
  EXPECT_EQ(event, -1);
  for (int round = 0; round < 3; ++round) {  // so that it goes round
    for (int i = 1; i <= 4; ++i) EXPECT_TRUE(ring.put(i));
    EXPECT_FALSE(ring.put(5));
    EXPECT_TRUE(ring.take(event));
    EXPECT_EQ(event, 1);
    EXPECT_TRUE(ring.put(6));
    for (const int expected : {2, 3, 4, 6}) {
      EXPECT_TRUE(ring.take(event));
      EXPECT_EQ(event, expected);
    }
    EXPECT_FALSE(ring.take(event));
  }
}

TEST(EventRing, NeitherLosesNorTearsBetweenTwoThreads) {
  struct Wide {
    std::uint64_t words[16];
  };
  EventRing<Wide, 8> ring;
  constexpr std::uint64_t kLast = 100'000;
  std::thread writer([&] {
    Wide event{};
    for (std::uint64_t i = 1; i <= kLast; ++i) {
      for (auto& word : event.words) word = i;
      while (!ring.put(event)) std::this_thread::yield();
    }
  });
  bool torn = false;
  Wide event{};
  for (std::uint64_t expected = 1; expected <= kLast && !torn; ++expected) {
    while (!ring.take(event)) std::this_thread::yield();
    for (const auto word : event.words) torn = torn || word != expected;
  }
  EXPECT_FALSE(torn);
  while (torn && event.words[0] != kLast) ring.take(event);  // lets the writer end
  writer.join();
}

}  // namespace
}  // namespace phantom::core
