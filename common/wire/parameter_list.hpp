#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "common/wire/fault.hpp"
#include "common/wire/rtps.hpp"

namespace phantom::wire {

/// What a list of parameters says about who it is of.
struct ListFacts {
  std::optional<Guid> participant;  ///< PID_PARTICIPANT_GUID
  std::optional<Guid> endpoint;     ///< PID_ENDPOINT_GUID
  std::optional<Guid> key;          ///< PID_KEY_HASH
  std::uint32_t status = 0;         ///< PID_STATUS_INFO: bit 0 disposed, bit 1 unregistered
  double lease_s = 100.0;           ///< PID_PARTICIPANT_LEASE_DURATION; the standard's default
  std::span<std::uint8_t> lease;    ///< where that stands in discovery data; empty: nowhere
  Source listens{};                 ///< the first IPv4 PID_METATRAFFIC_UNICAST_LOCATOR
};

/// Longest lease that a participant is granted. A longer one is shortened in place: what strangers announce
/// is forgotten in bounded time. Known implementations announce themselves every 30 s or more often.
inline constexpr std::uint32_t kMaxLease_s = 120;
/// What Fast DDS reads in place of a lease that it is not to check: three years.
inline constexpr std::uint32_t kUncheckedLease_s = 100'000'000;
/// Writes a lease into the eight octets of a PID_PARTICIPANT_LEASE_DURATION. Real-time safe: yes.
void write_lease(std::span<std::uint8_t> value, std::uint32_t seconds, bool little_endian);

/// What a parameter list stands in. kDescribedDiscovery: discovery data for a participant that asks for
/// descriptions of types.
enum class ListPlace { kInlineQos, kDiscovery, kDescribedDiscovery };

/// Checks inline QoS or discovery data from the first parameter on, without encapsulation. `list` ends where
/// the submessage ends; `length` becomes the octets up to and with the sentinel.
///
/// Each parameter must fit into the list, have a length that is a multiple of 4, and, if it is known, have
/// its own size, its strings ended and its counts within it (DDSI-RTPS 2.5, 9.4.2.11, 9.6.3).
///
/// In discovery data it changes three things in place, so that Fast DDS does not read them: descriptions of
/// types (Fast DDS 2.9.1 ends with some of them; only kDescribedDiscovery keeps TypeInformation) and, from
/// other vendors, numbers that mean something else there become PID_PAD; a lease longer than kMaxLease_s
/// becomes that. In inline QoS it changes another vendor's 0x800f, which Fast DDS reads there.
///
/// Returns kNone, kParameterList or kParameter. Real-time safe: yes.
Fault check_parameter_list(std::span<std::uint8_t> list, bool little_endian, ListPlace place,
                           std::uint16_t vendor, ListFacts& facts, std::size_t& length);

/// Checks a DataHolder (DDS Security 1.1, 7.2.3): class id, properties, binary properties. Real-time safe:
/// yes.
class OctetReader;
bool check_data_holder(OctetReader& reader);

}  // namespace phantom::wire
