#include "common/wire/parameter_list.hpp"

#include <algorithm>

#include "common/wire/octets.hpp"

namespace phantom::wire {
namespace {

enum class Form : std::uint8_t {
  kAny,            // not read by Fast DDS, or opaque
  kExact,          // as many octets as `size`
  kAtLeast,        // at least as many
  kString,         // a string
  kStrings,        // a counted list of strings
  kOctets,         // a counted list of octets
  kShorts,         // a counted list of 16 bit numbers
  kProperties,     // a counted list of pairs of strings
  kToken,          // a DataHolder
  kFilter,         // four strings and a counted list of strings
  kType,           // a description of a type: hidden
  kVendor,         // Fast DDS's own of `size` octets: hidden if from others
  kVendorAtLeast,  // likewise, of at least `size` octets
  kDomains,        // Fast DDS's own, a counted list of 64 bit numbers: hidden if from others
};

struct Rule {
  Form form = Form::kAny;
  std::uint16_t size = 0;
};

Rule rule_of(Pid pid) {
  switch (pid) {
    case Pid::kOwnershipStrength:
    case Pid::kDomainId:
    case Pid::kProtocolVersion:
    case Pid::kVendorId:
    case Pid::kDurability:
    case Pid::kOwnership:
    case Pid::kDestinationOrder:
    case Pid::kManualLivelinessCount:
    case Pid::kExpectsInlineQos:
    case Pid::kTransportPriority:
    case Pid::kGroupEntityId:
    case Pid::kBuiltinEndpointSet:
    case Pid::kTypeMaxSize:
    case Pid::kStatusInfo:
    case Pid::kBuiltinEndpointQos:
      return {Form::kExact, 4};
    case Pid::kLeaseDuration:
    case Pid::kTimeBasedFilter:
    case Pid::kPresentation:
    case Pid::kDeadline:
    case Pid::kLatencyBudget:
    case Pid::kLifespan:
    case Pid::kHistory:
    case Pid::kEndpointSecurity:
    case Pid::kParticipantSecurity:
      return {Form::kExact, 8};
    case Pid::kReliability:
    case Pid::kLiveliness:
    case Pid::kResourceLimits:
      return {Form::kExact, 12};
    case Pid::kParticipantGuid:
    case Pid::kGroupGuid:
    case Pid::kEndpointGuid:
    case Pid::kKeyHash:
      return {Form::kExact, 16};
    case Pid::kUnicastLocator:
    case Pid::kMulticastLocator:
    case Pid::kDefaultUnicastLocator:
    case Pid::kMetatrafficUnicastLocator:
    case Pid::kMetatrafficMulticastLocator:
    case Pid::kDefaultMulticastLocator:
      return {Form::kExact, 24};
    case Pid::kDurabilityService:
      return {Form::kExact, 28};
    case Pid::kTypeConsistency:
      return {Form::kAtLeast, 4};
    case Pid::kTopicName:
    case Pid::kTypeName:
    case Pid::kEntityName:
    case Pid::kDomainTag:
      return {Form::kString};
    case Pid::kPartition:
      return {Form::kStrings};
    case Pid::kUserData:
    case Pid::kGroupData:
    case Pid::kTopicData:
      return {Form::kOctets};
    case Pid::kDataRepresentation:
      return {Form::kShorts};
    case Pid::kPropertyList:
      return {Form::kProperties};
    case Pid::kIdentityToken:
    case Pid::kPermissionsToken:
    case Pid::kIdentityStatusToken:
      return {Form::kToken};
    case Pid::kContentFilter:
      return {Form::kFilter};
    case Pid::kTypeIdV1:
    case Pid::kTypeObjectV1:
    case Pid::kTypeInformation:
      return {Form::kType};
    case Pid::kRelatedSampleStandard:
      return {Form::kAtLeast, 24};
    case Pid::kRelatedSample:
      return {Form::kVendorAtLeast, 24};
    case Pid::kPersistenceGuid:
      return {Form::kVendor, 16};
    case Pid::kDisablePositiveAcks:
      return {Form::kVendor, 4};
    case Pid::kDataSharing:
      return {Form::kDomains};
    case Pid::kPad:
    case Pid::kSentinel:
      return {};
  }
  return {};
}

bool aligned_string(OctetReader& value) { return value.align(4) && value.string(); }

bool strings(OctetReader& value) {
  const std::uint32_t count = value.u32();
  if (count > value.left() / 4) return false;  // each takes four octets at least
  for (std::uint32_t i = 0; i < count; ++i)
    if (!aligned_string(value)) return false;
  return value.good();
}

bool properties(OctetReader& value) {
  if (!value.align(4)) return false;
  const std::uint32_t count = value.u32();
  if (count > value.left() / 8) return false;
  for (std::uint32_t i = 0; i < count; ++i)
    if (!aligned_string(value) || !aligned_string(value)) return false;
  return value.good();
}

bool binary_properties(OctetReader& value) {
  if (!value.align(4)) return false;
  const std::uint32_t count = value.u32();
  if (count > value.left() / 8) return false;
  for (std::uint32_t i = 0; i < count; ++i)
    if (!aligned_string(value) || !value.align(4) || !value.skip(value.u32())) return false;
  return value.good();
}

bool filter(OctetReader& value) {
  for (int i = 0; i < 4; ++i)
    if (!aligned_string(value)) return false;
  return value.align(4) && strings(value);
}

bool fits(const Rule& rule, std::span<const std::uint8_t> octets, bool little_endian) {
  OctetReader value(octets, little_endian);
  switch (rule.form) {
    case Form::kAny:
    case Form::kType:
      return true;
    case Form::kExact:
      return octets.size() == rule.size;
    case Form::kAtLeast:
    case Form::kVendorAtLeast:
      return octets.size() >= rule.size;
    case Form::kVendor:
      return octets.size() == rule.size;
    case Form::kDomains:
      return value.u32() == value.left() / 8 && value.good() && value.left() % 8 == 0;
    case Form::kString:
      return value.string();
    case Form::kStrings:
      return strings(value);
    case Form::kOctets:
      return value.skip(value.u32());
    case Form::kShorts: {
      const std::uint32_t count = value.u32();
      return value.good() && count <= value.left() / 2;
    }
    case Form::kProperties:
      return properties(value);
    case Form::kToken:
      return check_data_holder(value);
    case Form::kFilter:
      return filter(value);
  }
  return false;
}

/// Fast DDS has numbers of its own, which mean something else with another vendor: 0x800f is a domain's
/// number with RTI, in each announcement.
bool of_fast_dds(Form form) {
  return form == Form::kVendor || form == Form::kVendorAtLeast || form == Form::kDomains;
}

Guid guid_of(std::span<const std::uint8_t> octets) {
  Guid guid;
  std::copy_n(octets.begin(), guid.prefix.size(), guid.prefix.begin());
  for (const std::uint8_t octet : octets.subspan(guid.prefix.size(), 4))
    guid.entity = guid.entity << 8 | octet;
  return guid;
}

void write_u32(std::span<std::uint8_t> at, std::uint32_t value, bool little_endian) {
  for (std::size_t i = 0; i < 4; ++i)
    at[little_endian ? i : 3 - i] = static_cast<std::uint8_t>(value >> (8 * i));
}

void note(Pid pid, std::span<std::uint8_t> value, bool little_endian, bool discovery, ListFacts& facts) {
  switch (pid) {
    case Pid::kParticipantGuid:
      facts.participant = guid_of(value);
      return;
    case Pid::kEndpointGuid:
      facts.endpoint = guid_of(value);
      return;
    case Pid::kKeyHash:
      facts.key = guid_of(value);
      return;
    case Pid::kStatusInfo:
      facts.status = OctetReader(value, false).u32();  // big-endian always (9.6.4.9)
      return;
    case Pid::kLeaseDuration: {
      OctetReader lease(value, little_endian);
      const std::uint32_t seconds = lease.u32();
      if (discovery && seconds > kMaxLease_s) {  // infinity, and what is negative, too
        write_lease(value, kMaxLease_s, little_endian);
        facts.lease_s = kMaxLease_s;
      } else {
        facts.lease_s = seconds + lease.u32() / 4294967296.0;
      }
      if (discovery) facts.lease = value;
      return;
    }
    case Pid::kMetatrafficUnicastLocator: {
      constexpr std::uint32_t kUdpV4 = 1;  // DDSI-RTPS 2.5, 9.3.2.3
      OctetReader locator(value, little_endian);
      const std::uint32_t kind = locator.u32(), port = locator.u32();
      locator.skip(12);
      const std::uint32_t address = OctetReader(value.subspan(20), false).u32();
      if (kind == kUdpV4 && port <= 0xffff && facts.listens.port == 0)
        facts.listens = {address, static_cast<std::uint16_t>(port)};
      return;
    }
    default:
      return;
  }
}

}  // namespace

bool check_data_holder(OctetReader& reader) {
  return aligned_string(reader) && properties(reader) && binary_properties(reader);
}

Fault check_parameter_list(std::span<std::uint8_t> list, bool little_endian, ListPlace place,
                           std::uint16_t vendor, ListFacts& facts, std::size_t& length) {
  const bool discovery = place != ListPlace::kInlineQos;
  OctetReader reader(list, little_endian);
  for (;;) {
    const std::size_t at = reader.position();
    const auto pid = static_cast<Pid>(reader.u16());
    const std::size_t size = reader.u16();
    if (!reader.good()) return Fault::kParameterList;  // no sentinel
    if (pid == Pid::kSentinel) break;
    if (size % 4 != 0 || !reader.skip(size)) return Fault::kParameterList;
    const Rule rule = rule_of(pid);
    const std::span<std::uint8_t> value = list.subspan(at + 4, size);
    if (pid == Pid::kTypeInformation && place == ListPlace::kDescribedDiscovery) continue;
    if (rule.form == Form::kType || (of_fast_dds(rule.form) && vendor != kVendorFastDds)) {
      // PID_PAD, in either order. Of inline QoS Fast DDS reads this one, whoever sends it.
      if (discovery || pid == Pid::kRelatedSample) list[at] = list[at + 1] = 0;
      continue;
    }
    if (!fits(rule, value, little_endian)) return Fault::kParameter;
    note(pid, value, little_endian, discovery, facts);
  }
  length = reader.position();
  return Fault::kNone;
}

void write_lease(std::span<std::uint8_t> value, std::uint32_t seconds, bool little_endian) {
  write_u32(value, seconds, little_endian);
  write_u32(value.subspan(4), 0, little_endian);
}

}  // namespace phantom::wire
