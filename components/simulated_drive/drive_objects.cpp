// The drive's object dictionary, and the effects of writing to it.
#include <cmath>

#include "components/simulated_drive/simulated_drive.hpp"

namespace phantom::simulated_drive {
namespace {

constexpr std::int64_t kOff = 0x80000000, kNoRemoteRequest = 0x40000000;

}  // namespace

// Creates the communication objects, as after NMT reset communication: the profile's objects keep their
// values.
void SimulatedDrive::build_communication_objects() {
  od_.add_from_sheet(0x1000, 0x1FFF, options_.node);
  if (!misbehaviour.keeps_remote_bit) return;
  for (std::uint16_t i = 0x1800; i < 0x1804; ++i) od_.set(i, 1, od_.value(i, 1) | kNoRemoteRequest);
}

void SimulatedDrive::build_profile_objects() {
  od_.add_from_sheet(0x2000, 0xFFFF, options_.node);
  od_.set(0x6065, 0, std::llround(options_.motor.counts_per_rad() * options_.following_window_rad));
  od_.set(0x6072, 0, std::llround(1e3 * options_.motor.peak_share));
  od_.set(0x6076, 0, std::llround(1e3 * options_.motor.rated_torque_Nm));
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
  if (misbehaviour.lacks_object == index) return kAbortNoObject;
  const bool is_tpdo_cob = index >= 0x1800 && index < 0x1804 && sub == 1 && bytes.size() == 4;
  if (misbehaviour.keeps_remote_bit && is_tpdo_cob && (bytes[3] & 0x40) == 0) return kAbortRange;
  if (index == 0x6060) mode_written_ns_ = now_ns_;
  const bool is_mapping = (index >= 0x1600 && index < 0x1604) || (index >= 0x1A00 && index < 0x1A04);
  if (is_mapping && od_.find(index, sub) != nullptr && bytes.size() == od_.find(index, sub)->bytes.size()) {
    std::uint32_t value = 0;
    for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
    if (const AbortCode code = check_mapping(index, sub, value); code != kNoAbort) return code;
  }
  if (index == 0x6098 && bytes.size() == 1 && !Homing::supports(static_cast<std::int8_t>(bytes[0])))
    return kAbortRange;
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
