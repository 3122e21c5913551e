#include "components/simulated_drive/simulated_drive.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::simulated_drive {
namespace {

constexpr double kMaxMadeUp_s = 0.05;  // a process that was suspended does not make up for the time

HomingSwitches switches_of(const DriveOptions& options) {
  HomingSwitches switches = options.switches;
  switches.turn = options.motor.counts_per_turn;
  return switches;
}

}  // namespace

SimulatedDrive::SimulatedDrive(const DriveOptions& options, std::unique_ptr<can::CanBus> bus)
    : options_(options),
      bus_(std::move(bus)),
      sdo_(od_, [this](auto index, auto sub, const auto& bytes) { return write_object(index, sub, bytes); }),
      loops_(options.motor),
      homing_(switches_of(options)) {
  forget_position();
  misbehaviour.ignore_max_speed = !options.keeps_max_speed;
  build_communication_objects();
  build_profile_objects();
}

void SimulatedDrive::send(std::uint32_t cob, const std::vector<std::uint8_t>& bytes) {
  can::CanFrame frame;
  frame.id = cob;
  frame.length = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  bus_->send(frame);
}

void SimulatedDrive::boot() {
  nmt_ = Nmt::kPreOperational;
  sdo_.forget();
  for (auto& latch : latched_) latch.clear();
  rpdo_ns_ = {};
  master_heartbeat_ns_ = -1;
  build_communication_objects();
  listen_to_own();
  booted_ = true;
  heartbeat_ns_ = now_ns_;
  send(0x700U + static_cast<std::uint32_t>(options_.node), {0});
}

void SimulatedDrive::power_cycle() {
  state_ = Power::kSwitchOnDisabled;
  last_controlword_ = 0;
  forget_position();
  build_profile_objects();
  boot();
}

void SimulatedDrive::warn(std::uint16_t code, std::uint8_t error_register) {
  std::vector<std::uint8_t> bytes(8);
  bytes[0] = static_cast<std::uint8_t>(code);
  bytes[1] = static_cast<std::uint8_t>(code >> 8);
  bytes[2] = code != 0 ? error_register : 0;
  if (nmt_ != Nmt::kStopped) send(0x80U + static_cast<std::uint32_t>(options_.node), bytes);
}

void SimulatedDrive::trip(std::uint16_t code) {
  if (state_ == Power::kFault || state_ == Power::kFaultReaction) return;
  const bool moving = state_ == Power::kEnabled || state_ == Power::kQuickStop;
  demand_speed_ = motor().counts_per_s();
  demand_counts_ = static_cast<double>(counts());  // brakes from here, whatever the mode was
  // Fault reaction option code 2 brakes on the quick-stop ramp first; others switch power off at once.
  state_ = moving && od_.value(0x605E) == 2 ? Power::kFaultReaction : Power::kFault;
  od_.set(0x603F, 0, code);
  od_.set(0x1001, 0, 1);
  warn(code);
}

// ---- the bus

void SimulatedDrive::take(const can::CanFrame& frame) {
  if (frame.extended || frame.remote) return;
  const auto node = static_cast<std::uint32_t>(options_.node);
  if (frame.id == 0 && frame.length == 2 && (frame.data[1] == 0 || frame.data[1] == node))
    return take_nmt(frame.data[0]);
  const std::int64_t consumer = od_.value(0x1016, 1);
  if (frame.id == 0x700U + (consumer >> 16 & 0x7F) && frame.length == 1) {
    master_heartbeat_ns_ = now_ns_;
    return;
  }
  if (nmt_ == Nmt::kStopped) return;
  if (frame.id == 0x600U + node && frame.length == 8 && !misbehaviour.mute_sdo) {
    if (const auto reply = sdo_.answer(frame.data)) send(0x580U + node, {reply->begin(), reply->end()});
    return;
  }
  if (nmt_ != Nmt::kOperational) return;
  if (frame.id == od_.value(0x1005)) return on_sync();
  for (std::uint16_t i = 0; i < 4; ++i) {
    const Pdo rpdo = pdo(static_cast<std::uint16_t>(0x1400 + i));
    if (!rpdo.on || frame.id != rpdo.cob) continue;
    std::size_t due = 0;
    for (const std::uint32_t object : rpdo.mapping) due += (object & 0xFF) / 8;
    if (frame.length < due) {
      warn(0x8210);  // PDO not processed due to length error
      continue;
    }
    rpdo_ns_[i] = now_ns_;
    latched_[i].assign(frame.data.begin(), frame.data.begin() + static_cast<long>(due));
    if (rpdo.transmission > 240) take_rpdo(rpdo, frame);
  }
}

