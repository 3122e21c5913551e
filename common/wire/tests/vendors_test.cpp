// What other vendors' products send, put together from what was seen of them: the order and sizes of their
// parameters, their flags, their own numbers. README.md of tests/interop says what was seen where.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "common/wire/guard.hpp"
#include "common/wire/tests/messages.hpp"

namespace phantom::wire {
namespace {

using namespace test;

constexpr std::uint16_t kRti = 0x0101, kOpenSplice = 0x0102, kOpenDds = 0x0103, kCyclone = 0x0110,
                        kRustDds = 0x0112, kDustDds = 0x0114;

GuidPrefix prefix_of(std::uint16_t vendor) {
  GuidPrefix prefix = kPeer;
  prefix[0] = static_cast<std::uint8_t>(vendor >> 8);
  prefix[1] = static_cast<std::uint8_t>(vendor);
  return prefix;
}

Pid own(int number) { return static_cast<Pid>(number); }

/// A locator of a kind and port that no socket of ours has.
Octets foreign_locator(int kind, std::uint32_t port) {
  return Octets(false).u32(static_cast<std::uint32_t>(kind)).u32(port).u32(0x61abd979).u32(1).u32(2).u32(0);
}

Octets head_of(std::uint16_t vendor) {
  return Octets()
      .parameter(Pid::kProtocolVersion, Octets().u8({2, 3, 0, 0}))
      .parameter(Pid::kVendorId, Octets().u8({vendor >> 8, vendor & 0xff, 0, 0}))
      .parameter(Pid::kParticipantGuid, Octets().guid({prefix_of(vendor), kParticipantEntity}));
}

std::vector<std::uint8_t> timestamp() {
  return submessage(SubmessageId::kInfoTimestamp, 0, Octets().u32(1638425814).u32(2083784982));
}
std::vector<std::uint8_t> destination() {
  return submessage(SubmessageId::kInfoDestination, 0, Octets().raw(kPeer));
}

/// An announcement to any reader, as most send it.
std::vector<std::uint8_t> announcement_of(std::uint16_t vendor, Octets list, EntityId reader = 0,
                                          const Octets& inline_qos = Octets()) {
  const int flags = inline_qos.bytes.empty() ? 4 : 6;
  return message({timestamp(), submessage(SubmessageId::kData, flags,
                                          data_fields(reader, kParticipantWriter, 1, inline_qos,
                                                      encapsulated(list.sentinel())))},
                 prefix_of(vendor), vendor);
}

class OfOtherVendors : public ::testing::Test {
 protected:
  MessageFacts facts_;
  Guard guard_{GuardOptions{}};
  core::Nanoseconds now_ = core::kNsPerSecond;

