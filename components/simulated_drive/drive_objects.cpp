// The drive's object dictionary, and the effects of writing to it.
#include <cmath>

#include "components/simulated_drive/simulated_drive.hpp"

namespace phantom::simulated_drive {
namespace {

constexpr std::int64_t kOff = 0x80000000;

}  // namespace

// Creates the communication objects, as after NMT reset communication: the profile's objects keep their
// values.
void SimulatedDrive::build_communication_objects() {
  const auto node = static_cast<std::int64_t>(options_.node);
  od_.add(0x1000, 0, 4, 0x00020192, false);  // CiA 402, servo drive
  od_.add(0x1001, 0, 1, 0, false);
  od_.add(0x1005, 0, 4, 0x80, true);
  od_.add(0x1014, 0, 4, 0x80 + node, false);
  od_.add_text(0x1008, options_.device_name, false);
  od_.add(0x1016, 0, 1, 1, false);
  od_.add(0x1016, 1, 4, 0, true);
  od_.add(0x1017, 0, 2, 0, true);
  od_.add(0x1018, 0, 1, 1, false);
  od_.add(0x1018, 1, 4, 0, false);
  for (std::uint16_t i = 0; i < 4; ++i) {
    for (const int first : {0x1400, 0x1800}) {
      const auto communication = static_cast<std::uint16_t>(first + i);
      const std::int64_t cob = (first == 0x1400 ? 0x200 : 0x180) + 0x100 * i + node;
      od_.add(communication, 0, 1, 2, false);
      od_.add(communication, 1, 4, i == 0 ? cob : cob | kOff, true);
      od_.add(communication, 2, 1, 255, true);
      const auto mapping = static_cast<std::uint16_t>(communication + 0x200);
      od_.add(mapping, 0, 1, i == 0 ? 1 : 0, true);
      for (std::uint8_t sub = 1; sub <= 8; ++sub) od_.add(mapping, sub, 4, 0, true);
      if (i == 0) od_.set(mapping, 1, first == 0x1400 ? 0x60400010 : 0x60410010);
    }
  }
}

void SimulatedDrive::build_profile_objects() {
  od_.add_text(0x2000, "", true);  // a label for the user
  od_.add(0x6007, 0, 2, 1, true, false, true);
  od_.limit(0x6007, 0, 0, 3);
  od_.add(0x603F, 0, 2, 0, false, true);
  od_.add(0x6040, 0, 2, 0, true, true);
  od_.add(0x6041, 0, 2, 0, false, true);
  od_.add(0x605A, 0, 2, 2, true, false, true);
  od_.add(0x605E, 0, 2, 2, true, false, true);
  od_.add(0x6060, 0, 1, 0, true, true, true);
  od_.add(0x6061, 0, 1, 0, false, true, true);
  od_.add(0x6064, 0, 4, 0, false, true, true);
  od_.add(0x6066, 0, 2, 10, true);
  od_.add(0x606C, 0, 4, 0, false, true, true);
  od_.add(0x6071, 0, 2, 0, true, true, true);
  od_.add(0x6072, 0, 2, std::llround(1e3 * options_.motor.peak_share), true, true);
  od_.add(0x6076, 0, 4, std::llround(1e3 * options_.motor.rated_torque_Nm), false);
  od_.add(0x6077, 0, 2, 0, false, true, true);
  od_.add(0x607A, 0, 4, 0, true, true, true);
  od_.add(0x60B2, 0, 2, 0, true, true, true);
  od_.add(0x60C2, 0, 1, 2, false);
  od_.add(0x60C2, 1, 1, 1, true);
  od_.add(0x60C2, 2, 1, -3, true, false, true);
  od_.limit(0x60C2, 2, -6, 0);
  od_.add(0x60FF, 0, 4, 0, true, true, true);
  od_.add(0x6502, 0, 4, 0x380, false);  // cyclic synchronous position, velocity, torque
}

// Filters for this drive's frames: a bus carries many times more, which the controller can reject.
void SimulatedDrive::listen_to_own() {
  const auto node = static_cast<std::uint32_t>(options_.node);
  std::vector<std::uint32_t> ids{0, static_cast<std::uint32_t>(od_.value(0x1005) & 0x7FF), 0x600U + node,
                                 0x700U + static_cast<std::uint32_t>(od_.value(0x1016, 1) >> 16 & 0x7F)};
  for (std::uint16_t i = 0; i < 4; ++i) {
    if (const Pdo rpdo = pdo(static_cast<std::uint16_t>(0x1400 + i)); rpdo.on) ids.push_back(rpdo.cob);
  }
  std::vector<can::CanFilter> filters;
  for (const std::uint32_t id : ids) filters.push_back({.id = id, .mask = 0x7FF});
  static_cast<void>(bus_->set_filters(filters));  // without filters all frames arrive and are ignored
}

SimulatedDrive::Pdo SimulatedDrive::pdo(std::uint16_t communication) const {
  Pdo pdo;
  const std::int64_t cob = od_.value(communication, 1);
  pdo.on = (cob & kOff) == 0;
  pdo.cob = static_cast<std::uint32_t>(cob & 0x7FF);
  pdo.transmission = static_cast<std::uint8_t>(od_.value(communication, 2));
  const auto mapping = static_cast<std::uint16_t>(communication + 0x200);
  const std::int64_t count = od_.value(mapping, 0);
  for (std::uint8_t sub = 1; sub <= count; ++sub)
    pdo.mapping.push_back(static_cast<std::uint32_t>(od_.value(mapping, sub)));
  return pdo;
}

// A PDO's mapping may be changed only while the PDO is off. Writing the count enables the mapping and checks
// it.
AbortCode SimulatedDrive::check_mapping(std::uint16_t index, std::uint8_t sub, std::uint32_t value) const {
  const auto communication = static_cast<std::uint16_t>(index - 0x200);
  if ((od_.value(communication, 1) & kOff) == 0) return kAbortState;
  if (sub != 0) {
    if (od_.value(index, 0) != 0) return kAbortState;
    const auto* target =
        od_.find(static_cast<std::uint16_t>(value >> 16), static_cast<std::uint8_t>(value >> 8));
    const bool fits = target != nullptr && target->mappable && target->bytes.size() * 8 == (value & 0xFF);
    return fits ? kNoAbort : kAbortNotMappable;
  }
  if (value > 8) return kAbortRange;
  std::int64_t bits = 0;
  for (std::uint8_t i = 1; i <= value; ++i) bits += od_.value(index, i) & 0xFF;
  return bits <= 64 ? kNoAbort : kAbortMappingTooLong;
}

AbortCode SimulatedDrive::write_object(std::uint16_t index, std::uint8_t sub,
                                       const std::vector<std::uint8_t>& bytes) {
  if (misbehaviour.refuse_sdo && index >= 0x1000 && index < 0x6040) return kAbortState;
  const bool is_mapping = (index >= 0x1600 && index < 0x1604) || (index >= 0x1A00 && index < 0x1A04);
  if (is_mapping && od_.find(index, sub) != nullptr && bytes.size() == od_.find(index, sub)->bytes.size()) {
    std::uint32_t value = 0;
    for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
    if (const AbortCode code = check_mapping(index, sub, value); code != kNoAbort) return code;
  }
  const AbortCode code = od_.write(index, sub, bytes);
  if (code == kNoAbort && index == 0x1017) heartbeat_ns_ = now_ns_;
  // Written by SDO, the controlword acts at once. In operational state it is read in every step.
  if (code == kNoAbort && index == 0x6040 && nmt_ == Nmt::kPreOperational) obey_controlword();
  const bool is_address =
      index == 0x1005 || index == 0x1016 || (index >= 0x1400 && index < 0x1404 && sub == 1);
  if (code == kNoAbort && is_address) listen_to_own();
  return code;
}

}  // namespace phantom::simulated_drive
