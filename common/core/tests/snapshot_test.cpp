#include "common/core/snapshot.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <thread>

namespace phantom::core {
namespace {

TEST(Snapshot, ReadsNothingBeforeTheFirstWriteAndEachValueOnce) {
  Snapshot<int> exchange;
  int value = -1;
  EXPECT_FALSE(exchange.read(value));
  EXPECT_EQ(value, -1);
  exchange.write(1);
  exchange.write(2);
  EXPECT_TRUE(exchange.read(value));
  EXPECT_EQ(value, 2) << "the newest value wins";
  EXPECT_FALSE(exchange.read(value));
}

TEST(Snapshot, NeverTearsAndNeverGoesBack) {
  struct Wide {
    std::uint64_t words[64];
  };
  Snapshot<Wide> exchange;
  constexpr std::uint64_t kLast = 200'000;
  std::thread writer([&] {
    Wide value{};
    for (std::uint64_t i = 1; i <= kLast; ++i) {
      for (auto& word : value.words) word = i;
      exchange.write(value);
    }
  });
  std::uint64_t previous = 0;
  Wide seen{};
  while (previous != kLast) {
    if (!exchange.read(seen)) {
      std::this_thread::yield();
      continue;
    }
    for (const auto word : seen.words) ASSERT_EQ(word, seen.words[0]);
    ASSERT_GT(seen.words[0], previous);
    previous = seen.words[0];
  }
  writer.join();
}

}  // namespace
}  // namespace phantom::core
