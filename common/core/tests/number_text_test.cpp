#include "common/core/number_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

namespace phantom::core {
namespace {

TEST(NumberText, IsReadAsStrtodReadsIt) {
  for (const char* text : {"0",
                           "-0",
                           "1",
                           "-2.5",
                           ".5",
                           "5.",
                           "1e3",
                           "1E-3",
                           "+7",
                           "1e308",
                           "1e309",
                           "-1e400",
                           "1e-400",
                           "-1e-400",
                           "0.0001e320",
                           "1234567890e300",
                           "0e999",
                           "0.000e99999999999999999999",
                           "1e99999999999999999999",
                           "1e-99999999999999999999",
                           "0.1e309",
                           "10e308",
                           "00012e307"}) {
    const auto value = number_of(text);
    ASSERT_TRUE(value) << text;
    EXPECT_EQ(*value, std::strtod(text, nullptr)) << text;
    EXPECT_EQ(std::signbit(*value), std::signbit(std::strtod(text, nullptr))) << text;
  }
  std::mt19937 random(3);
  for (int i = 0; i < 20'000; ++i) {
    const auto digits = [&](std::size_t count) {
      std::string text;
      for (std::size_t k = 0; k < count; ++k) text += static_cast<char>('0' + random() % 10);
      return text;
    };
    const std::string text = (random() % 2 != 0 ? "-" : "") + digits(1 + random() % 12) + "." +
                             digits(random() % 12) + "e" + (random() % 2 != 0 ? "-" : "+") +
                             digits(1 + random() % 4);
    const auto value = number_of(text);
    ASSERT_TRUE(value) << text;
    const double expected = std::strtod(text.c_str(), nullptr);
    // from_chars says "out of range" of what strtod rounds to the least numbers.
    if (std::abs(expected) < 1e-307)
      EXPECT_LT(std::abs(*value), 1e-307) << text;
    else
      EXPECT_EQ(*value, expected) << text;
  }
}

TEST(NumberText, WhatIsNoNumberIsNone) {
  for (const char* text : {"", "+", "-", "+-1", "1x", "x1", "1 ", " 1", "1,5", "0x10", "1e", "--1", "1.2.3"})
    EXPECT_FALSE(number_of(text)) << text;
}

}  // namespace
}  // namespace phantom::core
