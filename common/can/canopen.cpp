#include "common/can/canopen.hpp"

namespace phantom::can {
namespace {

struct Text {
  std::uint32_t code;
  const char* text;
};

constexpr Text kAborts[] = {
    {0x05030000, "toggle bit did not alternate"},
    {0x05040000, "no answer in time"},
    {0x05040001, "unknown command"},
    {0x05040005, "out of memory"},
    {0x06010000, "access not supported"},
    {0x06010001, "object is write-only"},
    {0x06010002, "object is read-only"},
    {0x06020000, "no such object"},
    {0x06040041, "object cannot be mapped to a PDO"},
    {0x06040042, "mapped objects exceed the PDO's length"},
    {0x06040043, "parameters do not agree"},
    {0x06040047, "internal incompatibility"},
    {0x06060000, "hardware error"},
    {0x06070010, "length of the value does not fit"},
    {0x06070012, "value is too long"},
    {0x06070013, "value is too short"},
    {0x06090011, "no such sub-index"},
    {0x06090030, "value is out of range"},
    {0x06090031, "value is too great"},
    {0x06090032, "value is too small"},
    {0x08000000, "general error"},
    {0x08000020, "value cannot be stored"},
    {0x08000021, "refused by local control"},
    {0x08000022, "refused in the present state of the device"},
};

// Errors of CiA 301 and 402, the most specific first: a code belongs to the first group whose mask matches.
struct Group {
  std::uint16_t code, mask;
  const char* text;
};
constexpr Group kEmergencies[] = {
    {0x0000, 0xFFFF, "no error"},
    {0x2310, 0xFFFF, "continuous over-current"},
    {0x3210, 0xFFFF, "DC link over-voltage"},
    {0x3220, 0xFFFF, "DC link under-voltage"},
    {0x4310, 0xFFFF, "drive too hot"},
    {0x7305, 0xFFFF, "encoder fault"},
    {0x8110, 0xFFFF, "CAN overrun"},
    {0x8120, 0xFFFF, "CAN error passive"},
    {0x8130, 0xFFFF, "heartbeat of the master lost"},
    {0x8140, 0xFFFF, "recovered from bus-off"},
    {0x8210, 0xFFFF, "PDO not processed: wrong length"},
    {0x8611, 0xFFFF, "following error"},
    {0x1000, 0xFF00, "generic error"},
    {0x2000, 0xF000, "current"},
    {0x3000, 0xF000, "voltage"},
    {0x4000, 0xF000, "temperature"},
    {0x5000, 0xF000, "hardware"},
    {0x6000, 0xF000, "software"},
    {0x7000, 0xF000, "additional module"},
    {0x8250, 0xFFFF, "its targets stopped coming"},
    {0x8100, 0xFF00, "communication"},
    {0x8000, 0xF000, "monitoring"},
    {0x9000, 0xF000, "external error"},
    {0xF000, 0xF000, "additional function"},
};

}  // namespace

const char* sdo_abort_text(std::uint32_t code) noexcept {
  for (const Text& t : kAborts) {
    if (t.code == code) return t.text;
  }
  return "abort code of the manufacturer";
}

const char* emergency_text(std::uint16_t code) noexcept {
  for (const Group& g : kEmergencies) {
    if ((code & g.mask) == g.code) return g.text;
  }
  return "error of the manufacturer";
}

}  // namespace phantom::can
