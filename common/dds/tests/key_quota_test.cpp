#include "common/dds/arbitration/key_quota.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/dds/admission/refused_datagrams.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/tests/prefixes.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::dds {
namespace {

const GuidPrefix kServer = prefix(9), kStranger = prefix(3), kOther = prefix(5);

KeyQuota::Key key(std::size_t number) {
  KeyQuota::Key made{};
  made[0] = static_cast<std::uint8_t>(number);
  made[1] = static_cast<std::uint8_t>(number >> 8);
  return made;
}

class Census : public ::testing::Test {
 protected:
  KeyQuota census_{100};
  std::size_t next_ = 0;

  /// Brings so many new keys; returns who had to go at the last.
  std::optional<GuidPrefix> bring(const GuidPrefix& writer, std::size_t count) {
    std::optional<GuidPrefix> gone;
    for (std::size_t i = 0; i < count; ++i) gone = census_.note(writer, key(next_++));
    return gone;
  }
};

TEST_F(Census, NobodyGoesWhileThereIsRoom) {
  EXPECT_FALSE(bring(kServer, 60));
  EXPECT_FALSE(bring(kStranger, 40));
  for (std::size_t number = 0; number < 100; ++number) EXPECT_FALSE(census_.note(kServer, key(number)));
  EXPECT_EQ(census_.size(), 100U);
}

TEST_F(Census, WhoCameLastGoesWhoeverBringsTheNextKey) {
  bring(kServer, 70);
  bring(kStranger, 30);
  EXPECT_EQ(bring(kServer, 1), kStranger);
  EXPECT_EQ(census_.size(), 71U);
  EXPECT_FALSE(bring(kServer, 29));
}

TEST_F(Census, WhoBroughtFewStaysHoweverLateItCame) {
  bring(kServer, 10);
  bring(kStranger, 85);
  bring(kOther, 5);
  EXPECT_EQ(bring(kOther, 1), kStranger);
  EXPECT_EQ(census_.size(), 16U);
}

TEST_F(Census, OfManySmallOnesTheGreatestGoes) {
  for (std::uint8_t number = 0; number < 25; ++number) bring(prefix(number), 4 - (number == 7 ? 0 : 1));
  bring(prefix(100), 24);
  EXPECT_EQ(census_.size(), 100U);
  EXPECT_EQ(bring(prefix(101), 1), prefix(100));  // an eighth and more
  EXPECT_EQ(census_.size(), 77U);
  for (std::uint8_t number = 102; number < 125; ++number) bring(prefix(number), 1);
  EXPECT_EQ(bring(prefix(125), 1), prefix(7));
}

TEST_F(Census, WhoHasGoneMakesRoom) {
  bring(kStranger, 100);
  census_.forget(kStranger);
  EXPECT_EQ(census_.size(), 0U);
  EXPECT_FALSE(bring(kServer, 100));
}

struct Leavers : DiscoveryEvents {
  std::atomic<int> left{0};
  void on_participant(const FoundParticipant& found) override {
    if (found.event == Discovered::kLeft || found.event == Discovered::kLost) ++left;
  }
};

msg::ComponentStatus named(const std::string& name) {
  msg::ComponentStatus status;
  status.component_name(name);
  status.host("here");
  return status;
}

// Without the census a reader with all its keys taken refuses every new one, whoever sends it.
TEST(KeysOfAParticipant, TooManyEndItAndWhatOthersSendIsHeard) {
  const auto ear = std::make_shared<Leavers>();
  Participant keeper("keeper", test_network(), ear);
  Waiter waiter;
  std::set<std::string> heard;
  const Reader<msg::ComponentStatus> reader(
      keeper, kComponentStatus, [&](const msg::ComponentStatus& status, const SampleInfo&) {
        waiter.change([&] { heard.insert(status.component_name().c_str()); });
      });
  Participant flooder("flooder", test_network());
  std::vector<Writer<msg::ComponentStatus>> writers;  // each keeps 256 keys
  for (int writer = 0; writer < 8; ++writer) {
    writers.emplace_back(flooder, kComponentStatus);
    ASSERT_TRUE(eventually([&] { return writers.back().matched() > 0 || ear->left > 0; }));
    for (int number = 0; number < 250; ++number)
      writers.back().write(named("invented_" + std::to_string(writer) + "_" + std::to_string(number)));
  }
  ASSERT_TRUE(eventually([&] { return ear->left > 0; })) << "the flooder stays";
  ASSERT_TRUE(eventually([&] {
    const auto refused = keeper.refused_datagrams();
    return std::any_of(refused.begin(), refused.end(),
                       [](const Refused& one) { return one.fault == wire::Fault::kFlood; });
  })) << "its datagrams are not refused";
  Participant honest("honest", test_network());
  Writer<msg::ComponentStatus> own(honest, kComponentStatus);
  own.write(named("slave_io"));
  EXPECT_TRUE(waiter.wait([&] { return heard.contains("slave_io"); })) << "others are heard no more";
}

}  // namespace
}  // namespace phantom::dds
