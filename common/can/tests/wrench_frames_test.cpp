#include "common/can/wrench_frames.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/support/heap_guard.hpp"

namespace phantom::can {
namespace {

using testing::HasSubstr;

constexpr core::Nanoseconds kWrenchPeriod_ns = 2'000'000, kApart_ns = 150'000;

/// As many sensors send: force in one frame with a status byte, torque in the next.
WrenchFrames pair_of_frames() {
  WrenchFrames frames;
  for (std::size_t c = 0; c < 6; ++c) {
    frames.channels[c].id = c < 3 ? 0x1A0 : 0x1A1;
    frames.channels[c].first = static_cast<int>(c % 3) * 2;
    frames.channels[c].scale = c < 3 ? 0.02 : 0.001;
  }
  frames.status = {{.id = 0x1A0, .byte = 6, .mask = 0x81, .good = 0x80}};
  return frames;
}

/// Writes a number's bytes one by one, by the definition of the byte orders.
void put_number(CanFrame& frame, int first, int bytes, bool big_endian, std::uint32_t bits) {
  for (int i = 0; i < bytes; ++i) {
    const int shift = 8 * (big_endian ? bytes - 1 - i : i);
    frame.data[static_cast<std::size_t>(first + i)] = static_cast<std::uint8_t>(bits >> shift);
  }
}

/// The two frames of wrench number k, whose six counts are k, k + 1, … k + 5.
std::array<CanFrame, 2> sent_wrench(int k, std::uint8_t status = 0x80) {
  std::array<CanFrame, 2> frames;
  for (std::uint32_t f = 0; f < 2; ++f) {
    frames[f].id = 0x1A0 + f;
    frames[f].length = f == 0 ? 7 : 6;
    for (int c = 0; c < 3; ++c)
      put_number(frames[f], 2 * c, 2, false, static_cast<std::uint32_t>(k + 3 * static_cast<int>(f) + c));
  }
  frames[0].data[6] = status;
  return frames;
}

TEST(WrenchAssembly, PutsTheFramesOfOneWrenchTogetherInEitherOrder) {
  WrenchAssembly assembly(pair_of_frames());
  core::Nanoseconds now_ns = 0;
  for (int k = -20; k < 20; ++k) {
    auto frames = sent_wrench(k);
    if (k % 3 == 0) std::swap(frames[0], frames[1]);
    now_ns += kWrenchPeriod_ns;
    EXPECT_FALSE(assembly.take(frames[0], now_ns));
    ASSERT_TRUE(assembly.take(frames[1], now_ns + kApart_ns));
    EXPECT_TRUE(assembly.wrench().valid);
    EXPECT_EQ(assembly.wrench().time_ns, now_ns) << "as old as its oldest part";
    for (int c = 0; c < 6; ++c)
      EXPECT_NEAR(assembly.wrench().values[static_cast<std::size_t>(c)], (k + c) * (c < 3 ? 0.02 : 0.001),
                  1e-12);
  }
  EXPECT_EQ(assembly.incomplete(), 0U);
}

// Whatever is lost, no wrench has parts of two.
TEST(WrenchAssembly, FramesThatAreLostNeverMixTwoWrenches) {
  std::mt19937 random(7);
  WrenchAssembly assembly(pair_of_frames());
  int whole = 0, both = 0;
  for (int k = 0; k < 20'000; ++k) {
    int came = 0;
    for (std::size_t f = 0; f < 2; ++f) {
      if (random() % 3 == 0) continue;  // lost
      ++came;
      const core::Nanoseconds jitter_ns = random() % 400'000;
      if (!assembly.take(sent_wrench(k % 30'000)[f],
                         k * kWrenchPeriod_ns + static_cast<core::Nanoseconds>(f) * kApart_ns + jitter_ns))
        continue;
      ++whole;
      for (int c = 0; c < 6; ++c)
        ASSERT_NEAR(assembly.wrench().values[static_cast<std::size_t>(c)], (k + c) * (c < 3 ? 0.02 : 0.001),
                    1e-9);
    }
    both += came == 2 ? 1 : 0;
  }
  EXPECT_EQ(whole, both);
  EXPECT_GT(both, 8000);
  EXPECT_GT(assembly.incomplete(), 4000U);
}

TEST(WrenchAssembly, APartnerThatNeverComesMakesNoWrench) {
  WrenchAssembly assembly(pair_of_frames());
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(assembly.take(sent_wrench(k)[0], k * kWrenchPeriod_ns));
  EXPECT_EQ(assembly.incomplete(), 99U);
  EXPECT_FALSE(assembly.take(sent_wrench(100)[1], 100 * kWrenchPeriod_ns)) << "its partner is a period old";
}

TEST(WrenchAssembly, StatusBitsAndShortFramesMakeItInvalid) {
  WrenchAssembly assembly(pair_of_frames());
  core::Nanoseconds now_ns = 0;
  const auto valid = [&](std::array<CanFrame, 2> frames) {
    now_ns += kWrenchPeriod_ns;
    assembly.take(frames[0], now_ns);
    EXPECT_TRUE(assembly.take(frames[1], now_ns));
    return assembly.wrench().valid;
  };
  EXPECT_TRUE(valid(sent_wrench(1, 0x80)));
  EXPECT_TRUE(valid(sent_wrench(1, 0xFE))) << "other bits are none of the mask's";
  EXPECT_FALSE(valid(sent_wrench(1, 0x81)));
  EXPECT_FALSE(valid(sent_wrench(1, 0x00)));
  auto frames = sent_wrench(1);
  frames[0].length = 6;  // without the status
  EXPECT_FALSE(valid(frames));
  frames = sent_wrench(1);
  frames[1].length = 5;
  EXPECT_FALSE(valid(frames));
  EXPECT_TRUE(valid(sent_wrench(1)));
}

TEST(WrenchAssembly, WhatIsNotTheSensorsIsNotTaken) {
  WrenchAssembly assembly(pair_of_frames());
  const auto frames = sent_wrench(1);
  EXPECT_FALSE(assembly.take(frames[0], 0));
  CanFrame other = frames[1];
  other.extended = true;
  EXPECT_FALSE(assembly.take(other, 0));
  other = frames[1];
  other.remote = true;
  EXPECT_FALSE(assembly.take(other, 0));
  other = frames[1];
  other.id = 0x1A2;
  EXPECT_FALSE(assembly.take(other, 0));
  EXPECT_TRUE(assembly.take(frames[1], 0));
  EXPECT_FALSE(assembly.take(frames[0], 0));
  assembly.drop();
  EXPECT_FALSE(assembly.take(frames[1], 0));
}

// Every number of every form comes back, whatever the width, order and place.
TEST(WrenchAssembly, NumbersOfEveryFormAreReadAsTheyWereWritten) {
  std::mt19937 random(9);
  for (int trial = 0; trial < 5000; ++trial) {
    WrenchFrames frames;
    frames.extended = random() % 2 == 0;
    frames.big_endian = random() % 2 == 0;
    frames.kind = static_cast<NumberKind>(random() % 3);
    frames.bytes = frames.kind == NumberKind::kFloat ? 4 : static_cast<int>(random() % 4) + 1;
    std::array<CanFrame, 6> sent;
    std::array<double, 6> expected{};
    for (std::uint32_t c = 0; c < 6; ++c) {
      WrenchChannel& channel = frames.channels[c];
      channel = {.id = 0x100 + c,
                 .first = static_cast<int>(random() % static_cast<unsigned>(9 - frames.bytes)),
                 .scale = -0.5,
                 .zero = 3.0};
      const std::uint32_t mask = frames.bytes == 4 ? ~0U : (1U << (8 * frames.bytes)) - 1;
      std::uint32_t bits = static_cast<std::uint32_t>(random()) & mask;
      double count = bits;
      if (frames.kind == NumberKind::kSigned && bits > mask / 2) count -= static_cast<double>(mask) + 1.0;
      if (frames.kind == NumberKind::kFloat) {
        const auto real = static_cast<float>(static_cast<int>(random() % 2001) - 1000) * 0.25F;
        std::memcpy(&bits, &real, sizeof bits);
        count = static_cast<double>(real);
      }
      expected[c] = 3.0 - 0.5 * count;
      sent[c].id = channel.id;
      sent[c].extended = frames.extended;
      sent[c].length = 8;
      for (auto& octet : sent[c].data) octet = static_cast<std::uint8_t>(random());
      put_number(sent[c], channel.first, frames.bytes, frames.big_endian, bits);
    }
    ASSERT_TRUE(check(frames));
    WrenchAssembly assembly(frames);
    for (std::size_t c = 0; c < 6; ++c) ASSERT_EQ(assembly.take(sent[c], 0), c == 5);
    EXPECT_TRUE(assembly.wrench().valid);
    EXPECT_EQ(assembly.wrench().values, expected);
  }
}

TEST(WrenchAssembly, AFloatThatIsNoNumberIsInvalid) {
  WrenchFrames frames;
  frames.kind = NumberKind::kFloat;
  frames.bytes = 4;
  for (std::uint32_t c = 0; c < 6; ++c)
    frames.channels[c] = {.id = 0x100 + c / 2, .first = static_cast<int>(c % 2) * 4};
  WrenchAssembly assembly(frames);
  for (const float odd : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    for (std::uint32_t f = 0; f < 3; ++f) {
      CanFrame frame{.id = 0x100 + f, .length = 8};
      if (f == 1) put_number(frame, 4, 4, false, std::bit_cast<std::uint32_t>(odd));
      assembly.take(frame, 0);
    }
    EXPECT_FALSE(assembly.wrench().valid);
  }
}

// Any frames at all: nothing is read out of bounds (sanitizers), allocated, or valid and not finite.
TEST(WrenchAssembly, AnyFramesAreTakenWithoutHarm) {
  std::mt19937_64 random(3);
  WrenchAssembly assembly(pair_of_frames());
  const test::HeapGuard guard;
  for (int i = 0; i < 200'000; ++i) {
    CanFrame frame;
    frame.id = 0x19F + static_cast<std::uint32_t>(random() % 4);
    frame.extended = random() % 16 == 0;
    frame.remote = random() % 16 == 0;
    frame.length = static_cast<std::uint8_t>(random() % 9);
    for (std::size_t b = 0; b < frame.length; ++b) frame.data[b] = static_cast<std::uint8_t>(random());
    const auto time_ns = static_cast<core::Nanoseconds>(random() % 1'000'000'000);
    if (assembly.take(frame, time_ns) && assembly.wrench().valid) {
      for (const double value : assembly.wrench().values) ASSERT_TRUE(std::isfinite(value));
    }
  }
}

TEST(WrenchFrames, WhatCannotBeIsRefused) {
  const auto refused = [](auto change) {
    WrenchFrames frames = pair_of_frames();
    change(frames);
    return check(frames).message();
  };
  EXPECT_TRUE(check(pair_of_frames()));
  EXPECT_THAT(refused([](auto& f) { f.bytes = 5; }), HasSubstr("numbers of 5 bytes; allowed: 1 to 4"));
  EXPECT_THAT(refused([](auto& f) { f.kind = NumberKind::kFloat; }), HasSubstr("of a float 4"));
  EXPECT_THAT(refused([](auto& f) { f.channels[3].id = 0x800; }),
              HasSubstr("torque_x: id 2048; allowed: 0 to 2047"));
  EXPECT_EQ(refused([](auto& f) {
              f.extended = true;
              f.channels[3].id = 0x800;
            }),
            "");
  EXPECT_THAT(refused([](auto& f) { f.channels[3].first = 7; }),
              HasSubstr("torque_x: a number from byte 7; allowed: 0 to 6"));
  for (const int first : {0, 1})
    EXPECT_THAT(refused([&](auto& f) {
                  f.channels[0].first = 0;
                  f.channels[1].id = f.channels[0].id;
                  f.channels[1].first = first;
                }),
                AllOf(HasSubstr("force_y: a number from byte " + std::to_string(first)),
                      HasSubstr("that of force_x from byte 0; allowed: bytes of its own")))
        << "of two bytes each";
  EXPECT_THAT(refused([](auto& f) { f.channels[0].scale = 0.0; }), HasSubstr("allowed: other than 0"));
  EXPECT_THAT(refused([](auto& f) { f.status[0].byte = 8; }), HasSubstr("status of byte 8"));
  EXPECT_THAT(refused([](auto& f) { f.status[0].good = 2; }), HasSubstr("`good` within `mask`"));
  EXPECT_THAT(refused([](auto& f) {
                for (std::uint32_t c = 0; c < 6; ++c) f.channels[c].id = c;
              }),
              HasSubstr("7 frames; allowed: at most 6"));
}

}  // namespace
}  // namespace phantom::can
