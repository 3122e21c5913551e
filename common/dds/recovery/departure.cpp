#include "common/dds/recovery/departure.hpp"

#include <initializer_list>

namespace phantom::dds {
namespace {

class Octets {
 public:
  Octets& add(std::initializer_list<int> octets) {
    for (const int octet : octets) bytes.push_back(static_cast<std::uint8_t>(octet));
    return *this;
  }
  Octets& add(const GuidPrefix& prefix) {
    bytes.insert(bytes.end(), prefix.begin(), prefix.end());
    return *this;
  }
  Octets& add_little_endian(std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
    return *this;
  }

  std::vector<std::uint8_t> bytes;
};

}  // namespace

std::vector<std::uint8_t> departure(const GuidPrefix& own, const GuidPrefix& peer, std::uint32_t sequence) {
  Octets message;
  message.add({'R', 'T', 'P', 'S', 2, 2, 1, 15}).add(own);  // protocol 2.2, vendor eProsima, as in Fast DDS
  message.add({0x0e, 0x01, 12, 0}).add(peer);               // INFO_DST, little endian
  message.add({0x15, 0x03, 52, 0});                         // DATA: inline QoS, no payload
  message.add({0, 0, 16, 0});             // no extra flags; the inline QoS begins 16 octets later
  message.add({0x00, 0x01, 0x00, 0xc7});  // announcements' reader and writer
  message.add({0x00, 0x01, 0x00, 0xc2});
  message.add_little_endian(0).add_little_endian(sequence);
  message.add({0x70, 0x00, 16, 0}).add(own).add({0x00, 0x00, 0x01, 0xc1});  // PID_KEY_HASH: the participant
  message.add({0x71, 0x00, 4, 0}).add({0, 0, 0, 3});  // PID_STATUS_INFO: disposed and unregistered
  message.add({0x01, 0x00, 0, 0});                    // PID_SENTINEL
  return message.bytes;
}

}  // namespace phantom::dds
