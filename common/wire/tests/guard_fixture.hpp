#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "common/wire/guard.hpp"
#include "common/wire/tests/messages.hpp"

namespace phantom::wire::test {

constexpr Source kHost{0x0a1e0102, 40000}, kFar{0x0a1e0109, 40000};
constexpr core::Nanoseconds kSecond = core::kNsPerSecond;

/// A guard, and what it says of datagrams that come to it.
struct GuardTest : ::testing::Test {
  explicit GuardTest(const GuardOptions& given = {}) : options(given), guard(given) {}

  Fault receive(std::vector<std::uint8_t> datagram, const Source& source = kHost,
                core::Nanoseconds at = kSecond, bool discovery = true) {
    last = std::move(datagram);
    const Fault fault = check_message(last, options.receiver, *facts);
    return fault != Fault::kNone ? fault : guard.check(last, *facts, source, discovery, at);
  }

  GuardOptions options;
  Guard guard;
  std::unique_ptr<MessageFacts> facts = std::make_unique<MessageFacts>();
  std::vector<std::uint8_t> last;
};

}  // namespace phantom::wire::test
