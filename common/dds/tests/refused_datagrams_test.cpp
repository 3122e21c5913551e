#include "common/dds/admission/refused_datagrams.hpp"

#include <gtest/gtest.h>

namespace phantom::dds {
namespace {

constexpr std::uint32_t kOne = 0x0a1e0102, kOtherAddress = 0x0a1e0103;

TEST(SenderCounts, ReturnsTheGreatestSender) {
  SenderCounts counts;
  EXPECT_EQ(counts.greatest().count, 0u);
  for (int i = 0; i < 3; ++i) counts.add(kOne);
  for (int i = 0; i < 5; ++i) counts.add(kOtherAddress);
  EXPECT_EQ(counts.greatest().address, kOtherAddress);
  EXPECT_EQ(counts.greatest().count, 5u);
}

// A million forged addresses take no memory, and do not hide the one that sends a tenth of all.
TEST(SenderCounts, FindsAGreatSenderAmongAnyNumber) {
  SenderCounts counts;
  for (std::uint32_t i = 0; i < 1'000'000; ++i) counts.add(i % 10 == 0 ? kOne : 0x0b000000 + i);
  EXPECT_EQ(counts.greatest().address, kOne);
  EXPECT_LE(counts.greatest().count, 100'000u) << "never more than it sent";
  EXPECT_GE(counts.greatest().count, 90'000u);
}

TEST(RefusedDatagrams, CountsByReasonAndSender) {
  RefusedDatagrams refused;
  for (std::uint16_t port = 1; port <= 3; ++port) refused.add(wire::Fault::kHeader, {kOne, port});
  refused.add(wire::Fault::kHeader, {kOtherAddress, 9});
  refused.add(wire::Fault::kRate, {kOtherAddress, 9});
  const auto list = refused.list();
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].fault, wire::Fault::kHeader);
  EXPECT_EQ(list[0].count, 4u);
  EXPECT_EQ(list[0].greatest.address, kOne);
  EXPECT_EQ(list[0].greatest.count, 3u);
  EXPECT_EQ(list[0].last, (wire::Source{kOtherAddress, 9}));
  EXPECT_EQ(list[1].fault, wire::Fault::kRate);
  EXPECT_EQ(list[1].greatest.address, kOtherAddress);
}

TEST(RefusedDatagrams, AddressesFitTheUnitOfAFigure) {
  EXPECT_EQ(address_text(0xffffffff), "255.255.255.255");
  EXPECT_EQ(to_text({kOne, 7410}), "10.30.1.2:7410");
}

}  // namespace
}  // namespace phantom::dds