void SimulatedDrive::take_nmt(std::uint8_t command) {
  switch (command) {
    case 0x01:
      nmt_ = Nmt::kOperational;
      syncs_ = {};
      return;
    case 0x02:
      leave_operational();
      nmt_ = Nmt::kStopped;
      return;
    case 0x80:
      leave_operational();
      nmt_ = Nmt::kPreOperational;
      return;
    case 0x81:
      return power_cycle();
    case 0x82:
      leave_operational();
      return boot();
    default:
      return;
  }
}

void SimulatedDrive::leave_operational() {
  if (nmt_ == Nmt::kOperational) abort_connection();
}

// Applies the abort connection option code, because nobody commands the drive any more.
void SimulatedDrive::abort_connection() {
  for (auto& latch : latched_) latch.clear();
  rpdo_ns_ = {};
  const std::int64_t option = od_.value(0x6007);
  if (option == 1) trip(0x8130);
  if (state_ != Power::kEnabled) return;
  if (option == 2) state_ = Power::kSwitchOnDisabled;
  if (option == 3) leave_enabled(od_.value(0x605A));
}

void SimulatedDrive::take_rpdo(const Pdo& rpdo, const can::CanFrame& frame) {
  std::size_t at = 0;
  for (const std::uint32_t object : rpdo.mapping) {
    const std::size_t size = (object & 0xFF) / 8;
    const std::vector<std::uint8_t> bytes(frame.data.begin() + static_cast<long>(at),
                                          frame.data.begin() + static_cast<long>(at + size));
    at += size;
    static_cast<void>(write_object(static_cast<std::uint16_t>(object >> 16),
                                   static_cast<std::uint8_t>(object >> 8), bytes));
  }
}

void SimulatedDrive::on_sync() {
  for (std::uint16_t i = 0; i < 4; ++i) {
    if (latched_[i].empty()) continue;
    can::CanFrame frame;
    std::copy(latched_[i].begin(), latched_[i].end(), frame.data.begin());
    latched_[i].clear();
    take_rpdo(pdo(static_cast<std::uint16_t>(0x1400 + i)), frame);
  }
  begin_interpolation();
  od_.set(0x6041, 0, statusword());
  report_motion();
  // Drives filter their current: the loops' ripple within a cycle, which keeps step with the SYNC, is not in
  // it.
  if (torque_sum_s_ > 0.0 && !misbehaviour.frozen_feedback)
    od_.set(0x6077, 0, std::llround(torque_sum_mille_s_ / torque_sum_s_));
  torque_sum_mille_s_ = torque_sum_s_ = 0.0;
  od_.set(0x6061, 0, displayed_mode());
  od_.set(0x60FD, 0, (switch_held_ ? options_.enabling_inputs : 0U) | misbehaviour.stuck_inputs);
  for (std::uint16_t i = 0; i < 4; ++i) {
    const Pdo tpdo = pdo(static_cast<std::uint16_t>(0x1800 + i));
    if (!tpdo.on || tpdo.transmission == 0 || tpdo.transmission > 240) continue;
    if (++syncs_[i] < tpdo.transmission) continue;
    syncs_[i] = 0;
    const bool muted = misbehaviour.mute_pdos || (i == 1 && misbehaviour.mute_measurement) ||
                       (i == 2 && misbehaviour.mute_inputs);
    if (!muted) send_tpdo(static_cast<std::uint16_t>(0x1800 + i));
  }
}

bool SimulatedDrive::lies() const {
  const Misbehaviour& m = misbehaviour;
  return m.stuck_encoder || m.mirrored_encoder || m.negated_velocity || m.count_jump != 0 ||
         m.garbage_speed_rad_s > 0.0;
}

