#include "common/core/snapshot.hpp"

#include <gtest/gtest.h>

#include <array>
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

TEST(Snapshot, EachReaderSeesTheNewestValueOnceWhateverOthersRead) {
  Snapshot<int, 2> exchange;
  int first = -1, second = -1;
  exchange.write(1);
  EXPECT_TRUE(exchange.read<0>(first));
  exchange.write(2);
  EXPECT_TRUE(exchange.read<0>(first));
  EXPECT_FALSE(exchange.read<0>(first));
  EXPECT_TRUE(exchange.read<1>(second)) << "another reader's call takes nothing away";
  EXPECT_FALSE(exchange.read<1>(second));
  EXPECT_EQ(first, 2);
  EXPECT_EQ(second, 2);
}

struct Wide {
  std::array<std::uint64_t, 64> words;
};

template <std::uint32_t Reader>
void read_all(Snapshot<Wide, 4>& exchange, std::uint64_t last) {
  std::uint64_t previous = 0;
  Wide seen{};
  while (previous != last) {
    if (!exchange.read<Reader>(seen)) {
      std::this_thread::yield();
      continue;
    }
    for (const auto word : seen.words) ASSERT_EQ(word, seen.words[0]) << "reader " << Reader;
    ASSERT_GT(seen.words[0], previous) << "reader " << Reader;
    previous = seen.words[0];
  }
}

// Meant for the thread sanitizer, too (preset tsan): it sees a slot that is written while it is read.
TEST(Snapshot, NeverTearsAndNeverGoesBackForAnyOfSeveralReaders) {
  Snapshot<Wide, 4> exchange;
  constexpr std::uint64_t kLast = 100'000;
  std::jthread first([&] { read_all<0>(exchange, kLast); });
  std::jthread second([&] { read_all<1>(exchange, kLast); });
  std::jthread third([&] { read_all<2>(exchange, kLast); });
  std::jthread fourth([&] { read_all<3>(exchange, kLast); });
  Wide value{};
  for (std::uint64_t i = 1; i <= kLast; ++i) {
    value.words.fill(i);
    exchange.write(value);
    if (i % 64 == 0) std::this_thread::yield();  // so that readers come between on a host with few cores
  }
}

}  // namespace
}  // namespace phantom::core
