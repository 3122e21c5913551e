#include "common/dds/endpoints/outbox.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <vector>

#include "fast_dds/test_transport.hpp"

namespace phantom::dds {
namespace {

namespace rtps = fast_dds::rtps;

rtps::Locator_t address(std::uint32_t number) {
  rtps::Locator_t made(LOCATOR_KIND_UDPv4, 7410);
  rtps::IPLocator::setIPv4(made, 10, static_cast<rtps::octet>(number >> 16),
                           static_cast<rtps::octet>(number >> 8), static_cast<rtps::octet>(number));
  return made;
}

rtps::LocatorList_t one(const rtps::Locator_t& locator) {
  rtps::LocatorList_t list;
  list.push_back(locator);
  return list;
}

class OutboxTo : public ::testing::Test {
 protected:
  Outbox outbox_;
  fast_dds::KeepingSender socket_;

  void open_many() {  // twice as many as are known
    for (std::uint32_t number = 1000; number < 1000 + 2 * Outbox::kMaxOpened; ++number)
      outbox_.opened(address(number));
  }
  bool reaches(const rtps::Locator_t& peer) {
    socket_.reached.clear();
    outbox_.put({1, 2, 3}, one(peer));
    outbox_.send_by(socket_);
    return std::count(socket_.reached.begin(), socket_.reached.end(), peer) == 1;
  }
};

TEST_F(OutboxTo, AnAddressThatWasNeverOpenedIsLeftOut) { EXPECT_FALSE(reaches(address(1))); }

TEST_F(OutboxTo, ANewPeerIsReachedHoweverManyWereOpenedBefore) {
  open_many();
  outbox_.opened(address(1));
  EXPECT_TRUE(reaches(address(1)));
}

TEST_F(OutboxTo, APeerThatIsPresentIsReachedHoweverManyWereOpenedSince) {
  outbox_.opened(address(1));
  for (std::uint32_t number = 1000; number < 1000 + 4 * Outbox::kMaxOpened; ++number) {
    outbox_.opened(address(number));
    if (number % 4096 == 0) outbox_.keep(one(address(1)));
  }
  EXPECT_TRUE(reaches(address(1)));
}

TEST_F(OutboxTo, WhoIsNotKeptIsForgotten) {
  outbox_.opened(address(1));
  EXPECT_EQ(outbox_.forgotten(), 0U);
  open_many();
  EXPECT_EQ(outbox_.forgotten(), Outbox::kMaxOpened + 1);
  outbox_.keep(one(address(1)));  // too late: it may not be opened any more
  EXPECT_FALSE(reaches(address(1)));
}

}  // namespace
}  // namespace phantom::dds
