#include "common/percept/equal_loudness.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace phantom::percept {
namespace {

TEST(EqualLoudness, IsTheContourOfTheStandardAt40Phon) {
  // Levels of the 40-phon contour as published with the standard, to a tenth of a decibel.
  for (const auto& [frequency_Hz, level_dB] : {std::pair{20.0, 99.9},
                                               {31.5, 88.2},
                                               {63.0, 73.1},
                                               {100.0, 64.4},
                                               {125.0, 60.6},
                                               {200.0, 53.4},
                                               {250.0, 50.4},
                                               {400.0, 45.0},
                                               {500.0, 43.1},
                                               {800.0, 40.1},
                                               {1000.0, 40.0},
                                               {1250.0, 41.8},
                                               {1600.0, 42.5},
                                               {2000.0, 39.2},
                                               {3150.0, 35.6},
                                               {4000.0, 36.6},
                                               {8000.0, 51.8},
                                               {12500.0, 51.5}}) {
    EXPECT_NEAR(equal_loudness_level_dB(frequency_Hz, 40.0), level_dB, 0.06) << frequency_Hz << " Hz";
  }
}

TEST(EqualLoudness, APhonIsADecibelAt1kHz) {
  for (double phon : {20.0, 40.0, 60.0, 80.0}) EXPECT_NEAR(equal_loudness_level_dB(1000.0, phon), phon, 0.05);
}

TEST(EqualLoudness, LiesBetweenTheThirdOctavesBesideIt) {
  for (double phon : {20.0, 60.0, 80.0}) {
    const double low = equal_loudness_level_dB(200.0, phon), high = equal_loudness_level_dB(250.0, phon);
    EXPECT_NEAR(equal_loudness_level_dB(std::sqrt(200.0 * 250.0), phon), (low + high) / 2, 1e-9);
  }
}

TEST(EqualLoudness, RisesWithTheLoudnessEverywhere) {
  for (double f = 20.0; f <= 12500.0; f *= 1.13) {
    for (double phon = 20.0; phon < 80.0; phon += 10.0)
      EXPECT_GT(equal_loudness_level_dB(f, phon + 10.0), equal_loudness_level_dB(f, phon)) << f;
  }
}

TEST(EqualLoudness, StaysWithinWhatTheStandardDefines) {
  EXPECT_EQ(equal_loudness_level_dB(1.0, 60.0), equal_loudness_level_dB(20.0, 60.0));
  EXPECT_EQ(equal_loudness_level_dB(1e6, 60.0), equal_loudness_level_dB(12500.0, 60.0));
  EXPECT_EQ(equal_loudness_level_dB(500.0, 500.0), equal_loudness_level_dB(500.0, 80.0));
}

TEST(EqualLoudness, TheGreatestLevelIsThatOfADenseSearch) {
  for (const auto& [low, high] :
       {std::pair{220.0, 1760.0}, {900.0, 1900.0}, {1260.0, 1590.0}, {3000.0, 9000.0}}) {
    double greatest = -1e9;
    for (double f = low; f <= high; f += 0.1) greatest = std::max(greatest, equal_loudness_level_dB(f, 60.0));
    EXPECT_NEAR(greatest_equal_loudness_level_dB(low, high, 60.0), greatest, 0.005) << low;
  }
}

}  // namespace
}  // namespace phantom::percept
