#include "common/simulation/bus_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <random>

#include "common/can/bus_load.hpp"

namespace phantom::simulation {
namespace {

using can::BusState;
using can::CanFrame;
using can::kErrorBusOff;
using can::kErrorNoAck;
using can::Received;
using can::worst_case_bits;

// A frame bit by bit, with its checksum and stuff bits: the slow truth behind worst_case_bits.
std::uint32_t literal_bits(const CanFrame& frame) {
  std::vector<int> bits;
  const auto put = [&bits](std::uint32_t value, int count) {
    for (int i = count - 1; i >= 0; --i) bits.push_back(static_cast<int>(value >> i & 1U));
  };
  put(0, 1);  // start of frame
  if (frame.extended) {
    put(frame.id >> 18, 11), put(3, 2), put(frame.id & 0x3FFFF, 18), put(frame.remote, 1), put(0, 2);
  } else {
    put(frame.id, 11), put(frame.remote, 1), put(0, 2);
  }
  put(frame.length, 4);
  if (!frame.remote) {
    for (int i = 0; i < frame.length; ++i) put(frame.data[static_cast<std::size_t>(i)], 8);
  }
  std::uint32_t crc = 0;
  for (const int bit : bits) {
    const bool invert = ((crc >> 14 & 1U) != 0) != (bit != 0);
    crc = crc << 1 & 0x7FFF;
    if (invert) crc ^= 0x4599;
  }
  put(crc, 15);
  std::uint32_t stuffed = 0;
  int run = 0, last = -1;
  for (const int bit : bits) {
    run = bit == last ? run + 1 : 1;
    last = bit;
    ++stuffed;
    if (run == 5) {
      ++stuffed;
      last = 1 - bit;
      run = 1;
    }
  }
  return stuffed + 1 + 2 + 7 + 3;  // delimiter, acknowledge, end of frame, intermission
}

TEST(BusLoad, NoFrameIsLongerThanTheWorstCase) {
  std::mt19937 random(5);
  for (const bool extended : {false, true}) {
    for (std::uint8_t length = 0; length <= 8; ++length) {
      std::uint32_t longest = 0;
      for (int i = 0; i < 20000; ++i) {
        CanFrame f{.id = static_cast<std::uint32_t>(random()) % (extended ? 1U << 29 : 1U << 11),
                   .extended = extended,
                   .length = length};
        const bool much = random() % 2;  // what stuffs most: equal bits in fours, in any phase
        const auto fours = std::rotl(std::uint8_t{0x0F}, static_cast<int>(random() % 8));
        for (std::size_t b = 0; b < length; ++b)
          f.data[b] = much ? fours : static_cast<std::uint8_t>(random());
        if (much) f.id = extended ? 0x10F0F0F0 + static_cast<std::uint32_t>(random()) % 4096 : 0x078;
        longest = std::max(longest, literal_bits(f));
      }
      EXPECT_LE(longest, worst_case_bits(length, extended)) << int{length};
      EXPECT_GE(longest + 10, worst_case_bits(length, extended)) << int{length};  // and not far from it
    }
  }
  EXPECT_EQ(worst_case_bits(8, false), 135U);
  EXPECT_EQ(worst_case_bits(8, true), 160U);
  EXPECT_EQ(worst_case_bits(0, false), 55U);
}

struct Node {
  std::vector<Received> got;
};

class Model : public testing::Test {
 protected:
  void advance(core::Nanoseconds now_ns) {
    model.advance(now_ns, [this](BusModel::NodeId to, const Received& r) { nodes[to].got.push_back(r); });
  }
  BusModel model{{.bit_rate = 1e6, .queue_frames = 8}};
  Node nodes[3];
  BusModel::NodeId a = model.attach(), b = model.attach(), c = model.attach();
};

CanFrame with_id(std::uint32_t id, bool extended = false, bool remote = false) {
  return {.id = id, .extended = extended, .remote = remote};
}

TEST_F(Model, TheLowerIdentifierWinsTheBus) {
  EXPECT_TRUE(model.submit(a, with_id(0x300), 0));
  EXPECT_TRUE(model.submit(b, with_id(0x100), 0));
  EXPECT_TRUE(model.submit(a, with_id(0x050), 0));  // waits behind a's own first
  advance(core::kNsPerSecond);
  ASSERT_EQ(nodes[c].got.size(), 3U);
  EXPECT_EQ(nodes[c].got[0].frame.id, 0x100U);
  EXPECT_EQ(nodes[c].got[1].frame.id, 0x300U);
  EXPECT_EQ(nodes[c].got[2].frame.id, 0x050U);
}

TEST_F(Model, StandardBeforeRemoteBeforeExtendedOfTheSameBase) {
  const CanFrame order[] = {with_id(0x123), with_id(0x123, false, true), with_id(0x123U << 18, true),
                            with_id(0x123U << 18, true, true), with_id(0x124)};
  for (std::size_t i = 0; i + 1 < std::size(order); ++i)
    EXPECT_LT(arbitration_rank(order[i]), arbitration_rank(order[i + 1])) << i;
}

TEST_F(Model, AFrameTakesItsTimeAndIsNotInterrupted) {
  model.submit(a, with_id(0x700), 1000);
  advance(20'000);
  EXPECT_TRUE(nodes[b].got.empty());
  model.submit(b, with_id(0x001), 20'000);
  advance(56'000);  // 55 bits of 1 µs from 1 µs on
  ASSERT_EQ(nodes[c].got.size(), 1U);
  EXPECT_EQ(nodes[c].got[0].time_ns, 56'000);
  advance(111'000);
  ASSERT_EQ(nodes[c].got.size(), 2U);
  EXPECT_EQ(nodes[c].got[1].time_ns, 111'000);
}

TEST_F(Model, AQueueHasAnEnd) {
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(model.submit(a, with_id(1), 0));
  EXPECT_FALSE(model.submit(a, with_id(1), 0));
  EXPECT_TRUE(model.queue_is_full(a));
}

TEST_F(Model, BusOffDropsTheQueueAndEndsAfterItsTime) {
  model.submit(a, with_id(1), 0);
  model.submit(a, with_id(2), 0);
  model.set_bus_off(a, 0);
  EXPECT_FALSE(model.submit(a, with_id(3), 0));
  advance(1'000'000);
  EXPECT_TRUE(nodes[b].got.empty());
  ASSERT_EQ(nodes[a].got.size(), 1U);
  EXPECT_EQ(nodes[a].got[0].errors, kErrorBusOff);
  model.restart(a, 1'000'000);
  advance(2'407'000);
  EXPECT_EQ(nodes[a].got.size(), 1U);
  advance(2'409'000);  // 128 × 11 bits later
  ASSERT_EQ(nodes[a].got.size(), 2U);
  EXPECT_EQ(nodes[a].got[1].state, BusState::kActive);
  EXPECT_TRUE(model.submit(a, with_id(3), 2'409'000));
}

TEST_F(Model, ALoneNodeGetsNoAcknowledgeAndGoesOnTrying) {
  model.set_plugged(b, false);
  model.set_plugged(c, false);
  model.submit(a, with_id(7), 0);
  advance(1'000'000);
  ASSERT_EQ(nodes[a].got.size(), 1U);
  EXPECT_TRUE(nodes[a].got[0].errors & kErrorNoAck);
  model.set_plugged(c, true);
  advance(2'000'000);
  ASSERT_EQ(nodes[c].got.size(), 1U);
  EXPECT_EQ(nodes[a].got.back().state, BusState::kActive);
  EXPECT_TRUE(nodes[b].got.empty());
}

TEST_F(Model, FaultsHappenAsOftenAsAskedAndTheSameWithTheSameSeed) {
  const auto run = [](std::uint64_t seed) {
    BusModel own({.seed = seed});
    const auto sender = own.attach();
    own.attach();
    own.set_faults({{.id = 0x100, .mask = 0x7FF, .drop = 0.2, .duplicate = 0.1, .jitter_ns = 5000}});
    std::vector<std::pair<core::Nanoseconds, std::uint32_t>> got;
    for (core::Nanoseconds t = 0; t < 10'000'000; t += 1000) {
      own.submit(sender, {.id = 0x100}, t);
      own.submit(sender, {.id = 0x101}, t);
      own.advance(t, [&](auto, const Received& r) { got.emplace_back(r.time_ns, r.frame.id); });
    }
    return got;
  };
  const auto first = run(1);
  EXPECT_EQ(first, run(1));
  EXPECT_NE(first, run(2));
  const auto touched =
      std::count_if(first.begin(), first.end(), [](const auto& g) { return g.second == 0x100; });
  EXPECT_NEAR(static_cast<double>(touched), 10'000 * 0.8 * 1.1, 200);
  EXPECT_EQ(static_cast<std::ptrdiff_t>(first.size()) - touched, 10'000);  // the others pass untouched
}

}  // namespace
}  // namespace phantom::simulation
