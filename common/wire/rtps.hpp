#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace phantom::wire {

/// The 12 octets that all endpoints of one participant share.
using GuidPrefix = std::array<std::uint8_t, 12>;

/// Identifies an endpoint within its participant: three octets and the kind, as one big-endian number
/// (0x000100c2 is the writer of participant announcements).
using EntityId = std::uint32_t;

struct Guid {
  GuidPrefix prefix{};
  EntityId entity = 0;
  friend bool operator==(const Guid&, const Guid&) = default;
};

/// Kinds of submessages (OMG DDSI-RTPS 2.5, 9.4.5.1.1; DDS Security 1.1, 7.3.6.2).
enum class SubmessageId : std::uint8_t {
  kPad = 0x01,
  kAckNack = 0x06,
  kHeartbeat = 0x07,
  kGap = 0x08,
  kInfoTimestamp = 0x09,
  kInfoSource = 0x0c,
  kInfoReplyIp4 = 0x0d,
  kInfoDestination = 0x0e,
  kInfoReply = 0x0f,
  kNackFrag = 0x12,
  kHeartbeatFrag = 0x13,
  kData = 0x15,
  kDataFrag = 0x16,
  kSecureBody = 0x30,
  kSecurePrefix = 0x31,
  kSecurePostfix = 0x32,
  kSecureRtpsPrefix = 0x33,
  kSecureRtpsPostfix = 0x34,
};
inline constexpr auto kFirstOfVendors = static_cast<SubmessageId>(0x80);  ///< from here on, vendors' own

inline constexpr std::size_t kHeaderBytes = 20;      ///< "RTPS", version, vendor, GUID prefix
inline constexpr std::size_t kSubmessageHeader = 4;  ///< id, flags, octets to the next header
inline constexpr std::size_t kEncapsulation = 4;     ///< kind and options before a payload
inline constexpr std::uint8_t kLittleEndian = 0x01;  ///< flag of every submessage

/// Built-in endpoints (DDSI-RTPS 2.5, 9.3.1.5; DDS Security 1.1, 7.4.7). A reader's id differs from its
/// writer's in the last octet.
inline constexpr EntityId kParticipantEntity = 0x000001c1;
inline constexpr EntityId kParticipantWriter = 0x000100c2, kParticipantReader = 0x000100c7;
inline constexpr EntityId kTopicWriter = 0x000002c2, kTopicReader = 0x000002c7;
inline constexpr EntityId kPublicationWriter = 0x000003c2, kPublicationReader = 0x000003c7;
inline constexpr EntityId kSubscriptionWriter = 0x000004c2, kSubscriptionReader = 0x000004c7;
inline constexpr EntityId kLivelinessWriter = 0x000200c2, kLivelinessReader = 0x000200c7;
inline constexpr EntityId kSecurePublicationWriter = 0xff0003c2, kSecurePublicationReader = 0xff0003c7;
inline constexpr EntityId kSecureSubscriptionWriter = 0xff0004c2, kSecureSubscriptionReader = 0xff0004c7;
inline constexpr EntityId kSecureLivelinessWriter = 0xff0200c2, kSecureLivelinessReader = 0xff0200c7;
inline constexpr EntityId kSecureParticipantWriter = 0xff0101c2, kSecureParticipantReader = 0xff0101c7;
inline constexpr EntityId kStatelessWriter = 0x000201c3, kStatelessReader = 0x000201c4;
inline constexpr EntityId kVolatileWriter = 0xff0202c3, kVolatileReader = 0xff0202c4;

/// Parameters of discovery and of inline QoS that are checked (DDSI-RTPS 2.5, 9.6.3.2; DDS Security 1.1,
/// 7.4.1.6; DDS-XTypes 1.3, 7.6.3.2; from 0x8000 on: Fast DDS's own).
enum class Pid : std::uint16_t {
  kPad = 0x0000,
  kSentinel = 0x0001,
  kLeaseDuration = 0x0002,
  kTimeBasedFilter = 0x0004,
  kTopicName = 0x0005,
  kOwnershipStrength = 0x0006,
  kTypeName = 0x0007,
  kDomainId = 0x000f,
  kProtocolVersion = 0x0015,
  kVendorId = 0x0016,
  kReliability = 0x001a,
  kLiveliness = 0x001b,
  kDurability = 0x001d,
  kDurabilityService = 0x001e,
  kOwnership = 0x001f,
  kPresentation = 0x0021,
  kDeadline = 0x0023,
  kDestinationOrder = 0x0025,
  kLatencyBudget = 0x0027,
  kPartition = 0x0029,
  kLifespan = 0x002b,
  kUserData = 0x002c,
  kGroupData = 0x002d,
  kTopicData = 0x002e,
  kUnicastLocator = 0x002f,
  kMulticastLocator = 0x0030,
  kDefaultUnicastLocator = 0x0031,
  kMetatrafficUnicastLocator = 0x0032,
  kMetatrafficMulticastLocator = 0x0033,
  kManualLivelinessCount = 0x0034,
  kContentFilter = 0x0035,
  kHistory = 0x0040,
  kResourceLimits = 0x0041,
  kExpectsInlineQos = 0x0043,
  kDefaultMulticastLocator = 0x0048,
  kTransportPriority = 0x0049,
  kParticipantGuid = 0x0050,
  kGroupGuid = 0x0052,
  kGroupEntityId = 0x0053,
  kBuiltinEndpointSet = 0x0058,
  kPropertyList = 0x0059,
  kEndpointGuid = 0x005a,
  kTypeMaxSize = 0x0060,
  kEntityName = 0x0062,
  kTypeIdV1 = 0x0069,
  kKeyHash = 0x0070,
  kStatusInfo = 0x0071,
  kTypeObjectV1 = 0x0072,
  kDataRepresentation = 0x0073,
  kTypeConsistency = 0x0074,
  kTypeInformation = 0x0075,
  kBuiltinEndpointQos = 0x0077,
  kRelatedSampleStandard = 0x0083,
  kIdentityToken = 0x1001,
  kPermissionsToken = 0x1002,
  kEndpointSecurity = 0x1004,
  kParticipantSecurity = 0x1005,
  kIdentityStatusToken = 0x1006,
  kDomainTag = 0x4014,
  kPersistenceGuid = 0x8002,
  kDisablePositiveAcks = 0x8005,
  kDataSharing = 0x8006,
  kRelatedSample = 0x800f,
};

/// The vendor of Fast DDS, whose own parameters are understood.
inline constexpr std::uint16_t kVendorFastDds = 0x010f;

/// Where a datagram comes from, or where messages are taken: an IPv4 address and a port, in host byte order.
struct Source {
  std::uint32_t address = 0;
  std::uint16_t port = 0;
  friend bool operator==(const Source&, const Source&) = default;
};

}  // namespace phantom::wire