  /// What comes of a datagram, at a participant with or without security.
  Fault fate(std::vector<std::uint8_t> datagram, bool secured = false) {
    if (const Fault fault = check_message(datagram, {secured}, facts_); fault != Fault::kNone) return fault;
    return guard_.check(datagram, facts_, {0x7f000001, 7410}, true, now_);
  }
};

// Connext 6: numbers of its own from 0x8000 on, of which 0x800f has four octets here and 24 with Fast DDS; a
// locator of shared memory; no reader named.
TEST_F(OfOtherVendors, AnnouncementOfRtiConnext) {
  Octets list = head_of(kRti);
  list.parameter(Pid::kBuiltinEndpointSet, Octets().u32(0xc3f))
      .parameter(Pid::kBuiltinEndpointQos, Octets().u32(1))
      .parameter(own(0x8000), Octets().u8({6, 0, 1, 0}))
      .parameter(Pid::kPropertyList, Octets()
                                         .u32(2)
                                         .text("dds.sys_info.hostname")
                                         .text("df0b6d83ab46")
                                         .text("dds.sys_info.process_id")
                                         .text("4830"))
      .parameter(Pid::kDefaultUnicastLocator, locator(0, 7411))
      .parameter(Pid::kDefaultUnicastLocator, foreign_locator(1, 7411))
      .parameter(Pid::kMetatrafficUnicastLocator, locator(0, 7410))
      .parameter(Pid::kMetatrafficUnicastLocator, foreign_locator(1, 7410))
      .parameter(Pid::kMetatrafficMulticastLocator, locator(0xefff0001, 7400))
      .parameter(Pid::kLeaseDuration, Octets().u32(6).u32(0x7fffffff))
      .parameter(own(0x8001), Octets().u32(0xffff))
      .parameter(Pid::kEntityName, Octets().text("RTI Data Distribution Service Spy"))
      .parameter(Pid::kDomainId, Octets().u32(0))
      .parameter(own(0x800f), Octets().u32(0))
      .parameter(own(0x8010), Octets().u32(2).u32(1).u32(0xffe3).u32(0x01000000).u32(0x10000))
      .parameter(own(0x8016), Octets().u32(16).u32(0))
      .parameter(own(0x8017), Octets().u32(3));
  EXPECT_EQ(fate(announcement_of(kRti, list)), Fault::kNone);
  ASSERT_EQ(facts_.participant_count, 1U);
  EXPECT_NEAR(facts_.participants[0].lease_s, 6.5, 0.01);
}

TEST_F(OfOtherVendors, AnnouncementOfAnElderRti) {
  Octets list = head_of(kRti);
  list.parameter(Pid::kBuiltinEndpointSet, Octets().u32(0x3f))
      .parameter(Pid::kDefaultUnicastLocator, locator(0x7f000001, 4912))
      .parameter(Pid::kMetatrafficUnicastLocator, locator(0x7f000001, 4913))
      .parameter(Pid::kLeaseDuration, Octets().u32(100).u32(0))
      .parameter(Pid::kPropertyList, Octets().u32(0))
      .parameter(own(0x8000), Octets().u8({4, 5, 0x64, 0}))
      .parameter(Pid::kEntityName, Octets().text("[ENTITY]"));
  EXPECT_EQ(fate(announcement_of(kRti, list)), Fault::kNone);
}

// OpenSplice: the key in inline QoS as well, and the participant's GUID last.
TEST_F(OfOtherVendors, AnnouncementOfOpenSplice) {
  const Guid guid{prefix_of(kOpenSplice), kParticipantEntity};
  const Octets inline_qos = Octets().parameter(Pid::kKeyHash, Octets().guid(guid)).sentinel();
  Octets list;
  list.parameter(Pid::kProtocolVersion, Octets().u8({2, 1, 0, 0}))
      .parameter(Pid::kVendorId, Octets().u8({1, 2, 0, 0}))
      .parameter(Pid::kDefaultUnicastLocator, locator(0xc0a80204, 7411))
      .parameter(Pid::kMetatrafficUnicastLocator, locator(0xc0a80204, 7410))
      .parameter(Pid::kLeaseDuration, Octets().u32(11).u32(0))
      .parameter(Pid::kParticipantGuid, Octets().guid(guid))
      .parameter(Pid::kBuiltinEndpointSet, Octets().u32(0x415))
      .parameter(own(0x8000), Octets().u32(0x15))
      .parameter(own(0x8007), Octets().u32(0).u32(47).u32(5).u32(0).u32(80).text("HOST/6.10.2/\"x86_64\"/"))
      .parameter(own(0x8025), Octets().u32(0x7f20f7d7).u32(443).u32(0x01000000));
  EXPECT_EQ(fate(announcement_of(kOpenSplice, list, 0, inline_qos)), Fault::kNone);
}

// OpenDDS: the only submessage says length 0, which is "up to the end"; locators that come twice.
TEST_F(OfOtherVendors, AnnouncementOfOpenDds) {
  Octets list;
  list.parameter(Pid::kBuiltinEndpointQos, Octets().u32(0))
      .parameter(Pid::kDomainId, Octets().u32(0))
      .parameter(Pid::kProtocolVersion, Octets().u8({2, 4, 0, 0}))
      .parameter(Pid::kParticipantGuid, Octets().guid({prefix_of(kOpenDds), kParticipantEntity}))
      .parameter(Pid::kVendorId, Octets().u8({1, 3, 0, 0}))
      .parameter(own(0x0044), Octets().u32(0xc3f))
      .parameter(Pid::kBuiltinEndpointSet, Octets().u32(0xc3f))
      .parameter(Pid::kMetatrafficUnicastLocator, locator(0x0a508ec9, 42143))
      .parameter(Pid::kMetatrafficUnicastLocator, locator(0x0a508ec9, 42143))
      .parameter(Pid::kMetatrafficMulticastLocator, locator(0xefff0001, 8400))
      .parameter(Pid::kManualLivelinessCount, Octets().u32(0))
      .parameter(Pid::kLeaseDuration, Octets().u32(300).u32(0))
      .parameter(own(0xb038), Octets().u32(1))
      .sentinel();
  auto data = submessage(SubmessageId::kData, 4,
                         data_fields(0, kParticipantWriter, 35, Octets(), encapsulated(list)));
  data[2] = data[3] = 0;
  EXPECT_EQ(fate(message({data}, prefix_of(kOpenDds), kOpenDds)), Fault::kNone);
}

TEST_F(OfOtherVendors, SubscriptionOfOpenDds) {
  const Guid reader{prefix_of(kOpenDds), 0x00000007};
  Octets list;
  list.parameter(Pid::kTopicName, Octets().text("Square"))
      .parameter(Pid::kTypeName, Octets().text("ShapeType"))
      .parameter(Pid::kReliability, Octets().u32(1).u32(0x7fffffff).u32(0x7fffffff))
      .parameter(Pid::kEndpointGuid, Octets().guid(reader))
      .parameter(Pid::kMulticastLocator, locator(0xefff0002, 7401))
      .parameter(Pid::kUnicastLocator, locator(0x0a508ec9, 45000))
      .parameter(Pid::kDataRepresentation, Octets().u32(1).u16(2).u16(0))
      .parameter(Pid::kTypeConsistency, Octets().u16(1).u8({0, 1, 0, 0}).u16(0))
      .sentinel();
  const auto data = submessage(SubmessageId::kData, 4,
                               data_fields(0, kSubscriptionWriter, 1, Octets(), encapsulated(list)));
  EXPECT_EQ(fate(message({timestamp(), data}, reader.prefix, kOpenDds)), Fault::kNone);
}

// Cyclone: a destination before its time, numbers of its own.
TEST_F(OfOtherVendors, AnnouncementOfCyclone) {
  Octets list = head_of(kCyclone);
  list.parameter(Pid::kLeaseDuration, Octets().u32(10).u32(0))
      .parameter(Pid::kBuiltinEndpointSet, Octets().u32(0xc3f))
      .parameter(Pid::kDefaultMulticastLocator, locator(0xefff0001, 7401))
      .parameter(own(0x8007),
                 Octets().u32(0).u32(44).u32(0).u32(0).u32(0).text("test.local/0.8.0/Linux/Linux"))
      .parameter(own(0x8019), Octets().u8({0, 0x80, 6, 0}))
      .sentinel();
  const auto data =
      submessage(SubmessageId::kData, 4,
                 data_fields(kParticipantReader, kParticipantWriter, 1, Octets(), encapsulated(list)));
  EXPECT_EQ(fate(message({destination(), timestamp(), data}, prefix_of(kCyclone), kCyclone)), Fault::kNone);
}

// RustDDS and Dust DDS: little of the standard's, big-endian too.
TEST_F(OfOtherVendors, AnnouncementsOfTheRustProducts) {
  for (const std::uint16_t vendor : {kRustDds, kDustDds}) {
    Octets list = head_of(vendor);
    list.parameter(Pid::kExpectsInlineQos, Octets().u32(0))
        .parameter(Pid::kMetatrafficUnicastLocator, locator(0x0a508ec9, 7410))
        .parameter(Pid::kBuiltinEndpointSet, Octets().u32(0x3f))
        .parameter(Pid::kLeaseDuration, Octets().u32(60).u32(0))
        .parameter(Pid::kManualLivelinessCount, Octets().u32(0));
    EXPECT_EQ(fate(announcement_of(vendor, list, kParticipantReader)), Fault::kNone) << vendor;
  }
  Octets list(false);
  list.parameter(Pid::kParticipantGuid, Octets(false).guid({prefix_of(kDustDds), kParticipantEntity}))
      .parameter(Pid::kLeaseDuration, Octets(false).u32(100).u32(0))
      .sentinel();
  const auto data = submessage(
      SubmessageId::kData, 4,
      data_fields(kParticipantReader, kParticipantWriter, 2, Octets(false), encapsulated(list), false));
  EXPECT_EQ(fate(message({data}, prefix_of(kDustDds), kDustDds)), Fault::kNone);
}

// Acknowledgements before anything was heard; a sample with its heartbeat, as Shapes Demo sends them; a
// writer that has none yet; fragments; a gap.
TEST_F(OfOtherVendors, WhatReadersAndWritersSend) {
  for (const std::uint16_t vendor : {kRti, kOpenSplice, kOpenDds, kCyclone, kRustDds, kDustDds}) {
    ASSERT_EQ(fate(announcement_of(vendor, head_of(vendor))), Fault::kNone);
    const auto of_vendor = [&](const std::vector<std::uint8_t>& one) {
      return fate(message({destination(), timestamp(), one}, prefix_of(vendor), vendor));
    };
    const EntityId reader = 0x00000107, writer = 0x00000102;
    for (const std::int64_t base : {0, 1})
      EXPECT_EQ(of_vendor(submessage(SubmessageId::kAckNack, 2,
                                     Octets().entity(reader).entity(writer).sequence(base).u32(0).u32(1))),
                Fault::kNone);
    EXPECT_EQ(of_vendor(submessage(SubmessageId::kHeartbeat, 0,
                                   Octets().entity(0).entity(writer).sequence(1).sequence(0).u32(1))),
              Fault::kNone);
    EXPECT_EQ(of_vendor(submessage(SubmessageId::kGap, 0,
                                   Octets().entity(reader).entity(writer).sequence(5).sequence(7).u32(0))),
              Fault::kNone);
    EXPECT_EQ(of_vendor(submessage(
                  SubmessageId::kData, 4,
                  data_fields(0, writer, 91, Octets(), Octets().u8({0, 1, 0, 0}).text("RED").u32(105)))),
              Fault::kNone);
    EXPECT_EQ(of_vendor(fragment_submessage({.reader = reader, .writer = writer, .sequence = 92})),
              Fault::kNone);
  }
}

// Kinds that the standard does not know: RTI's batches, sessions and acknowledgements of the application
// (0x10 … 0x1e), and from 0x80 on those of any vendor.
TEST_F(OfOtherVendors, SubmessagesOfTheirOwn) {
  for (const int kind : {0x10, 0x11, 0x17, 0x18, 0x19, 0x1c, 0x1d, 0x1e, 0x80, 0x81, 0xfe, 0xff})
    EXPECT_EQ(fate(message({timestamp(), submessage(static_cast<SubmessageId>(kind), 2,
                                                    Octets().entity(1).entity(2).u32(3).u32(4))},
                           prefix_of(kRti), kRti)),
              Fault::kNone)
        << kind;
}

// Fast DDS reads its own number of inline QoS whoever sends it: that of another vendor is hidden.
TEST_F(OfOtherVendors, InlineQosOfTheirOwn) {
  const Octets list =
      Octets().parameter(own(0x800f), Octets().u32(7)).parameter(own(0x8002), Octets().u32(7)).sentinel();
  auto datagram = message(
      {submessage(SubmessageId::kData, 6, data_fields(0, 0x102, 1, list, Octets().u8({0, 1, 0, 0}).u32(1)))},
      prefix_of(kRti), kRti);
  ASSERT_EQ(check_message(datagram, {false}, facts_), Fault::kNone);
  const std::size_t at = kHeaderBytes + kSubmessageHeader + 20;
  EXPECT_EQ(datagram[at], 0);
  EXPECT_EQ(datagram[at + 1], 0);
  EXPECT_EQ(datagram[at + 8], 2);  // this one Fast DDS does not read there
}

// The same octets of Fast DDS itself are a fault.
TEST_F(OfOtherVendors, FastDdsIsHeldToItsOwnNumbers) {
  Octets list = participant_list();
  list.parameter(own(0x800f), Octets().u32(0)).sentinel();
  EXPECT_EQ(fate(message({submessage(
                SubmessageId::kData, 4,
                data_fields(kParticipantReader, kParticipantWriter, 1, Octets(), encapsulated(list)))})),
            Fault::kParameter);
}

}  // namespace
}  // namespace phantom::wire
