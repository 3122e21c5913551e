// Who falls silent, as a process that was killed: a stranger that announces itself, and then does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

#include "common/core/clock.hpp"
#include "common/dds/participant_impl.hpp"
#include "common/dds/tests/stranger.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/wire/tests/messages.hpp"

namespace phantom::dds {
namespace {

constexpr std::uint32_t kLease_s = 2;

struct Ear : DiscoveryEvents {
  std::atomic<int> came{0}, left{0}, dropped{0}, lease_s{0};
  std::atomic<core::Nanoseconds> left_ns{0};

  void on_participant(const FoundParticipant& found) override {
    if (prefix_of(found.guid) != wire::test::kPeer) return;
    if (found.event == Discovered::kFound) {
      lease_s = found.lease.seconds;
      ++came;
    } else if (found.event == Discovered::kLeft) {
      left_ns = core::monotonic_ns();
      ++left;
    } else if (found.event == Discovered::kLost) {
      ++dropped;
    }
  }
};

struct Silent : ::testing::Test {
  std::shared_ptr<Ear> ear = std::make_shared<Ear>();
  std::shared_ptr<PortFinder> asker = std::make_shared<PortFinder>();
  Participant keeper{"keeper", test_network(), ear}, other{"other", test_network(), asker};
  Stranger stranger;
  core::Nanoseconds announced_ns = 0;

  void SetUp() override {
    ASSERT_TRUE(eventually([&] { return asker->port > 0; }));
    announce();
    ASSERT_TRUE(eventually([&] { return ear->came == 1; }));
  }
  void announce() {
    announced_ns = core::monotonic_ns();
    stranger.send(wire::test::announcement(wire::test::kPeer, kLease_s), asker->port);
  }
};

TEST_F(Silent, IsForgottenAfterItsOwnLeaseAndKnownAgainOnceItSpeaks) {
  EXPECT_EQ(ear->lease_s, static_cast<int>(kLease_s)) << "as it was announced";
  ASSERT_TRUE(eventually([&] { return ear->left == 1; }));
  EXPECT_GE(ear->left_ns - announced_ns, kLease_s * core::kNsPerSecond);
  EXPECT_EQ(ear->dropped, 0) << "no lease of Fast DDS's own has ended";
  announce();
  EXPECT_TRUE(eventually([&] { return ear->came == 2; }));
}

// What comes between the end of the lease and the look that forgets it is not handed on; the next is.
TEST_F(Silent, IsForgottenAlsoIfItSpeaksBeforeThatWasSeen) {
  for (int round = 1; round <= 3; ++round) {
    const int came = ear->came;
    ASSERT_TRUE(
        eventually([&] { return core::monotonic_ns() - announced_ns > kLease_s * core::kNsPerSecond; }));
    ASSERT_TRUE(eventually([&] {
      announce();
      return ear->came > came;
    }));
    EXPECT_GE(ear->left, round) << "it was forgotten first";
  }
  EXPECT_EQ(ear->dropped, 0);
}

TEST_F(Silent, IsNobodyWhoIsHeardMoreOftenThanThat) {
  const core::Nanoseconds until = announced_ns + 3 * kLease_s * core::kNsPerSecond;
  core::Nanoseconds longest = 0;
  while (core::monotonic_ns() < until) {
    const core::Nanoseconds last = announced_ns;
    announce();
    longest = std::max(longest, announced_ns - last);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  if (longest < kLease_s * core::kNsPerSecond / 2) {
    EXPECT_EQ(ear->left, 0);
  }
}

}  // namespace
}  // namespace phantom::dds
