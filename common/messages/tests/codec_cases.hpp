#pragma once

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <string>

#include "common/messages/arm_bounds.hpp"

namespace phantom::messages {

inline constexpr std::array kNoNumbers{std::numeric_limits<double>::quiet_NaN(),
                                       std::numeric_limits<double>::infinity(),
                                       -std::numeric_limits<double>::infinity()};

/// Seven joints j1 … j7 of −1 … 1 rad, but the last, which turns endlessly; eight links.
inline ArmBounds an_arm() {
  ArmBounds arm;
  arm.joint_count = 7;
  arm.link_count = 8;
  arm.lower.fill(-1.0);
  arm.upper.fill(1.0);
  arm.lower[6] = -std::numeric_limits<double>::infinity();
  arm.upper[6] = std::numeric_limits<double>::infinity();
  for (int j = 1; j <= 7; ++j) arm.joint_names.push_back("j" + std::to_string(j));
  return arm;
}

/// `step`, 2·step … for the seven joints.
inline core::JointArray by_joint(double step) {
  core::JointArray values{};
  for (std::size_t j = 0; j < 7; ++j) values[j] = step * static_cast<double>(j + 1);
  return values;
}

template <class Sample>
void expect_same_after_round_trip(const Sample& sample) {
  const auto back = from_idl(to_idl(sample), an_arm());
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(*back, sample);
}

/// Why a message is refused after a change; empty if it is not.
template <class Message>
struct Refusals {
  Message good;

  template <class Change>
  std::string operator()(Change change) const {
    Message message = good;
    change(message);
    return from_idl(message, an_arm()).status().message();
  }
};

}  // namespace phantom::messages
