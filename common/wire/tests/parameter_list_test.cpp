#include "common/wire/parameter_list.hpp"

#include <gtest/gtest.h>

#include "common/wire/tests/messages.hpp"

namespace phantom::wire {
namespace {

using test::Octets;

struct Checked {
  Fault fault;
  ListFacts facts;
  std::size_t length = 0;
  std::vector<std::uint8_t> after;
};

Checked check(const Octets& list, std::uint16_t vendor = kVendorFastDds,
              ListPlace place = ListPlace::kDiscovery) {
  Checked checked;
  checked.after = list.bytes;
  checked.fault =
      check_parameter_list(checked.after, list.little_endian(), place, vendor, checked.facts, checked.length);
  return checked;
}

/// A list of that one parameter.
Fault of(Pid pid, const Octets& value) {
  return check(Octets(value.little_endian()).parameter(pid, value).sentinel()).fault;
}

TEST(ParameterList, ReadsWhoItIsOf) {
  const Checked checked = check(test::participant_list(test::peer(3), 20).sentinel());
  ASSERT_EQ(checked.fault, Fault::kNone);
  EXPECT_EQ(checked.facts.participant, (Guid{test::peer(3), kParticipantEntity}));
  EXPECT_DOUBLE_EQ(checked.facts.lease_s, 20.0);
  EXPECT_EQ(checked.length, checked.after.size());
  EXPECT_EQ(checked.after, test::participant_list(test::peer(3), 20).sentinel().bytes)
      << "nothing is changed";
}

TEST(ParameterList, ReadsBothByteOrders) {
  Octets list(false);
  list.parameter(Pid::kTopicName, Octets(false).text("percept"))
      .parameter(Pid::kLeaseDuration, Octets(false).u32(7).u32(0x80000000u));
  EXPECT_DOUBLE_EQ(check(list.sentinel()).facts.lease_s, 7.5);
}

TEST(ParameterList, EndsAtItsSentinel) {
  Octets list = test::endpoint_list({test::kPeer, 0x103}).sentinel();
  const std::size_t length = list.bytes.size();
  list.u32(0xffffffff);
  EXPECT_EQ(check(list).length, length);
  EXPECT_EQ(check(list).fault, Fault::kNone);
}

TEST(ParameterList, RefusesWhatIsCutAnywhere) {
  const Octets whole = test::endpoint_list({test::kPeer, 0x103}).sentinel();
  for (std::size_t size = 0; size < whole.bytes.size(); ++size) {
    Octets cut;
    cut.raw(std::span(whole.bytes).first(size));
    EXPECT_EQ(check(cut).fault, Fault::kParameterList) << size;
  }
}

TEST(ParameterList, RefusesLengthsThatAreNoMultipleOfFour) {
  EXPECT_EQ(check(Octets().u16(0x7fff).u16(3).u32(0).sentinel()).fault, Fault::kParameterList);
}

TEST(ParameterList, AcceptsParametersThatItDoesNotKnow) {
  EXPECT_EQ(check(Octets().u16(0x0099).u16(8).u32(1).u32(2).sentinel()).fault, Fault::kNone);
}

TEST(ParameterList, RefusesKnownParametersOfAnotherSize) {
  for (const auto& [pid, size] : {std::pair{Pid::kVendorId, 4},
                                  {Pid::kLeaseDuration, 8},
                                  {Pid::kReliability, 12},
                                  {Pid::kParticipantGuid, 16},
                                  {Pid::kKeyHash, 16},
                                  {Pid::kUnicastLocator, 24},
                                  {Pid::kDurabilityService, 28},
                                  {Pid::kStatusInfo, 4},
                                  {Pid::kPresentation, 8},
                                  {Pid::kParticipantSecurity, 8},
                                  {Pid::kPersistenceGuid, 16}}) {
    Octets value;
    value.bytes.resize(static_cast<std::size_t>(size));
    EXPECT_EQ(of(pid, value), Fault::kNone) << static_cast<int>(pid);
    value.bytes.resize(static_cast<std::size_t>(size) + 4);
    EXPECT_EQ(of(pid, value), Fault::kParameter) << static_cast<int>(pid);
    value.bytes.resize(static_cast<std::size_t>(size) - 4);
    EXPECT_EQ(of(pid, value), Fault::kParameter) << static_cast<int>(pid);
  }
}

TEST(ParameterList, RefusesStringsWithoutEnd) {
  EXPECT_EQ(of(Pid::kTopicName, Octets().text("percept")), Fault::kNone);
  EXPECT_EQ(of(Pid::kTopicName, Octets().u32(4).u8({'a', 'b', 'c', 'd'})), Fault::kParameter);
  EXPECT_EQ(of(Pid::kTopicName, Octets().u32(5).u8({'a', 'b', 'c', 0})), Fault::kParameter);
  EXPECT_EQ(of(Pid::kTopicName, Octets().u32(0xffffffff).u8({'a', 'b', 'c', 0})), Fault::kParameter);
  EXPECT_EQ(of(Pid::kTopicName, Octets().u32(0)), Fault::kParameter);
}

TEST(ParameterList, RefusesCountsBeyondTheParameter) {
  EXPECT_EQ(of(Pid::kPartition, Octets().u32(1).text("hall")), Fault::kNone);
  EXPECT_EQ(of(Pid::kPartition, Octets().u32(2).text("hall")), Fault::kParameter);
  EXPECT_EQ(of(Pid::kPartition, Octets().u32(0xffffffff).text("hall")), Fault::kParameter);
  EXPECT_EQ(of(Pid::kPropertyList, Octets().u32(1).text("name").text("value")), Fault::kNone);
  EXPECT_EQ(of(Pid::kPropertyList, Octets().u32(1).text("name")), Fault::kParameter);
  EXPECT_EQ(of(Pid::kUserData, Octets().u32(4).u32(0)), Fault::kNone);
  EXPECT_EQ(of(Pid::kUserData, Octets().u32(5).u32(0)), Fault::kParameter);
  EXPECT_EQ(of(Pid::kDataRepresentation, Octets().u32(2).u16(0).u16(2)), Fault::kNone);
  EXPECT_EQ(of(Pid::kDataRepresentation, Octets().u32(3).u16(0).u16(2)), Fault::kParameter);
  EXPECT_EQ(of(Pid::kDataSharing, Octets().u32(1).u32(0).u32(0)), Fault::kNone);
  EXPECT_EQ(of(Pid::kDataSharing, Octets().u32(0x20000001).u32(0).u32(0)), Fault::kParameter);
}

TEST(ParameterList, ChecksTokens) {
  Octets token = Octets().text("DDS:Auth:PKI-DH:1.0").u32(1).text("dds.cert.sn").text("CN=slave").u32(1);
  token.text("hash").u32(3).u8({1, 2, 3}).align();
  EXPECT_EQ(of(Pid::kIdentityToken, token), Fault::kNone);
  for (std::size_t size = 0; size + 4 < token.bytes.size(); size += 4) {
    Octets cut;
    cut.raw(std::span(token.bytes).first(size));
    EXPECT_EQ(of(Pid::kIdentityToken, cut), Fault::kParameter) << size;
  }
}

TEST(ParameterList, ChecksContentFilters) {
  Octets filter;
  for (const char* text : {"filtered", "topic", "DDSSQL", "x > %0"}) filter.text(text);
  EXPECT_EQ(of(Pid::kContentFilter, Octets().raw(filter.bytes).u32(1).text("5")), Fault::kNone);
  EXPECT_EQ(of(Pid::kContentFilter, Octets().raw(filter.bytes).u32(2).text("5")), Fault::kParameter);
}

// Tries dds_spy: a participant that announces a type object
TEST(ParameterList, HidesTypeDescriptionsFromFastDds) {
  for (const Pid pid : {Pid::kTypeIdV1, Pid::kTypeObjectV1, Pid::kTypeInformation}) {
    const Checked checked = check(Octets().parameter(pid, Octets().u32(0xdeadbeef)).sentinel());
    EXPECT_EQ(checked.fault, Fault::kNone);
    EXPECT_EQ(checked.after, Octets().parameter(Pid::kPad, Octets().u32(0xdeadbeef)).sentinel().bytes);
  }
}

TEST(ParameterList, KeepsTheDescriptionThatIsAskedForAlone) {
  const Octets information = Octets().parameter(Pid::kTypeInformation, Octets().u32(0xdeadbeef)).sentinel();
  EXPECT_EQ(check(information, kVendorFastDds, ListPlace::kDescribedDiscovery).after, information.bytes);
  const Octets object = Octets().parameter(Pid::kTypeObjectV1, Octets().u32(0xdeadbeef)).sentinel();
  EXPECT_EQ(check(object, kVendorFastDds, ListPlace::kDescribedDiscovery).after,
            Octets().parameter(Pid::kPad, Octets().u32(0xdeadbeef)).sentinel().bytes);
}

TEST(ParameterList, HidesOtherVendorsNumbersThatMeanSomethingElseToFastDds) {
  const Octets list = Octets().parameter(Pid::kPersistenceGuid, Octets().u32(1)).sentinel();
  const Checked checked = check(list, 0x0110);
  EXPECT_EQ(checked.fault, Fault::kNone);
  EXPECT_EQ(checked.after, Octets().parameter(Pid::kPad, Octets().u32(1)).sentinel().bytes);
}

TEST(ParameterList, TellsWhereAnnouncementsAreTaken) {
  EXPECT_EQ(check(test::participant_list().sentinel()).facts.listens, (Source{0x7f000001, 7410}));
  const auto with = [](const Octets& locator) {
    return check(Octets().parameter(Pid::kMetatrafficUnicastLocator, locator).sentinel()).facts.listens;
  };
  const auto of_kind = [](std::uint32_t kind, std::uint32_t port) {
    return Octets().u32(kind).u32(port).u32(0).u32(0).u32(0).entity(0x0a1e0102);
  };
  EXPECT_EQ(with(of_kind(1, 7412)), (Source{0x0a1e0102, 7412}));
  EXPECT_EQ(with(of_kind(2, 7412)).port, 0) << "UDP over IPv6";
  EXPECT_EQ(with(of_kind(1, 65536 + 7412)).port, 0) << "no port";
}

TEST(ParameterList, ShortensLeasesThatAreTooLong) {
  for (const std::uint32_t seconds : {kMaxLease_s + 1, 0x7fffffffu, 0xffffffffu}) {
    const Checked checked = check(test::participant_list(test::kPeer, seconds).sentinel());
    EXPECT_DOUBLE_EQ(checked.facts.lease_s, kMaxLease_s);
    EXPECT_EQ(checked.after, test::participant_list(test::kPeer, kMaxLease_s).sentinel().bytes);
  }
}

TEST(ParameterList, ChangesNothingInInlineQos) {
  const Octets list = Octets().parameter(Pid::kTypeObjectV1, Octets().u32(1)).sentinel();
  const Checked checked = check(list, 0x0110, ListPlace::kInlineQos);
  EXPECT_EQ(checked.fault, Fault::kNone);
  EXPECT_EQ(checked.after, list.bytes);
}

}  // namespace
}  // namespace phantom::wire
