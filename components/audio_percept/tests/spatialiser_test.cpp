#include "components/audio_percept/spatialiser.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "components/audio_percept/audio_percept.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::audio_percept {
namespace {

constexpr double kNear_m = 0.15;
enum Signal { kPercept, kAlarm };

/// Half a second of a 500 Hz sine from one place: interleaved frames, without the first tenth.
std::vector<float> render(Layout layout, const Vector3& place, Signal signal = kPercept) {
  Spatialiser spatialiser(layout, kNear_m);
  std::vector<float> all;
  std::array<float, kPeriodFrames> sine{}, silence{};
  std::vector<float> frames(kPeriodFrames * channel_count(layout));
  for (std::size_t period = 0; period < 100; ++period) {
    for (std::size_t i = 0; i < kPeriodFrames; ++i) {
      sine[i] = 0.25F * static_cast<float>(std::sin(2.0 * std::numbers::pi * 500.0 *
                                                    static_cast<double>(period * kPeriodFrames + i) /
                                                    kSampleRate_Hz));
    }
    spatialiser.render(signal == kPercept ? sine : silence, signal == kPercept ? silence : sine, place,
                       frames);
    if (period >= 20) all.insert(all.end(), frames.begin(), frames.end());
  }
  return all;
}

/// Root mean square of each channel.
std::vector<double> levels(Layout layout, const Vector3& place, Signal signal = kPercept) {
  const auto frames = render(layout, place, signal);
  const std::size_t channels = channel_count(layout);
  std::vector<double> sums(channels, 0.0);
  for (std::size_t i = 0; i < frames.size(); ++i)
    sums[i % channels] += static_cast<double>(frames[i]) * static_cast<double>(frames[i]);
  for (double& sum : sums)
    sum = std::sqrt(sum * static_cast<double>(channels) / static_cast<double>(frames.size()));
  return sums;
}

const Vector3 kLeft{-1, 0, 0}, kRight{1, 0, 0}, kAhead{0, 0, -1}, kBehind{0, 0, 1};
const double kRms = 0.25 / std::sqrt(2.0);

TEST(Spatialiser, MonoIsTheSumAndHasNoDirection) {
  EXPECT_NEAR(levels(Layout::kMono, kLeft)[0], kRms, 1e-3);
  EXPECT_NEAR(levels(Layout::kMono, kBehind)[0], kRms, 1e-3);
  EXPECT_NEAR(levels(Layout::kMono, kRight, kAlarm)[0], kRms, 1e-3);
}

TEST(Spatialiser, StereoGoesFromSideToSide) {
  const auto left = levels(Layout::kStereo, kLeft), right = levels(Layout::kStereo, kRight);
  EXPECT_GT(left[0], 10.0 * left[1]);
  EXPECT_NEAR(right[1], left[0], 0.01 * left[0]);
  EXPECT_NEAR(right[0], left[1], 0.01 * left[0]);
  const auto ahead = levels(Layout::kStereo, kAhead);
  EXPECT_NEAR(ahead[0], ahead[1], 0.01 * ahead[0]);
  const auto half = levels(Layout::kStereo, {-1, 0, -1});
  EXPECT_GT(half[0], 1.5 * half[1]);
  EXPECT_LT(half[0] / half[1], left[0] / left[1]);
}

TEST(Spatialiser, StereoIsAboutAsLoudAllTheWayRound) {
  // Loudness is to tell of speed. Both channels carry the same phase and add up in the air.
  double least = 1e9, most = 0.0;
  for (int deg = 0; deg < 360; deg += 15) {
    const double a = deg * std::numbers::pi / 180.0;
    const auto level = levels(Layout::kStereo, {std::sin(a), 0, -std::cos(a)});
    least = std::min(least, level[0] + level[1]);
    most = std::max(most, level[0] + level[1]);
  }
  EXPECT_LT(20.0 * std::log10(most / least), 3.5)
      << "decibels between the loudest and the quietest direction";
}

TEST(Spatialiser, SurroundTellsFrontFromBackAndLeftFromRight) {
  for (const Layout layout : {Layout::k5_1, Layout::k7_1}) {
    enum { kFrontLeft, kFrontRight, kCentre, kLow, kBackLeft, kBackRight, kSideLeft, kSideRight };
    const auto ahead = levels(layout, kAhead), behind = levels(layout, kBehind);
    EXPECT_GT(ahead[kCentre] + ahead[kFrontLeft] + ahead[kFrontRight],
              3.0 * (ahead[kBackLeft] + ahead[kBackRight]))
        << name_of(layout);
    EXPECT_GT(behind[kBackLeft] + behind[kBackRight],
              3.0 * (behind[kCentre] + behind[kFrontLeft] + behind[kFrontRight]))
        << name_of(layout);
    const auto front_left = levels(layout, {-0.5, 0, -0.866}), back_right = levels(layout, {0.766, 0, 0.643});
    EXPECT_GT(front_left[kFrontLeft], 3.0 * front_left[kFrontRight]) << name_of(layout);
    EXPECT_GT(back_right[kBackRight], 3.0 * back_right[kBackLeft]) << name_of(layout);
    if (layout == Layout::k7_1) {
      const auto left = levels(layout, kLeft);
      EXPECT_GT(left[kSideLeft], 3.0 * left[kSideRight]);
      EXPECT_GT(left[kSideLeft], left[kFrontLeft]);
    }
    EXPECT_LT(ahead[kLow], 1e-4) << "a direction is not told by the low channel";
  }
}

TEST(Spatialiser, HrtfDiffersBetweenTheEarsAndBetweenFrontAndBack) {
  const auto left = levels(Layout::kHrtf, kLeft), right = levels(Layout::kHrtf, kRight),
             ahead = levels(Layout::kHrtf, kAhead);
  EXPECT_GT(left[0], 1.3 * left[1]);
  EXPECT_GT(right[1], 1.3 * right[0]);
  EXPECT_NEAR(ahead[0], ahead[1], 0.15 * ahead[0]);
  // Front and back are one to two loudspeakers; to an ear they are filtered differently.
  const auto front = render(Layout::kHrtf, {-0.5, 0, -0.866}), back = render(Layout::kHrtf, {-0.5, 0, 0.866});
  double difference = 0.0, sum = 0.0;
  for (std::size_t i = 0; i < front.size(); ++i) {
    difference += std::pow(static_cast<double>(front[i]) - static_cast<double>(back[i]), 2);
    sum += std::pow(static_cast<double>(front[i]), 2);
  }
  EXPECT_GT(difference, 0.01 * sum);
}

TEST(Spatialiser, AnAlarmStandsInTheMiddleWhereverThePerceptIs) {
  for (const Layout layout : {Layout::kStereo, Layout::kHrtf}) {
    const auto level = levels(layout, kLeft, kAlarm);
    EXPECT_NEAR(level[0], level[1], 0.15 * level[0]) << name_of(layout);
  }
}

TEST(Spatialiser, CloseToTheEarsSoundComesFromAllAround) {
  const auto near = levels(Layout::kStereo, {-0.01, 0, 0});
  EXPECT_LT(near[0], 1.5 * near[1]);
}

TEST(Spatialiser, DistanceDoesNotCountForDirectionAlone) {
  const auto close = levels(Layout::k5_1, {-3, 0, -3}), far = levels(Layout::k5_1, {-300, 0, -300});
  for (std::size_t i = 0; i < close.size(); ++i) EXPECT_NEAR(close[i], far[i], 0.01 * kRms);
}

TEST(Spatialiser, RendersTheSameSamplesEveryTime) {
  for (const Layout layout : {Layout::kStereo, Layout::k7_1, Layout::kHrtf})
    EXPECT_EQ(render(layout, {0.3, 0.2, -0.5}), render(layout, {0.3, 0.2, -0.5})) << name_of(layout);
}

TEST(Spatialiser, SeveralWorkSideBySide) {
  Spatialiser stereo(Layout::kStereo, kNear_m), surround(Layout::k5_1, kNear_m);
  const std::array<float, kPeriodFrames> silence{};
  std::array<float, kPeriodFrames> constant{};
  constant.fill(0.25F);
  std::array<float, kPeriodFrames * 2> two{};
  std::array<float, kPeriodFrames * 6> six{};
  for (int i = 0; i < 10; ++i) {
    stereo.render(constant, silence, kLeft, two);
    surround.render(silence, silence, kLeft, six);
  }
  EXPECT_GT(two[kPeriodFrames], 0.1F);
  for (const float sample : six) EXPECT_EQ(sample, 0.0F);
}

TEST(Spatialiser, OurSideUsesNoHeap) {
  for (const Layout layout : {Layout::kMono, Layout::kStereo, Layout::kHrtf}) {
    Spatialiser spatialiser(layout, kNear_m);
    const std::array<float, kPeriodFrames> signal{};
    std::array<float, kPeriodFrames * 2> frames{};
    const std::span used(frames.data(), kPeriodFrames * channel_count(layout));
    const test::HeapGuard guard("libopenal");
    for (int i = 0; i < 200; ++i) spatialiser.render(signal, signal, kLeft, used);
  }
}

}  // namespace
}  // namespace phantom::audio_percept