// What the encoder says, lies included; the drive's own loops have the truth.
void SimulatedDrive::report_motion() {
  if (misbehaviour.frozen_feedback) return;
  const bool lies = misbehaviour.stuck_encoder || misbehaviour.mirrored_encoder;
  if (!lies) lie_began_counts_.reset();
  if (lies && !lie_began_counts_) lie_began_counts_ = counts();
  const std::int64_t began = lie_began_counts_.value_or(0);
  std::int64_t position = counts();
  double velocity = motor().counts_per_s();
  if (misbehaviour.stuck_encoder) {
    position = began;
    velocity = 0.0;
  }
  if (misbehaviour.mirrored_encoder) {
    position = 2 * began - position;
    velocity = -velocity;
  }
  if (misbehaviour.negated_velocity) velocity = -velocity;
  if (misbehaviour.garbage_speed_rad_s > 0.0) {
    garbage_ = garbage_ * 1664525U + 1013904223U;
    const double share = static_cast<double>(garbage_) / 2147483648.0 - 1.0;
    velocity = share * misbehaviour.garbage_speed_rad_s * motor().parameters().counts_per_rad();
  }
  od_.set(0x6064, 0,
          static_cast<std::int32_t>(static_cast<std::uint32_t>(position + misbehaviour.count_jump)));
  od_.set(0x606C, 0, std::llround(velocity));
}

void SimulatedDrive::send_tpdo(std::uint16_t communication) {
  const Pdo tpdo = pdo(communication);
  std::vector<std::uint8_t> bytes;
  for (const std::uint32_t object : tpdo.mapping) {
    const auto* source =
        od_.find(static_cast<std::uint16_t>(object >> 16), static_cast<std::uint8_t>(object >> 8));
    bytes.insert(bytes.end(), source->bytes.begin(), source->bytes.end());
  }
  const std::size_t cut = std::min<std::size_t>(bytes.size(), misbehaviour.cut_pdo_bytes);
  bytes.erase(bytes.end() - static_cast<std::ptrdiff_t>(cut), bytes.end());
  while (bytes.size() < misbehaviour.pad_pdo_bytes) bytes.push_back(0);
  send(tpdo.cob, bytes);
}

// ---- the power state machine (CiA 402)

std::int64_t SimulatedDrive::displayed_mode() const {
  if (misbehaviour.shown_mode != 0) return misbehaviour.shown_mode;
  if (misbehaviour.hides_mode_unpowered && state_ != Power::kEnabled) return 0;
  if (core::seconds(now_ns_ - mode_written_ns_) < misbehaviour.mode_late_s) return -1;
  return od_.value(0x6060);
}

std::uint16_t SimulatedDrive::statusword() const {
  constexpr std::uint16_t kRemoteAndVoltage = 0x0210, kFollows = 0x1000, kTargetReached = 0x0400;
  const bool homes = od_.value(0x6060) == 6;
  constexpr std::array<std::uint16_t, 7> kOfState{0x40, 0x21, 0x23, kFollows | 0x27, 0x07, 0x0F, 0x08};
  unsigned word =
      kRemoteAndVoltage | kOfState.at(static_cast<std::size_t>(state_)) | misbehaviour.other_status_bits;
  if (homes) {  // here bits 12, 10 and 13 say: home is known, at rest, no home was found
    word &= ~unsigned{kFollows};
    word |= homed_ ? kFollows : 0U;
    word |= homing_.runs() ? 0U : kTargetReached;
    word |= homing_.state() == Homing::State::kError ? 0x2000U : 0U;
  }
  if (following_error_ && od_.value(0x6060) == 8) word |= 0x2000;
  if (limited_ && state_ == Power::kEnabled && od_.value(0x6060) != 10)
    word |= 0x0800;  // internal limit active
  return static_cast<std::uint16_t>(word);
}

// Makes one transition per controlword, as in the figure of the state machine.
void SimulatedDrive::obey_controlword() {
  const auto word = static_cast<std::uint16_t>(od_.value(0x6040));
  const bool reset_edge = (word & 0x80) != 0 && (last_controlword_ & 0x80) == 0;
  last_controlword_ = word;
  const bool starts =
      (word & 0x10) != 0 && !start_bit_ && state_ == Power::kEnabled && od_.value(0x6060) == 6;
  start_bit_ = (word & 0x10) != 0;
  if (starts) {
    homed_ = false;
    homing_.start(od_.value(0x6098),
                  {static_cast<double>(od_.value(0x6099, 1)), static_cast<double>(od_.value(0x6099, 2)),
                   static_cast<double>(od_.value(0x609A))},
                  static_cast<double>(motor().counts()));
  }
  if (state_ == Power::kFault) {
    if (!reset_edge || misbehaviour.refuse_reset) return;
    state_ = Power::kSwitchOnDisabled;
    od_.set(0x603F, 0, 0);
    od_.set(0x1001, 0, 0);
    warn(0);
    return;
  }
  if (state_ == Power::kFaultReaction) return;
  if ((word & 0x02) == 0) {  // disable voltage
    state_ = Power::kSwitchOnDisabled;
    return;
  }
  if ((word & 0x04) == 0) {  // quick stop
    if (state_ == Power::kEnabled) leave_enabled(od_.value(0x605A));
    if (state_ != Power::kQuickStop) state_ = Power::kSwitchOnDisabled;
    return;
  }
  const int command = word & 0x0F;
  if (command == 0x06 && state_ != Power::kQuickStop) state_ = Power::kReady;
  if (command == 0x07 && (state_ == Power::kReady || state_ == Power::kEnabled)) state_ = Power::kSwitchedOn;
  // Out of a quick stop only if that ends in holding (0x605A from 5 on).
  const bool resumes = state_ == Power::kQuickStop && od_.value(0x605A) >= 5;
  if (command == 0x0F && (state_ == Power::kSwitchedOn || resumes) && !misbehaviour.refuse_enable) {
    state_ = Power::kEnabled;
    demand_counts_ = static_cast<double>(counts());
    demand_speed_ = 0.0;
    off_track_ns_ = -1;
  }
}

// Leaves enabled for quick stop. `option` is the value of object 0x605A, of which 0 (power off), 2 (ramp,
// then off) and 6 (ramp, then hold) are supported.
void SimulatedDrive::leave_enabled(std::int64_t option) {
  demand_speed_ = motor().counts_per_s();
  demand_counts_ = static_cast<double>(counts());
  state_ = option == 0 ? Power::kSwitchOnDisabled : Power::kQuickStop;
}

void SimulatedDrive::watch() {
  const std::int64_t consumer = od_.value(0x1016, 1);
  const core::Nanoseconds longest_ns = (consumer & 0xFFFF) * core::kNsPerMillisecond;
  if (longest_ns > 0 && master_heartbeat_ns_ >= 0 && now_ns_ - master_heartbeat_ns_ > longest_ns) {
    master_heartbeat_ns_ = -1;
    warn(0x8130);
    leave_operational();
    if (nmt_ == Nmt::kOperational) nmt_ = Nmt::kPreOperational;
  }
  for (std::uint16_t i = 0; i < 4; ++i) {  // the event timers of RPDOs: deadline monitoring of CiA 301
    const std::int64_t most_ns =
        od_.value(static_cast<std::uint16_t>(0x1400 + i), 5) * core::kNsPerMillisecond;
    if (most_ns == 0 || rpdo_ns_[i] == 0 || now_ns_ - rpdo_ns_[i] <= most_ns) continue;
    warn(0x8250);
    abort_connection();
    od_.set(0x6040, 0, 0x02);  // quick stop; the old word would enable again what has just stopped
  }
  const std::int64_t producer_ns = od_.value(0x1017) * core::kNsPerMillisecond;
  if (producer_ns > 0 && now_ns_ - heartbeat_ns_ >= producer_ns) {
    const bool far_behind = now_ns_ - heartbeat_ns_ > 2 * producer_ns;
    heartbeat_ns_ = far_behind ? now_ns_ : heartbeat_ns_ + producer_ns;
    const std::uint8_t state = nmt_ == Nmt::kOperational ? 5 : nmt_ == Nmt::kStopped ? 4 : 127;
    if (!misbehaviour.mute_heartbeat) send(0x700U + static_cast<std::uint32_t>(options_.node), {state});
  }
}

void SimulatedDrive::step(core::Nanoseconds now_ns) {
  now_ns_ = now_ns;
  if (!booted_) {
    moved_ns_ = now_ns;
    boot();
  }
  double behind_s = std::min(core::seconds(now_ns - moved_ns_), kMaxMadeUp_s);
  for (; behind_s >= kSubStep_s; behind_s -= kSubStep_s) move(kSubStep_s);
  moved_ns_ = now_ns - core::from_seconds(behind_s);
  can::Received received;
  while (bus_->receive(received)) {
    if (received.is_frame()) take(received.frame);
    if (received.errors & can::kErrorBusOff) {
      leave_operational();
      static_cast<void>(bus_->restart());
    }
  }
  watch();
}

}  // namespace phantom::simulated_drive
