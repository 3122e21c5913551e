#include "common/can/drive.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace phantom::can {
namespace {

// Detection of a node id that is used twice. Two nodes answer twice again and again; a frame that the bus
// repeated arrives twice only once. The messages of one node may arrive late and in bursts on a busy host,
// but never more than were requested and had time to be sent. So each SYNC and SDO without an answer, and the
// time without a heartbeat, count as owed: they may still arrive. The number owed is limited, because frames
// are also lost; the limit is this multiple of the silence that is a fault.
constexpr int kHeldUp = 4;
constexpr int kSurplusSyncs = 12;       // of the last 32
constexpr double kHeartbeatCost = 0.8;  // share of the heartbeat's period: a drive's clock may run fast
constexpr int kMinOwed = 64;            // answers to SYNCs: about the capacity of a drive's queue
constexpr int kSurplusSdoReplies = 3;
constexpr int kStaleSyncs = 3;  // SYNCs without an answer, after which loops on old data would wind up
constexpr int kCountedSyncs = 1 << 20;  // above any limit: a drive may be silent for months

// Faults of the drive itself are reset by the controlword. All others need a new connection.
bool is_reset_by_controlword(DriveFault fault) {
  return fault == DriveFault::kDriveFault || fault == DriveFault::kEmergency ||
         fault == DriveFault::kFollowingError || fault == DriveFault::kEnableTimeout ||
         fault == DriveFault::kLeftEnabled || fault == DriveFault::kBrakeClosed ||
         fault == DriveFault::kHomingError || fault == DriveFault::kHomingTimeout;
}

}  // namespace

Drive::Drive(const AxisConfig& axis, const DriveGroupConfig& config)
    : timing_(config.timing),
      mode_(axis.mode),
      limits_force_(axis.limits_force),
      brake_(axis.brake),
      homing_(axis.homing),
      digital_inputs_(axis.digital_inputs),
      node_(axis.node),
      stop_word_(config.reaction == FaultReaction::kHold || axis.brake ? kCommandQuickStop
                                                                       : kCommandDisableVoltage),
      moved_counts_(axis.units.counts_per_turn * axis.units.gear_ratio / 2000.0),
      full_mille_(0.9 * axis.max_torque / std::abs(axis.units.torque_per_mille())),
      setup_(setup_steps(axis, config)),
      sdo_(static_cast<std::uint8_t>(axis.node), core::from_seconds(config.timing.sdo_timeout_s)),
      controlword_(stop_word_),
      most_owed_(std::max(kMinOwed, kHeldUp * (config.timing.most_missed + 1))) {
  report_.has_reference = !homing_;
}

bool Drive::is_watched() const noexcept {
  const DrivePhase p = report_.phase;
  return p == DrivePhase::kReferencing || p == DrivePhase::kHoming || p == DrivePhase::kReady ||
         p == DrivePhase::kEnabling || p == DrivePhase::kEnabled || p == DrivePhase::kQuickStop ||
         p == DrivePhase::kResetting;
}

void Drive::enter(DrivePhase phase, core::Nanoseconds now_ns) noexcept {
  const core::Nanoseconds before_ns = phase_ns_;
  report_.phase = phase;
  phase_ns_ = now_ns;
  asked_ns_ = -1;
  if (phase == DrivePhase::kEnabling || phase == DrivePhase::kHoming) powered_ns_ = -1;
  if (phase == DrivePhase::kReferencing || phase == DrivePhase::kHoming) {
    wanted_mode_ = 0;
    homed_ = homes_ = false;
  }
  if (phase == DrivePhase::kSearching) {
    booted_ = report_.answered = false;
    searches_ = 0;
  }
  if (phase == DrivePhase::kConfiguring) {
    setup_next_ = 0;
    attempts_ = 0;
  }
  if (phase == DrivePhase::kStarting) {
    was_set_up_ = true;
    heartbeat_ns_ = -1;
    forget_surplus();
    credited_ns_ = before_ns;  // the drive may have sent heartbeats since it was given their period
    missed_ = unmeasured_ = answers_ = owed_ = 0;
    sync_open_ = measured_ = report_.has_position = false;
    report_.inputs_ns = 0;
    report_.has_reference = !homing_;
    report_.needs_homing = false;
    booted_ = false;
  }
  if (phase != DrivePhase::kFault) {
    report_.fault = DriveFault::kNone;
    pending_ = DriveFault::kNone;
  }
}

void Drive::fail(DriveFault fault, core::Nanoseconds now_ns) noexcept {
  if (report_.phase == DrivePhase::kFault) return;  // the first fault is the cause
  report_.fault = fault;
  enter(DrivePhase::kFault, now_ns);
}

void Drive::fail_implausible(const ImplausibleMotion& motion, core::Nanoseconds now_ns) noexcept {
  if (report_.phase != DrivePhase::kFault) report_.implausible = motion;
  fail(DriveFault::kImplausible, now_ns);
}

// ---- received frames

void Drive::on_frame(const CanFrame& frame, core::Nanoseconds time_ns) noexcept {
  if (frame.extended || frame.remote) return;
  switch (frame.id & ~0x7FU) {
    case kCobTpdo1:
      return on_state_pdo(frame);
    case kCobTpdo2:
      return on_measure_pdo(frame);
    case kCobTpdo3:
      return on_inputs_pdo(frame, time_ns);
    case kCobEmcy:
      return on_emergency(frame);
    case kCobHeartbeat:
      return on_heartbeat(frame, time_ns);
    case kCobSdoReply:
      sdo_.on_frame(frame, time_ns);
      if (report_.phase == DrivePhase::kConfiguring) count_sdo_reply();
      return;
    default:
      return;
  }
}

void Drive::count_sdo_reply() noexcept {
  if (owed_sdo_ > 0) {
    --owed_sdo_;
    return;
  }
  ++report_.surplus;
  if (++surplus_sdo_ >= kSurplusSdoReplies) pending_ = DriveFault::kDuplicateNode;
}

void Drive::forget_surplus() noexcept {
  surplus_syncs_ = 0;
  surplus_sdo_ = 0;
  heartbeat_credit_s_ = kHeldUp * timing_.heartbeat_timeout_s;
}

// Some drives fill every PDO up to eight bytes: the first ones are what was mapped (CiA 301).
bool Drive::holds_mapping(const CanFrame& frame, std::uint16_t mapping, std::uint8_t bytes) noexcept {
  if (frame.length >= bytes) return true;
  if (pending_ == DriveFault::kPdoLength) return false;  // the first counts
  pending_ = DriveFault::kPdoLength;
  report_.pdo_mapping = mapping;
  report_.mapped_bytes = bytes;
  report_.pdo_bytes = frame.length;
  return false;
}

void Drive::on_state_pdo(const CanFrame& frame) noexcept {
  if (report_.phase <= DrivePhase::kConfiguring) return;
  if (!holds_mapping(frame, 0x1A00, kStatePdoBytes)) return;
  if (!sync_open_) return;  // not requested: from before a restart, or false
  if (++answers_ > 1) {     // the first answer counts
    if (owed_ > 0) {        // a late one, after the next SYNC, from a busy drive and not from a second node
      --owed_;
      --answers_;
    } else {
      ++report_.surplus;
    }
    return;
  }
  const std::span<const std::uint8_t> bytes(frame.data);
  report_.statusword = static_cast<std::uint16_t>(get_le(bytes, 2));
  report_.position_counts = static_cast<std::int32_t>(get_le(bytes.subspan(2), 4));
  report_.mode = static_cast<std::int8_t>(frame.data[6]);
  report_.power = power_state(report_.statusword);
  report_.has_position = true;
}

void Drive::on_measure_pdo(const CanFrame& frame) noexcept {
  if (report_.phase <= DrivePhase::kConfiguring) return;
  if (!holds_mapping(frame, 0x1A01, kMeasurePdoBytes)) return;
  const std::span<const std::uint8_t> bytes(frame.data);
  report_.velocity_counts = static_cast<std::int32_t>(get_le(bytes, 4));
  report_.torque_mille = static_cast<std::int16_t>(get_le(bytes.subspan(4), 2));
  measured_ = true;
  unmeasured_ = 0;
}

// Whoever uses the inputs minds their age: a drive whose inputs do not come is no fault of the arm's.
void Drive::on_inputs_pdo(const CanFrame& frame, core::Nanoseconds time_ns) noexcept {
  if (report_.phase <= DrivePhase::kConfiguring || !digital_inputs_) return;
  if (!holds_mapping(frame, 0x1A02, kInputsPdoBytes)) return;
  report_.digital_inputs = get_le(frame.data, 4);
  report_.inputs_ns = time_ns;
}

void Drive::on_heartbeat(const CanFrame& frame, core::Nanoseconds time_ns) noexcept {
  if (frame.length != 1) return;
  nmt_ = static_cast<NmtState>(frame.data[0] & 0x7F);
  report_.answered = true;
  // Some drives send no boot-up message after a reset of communication, only their state.
  const bool waits = report_.phase == DrivePhase::kSearching && nmt_ == NmtState::kPreOperational;
  if (nmt_ == NmtState::kBootUp || waits) {
    booted_ = true;
    return;
  }
  heartbeat_ns_ = time_ns;
  if (report_.phase < DrivePhase::kStarting) return;  // not at the configured period yet
  const double gap_s = std::max(0.0, core::seconds(time_ns - credited_ns_));
  credited_ns_ = time_ns;
  // All heartbeats of a gap may arrive at its end, however long the gap was.
  const double most_s = std::max({gap_s, kHeldUp * timing_.heartbeat_timeout_s, heartbeat_credit_s_});
  heartbeat_credit_s_ = std::min(most_s, heartbeat_credit_s_ + gap_s) - kHeartbeatCost * timing_.heartbeat_s;
}

void Drive::on_emergency(const CanFrame& frame) noexcept {
  if (frame.length != 8) return;
  const auto code = static_cast<std::uint16_t>(get_le(frame.data, 2));
  // A device-specific code without the generic bit of the error register (CiA 301) is a warning: a drive
  // that stops shows it in its statusword.
  constexpr std::uint8_t kGenericError = 0x01;
  if (code >> 8 == 0xFF && (frame.data[2] & kGenericError) == 0) {
    report_.warning_code = code;
    return;
  }
  if (code == 0) report_.warning_code = 0;
  report_.emergency_code = code;
  if (report_.emergency_code != 0 && is_watched()) pending_ = DriveFault::kEmergency;
}

void Drive::on_sync() noexcept {
  if (sync_open_) {
    surplus_syncs_ = surplus_syncs_ << 1 | (answers_ > 1 ? 1U : 0U);
    missed_ = answers_ == 0 ? std::min(missed_ + 1, kCountedSyncs) : 0;
    unmeasured_ = std::min(unmeasured_ + 1, kCountedSyncs);
    // During start-up or a latched fault a silence has no limit, and all delayed answers may arrive later.
    const int most = is_watched() ? most_owed_ : kCountedSyncs;
    owed_ += answers_ == 0 && owed_ < most ? 1 : 0;
    report_.missed += answers_ == 0 ? 1 : 0;
  }
  sync_open_ = report_.phase >= DrivePhase::kStarting;
  answers_ = 0;
}

// ---- faults, configuration and control

DriveFault Drive::found_fault(core::Nanoseconds now_ns) const noexcept {
  if (pending_ != DriveFault::kNone) return pending_;
  if (std::popcount(surplus_syncs_) >= kSurplusSyncs || heartbeat_credit_s_ < 0.0)
    return DriveFault::kDuplicateNode;
  if (!is_watched()) return DriveFault::kNone;
  if (booted_) return DriveFault::kRebooted;
  // The drive's own fault takes precedence, because the other faults may follow from it.
  const bool in_fault = report_.power == PowerState::kFault || report_.power == PowerState::kFaultReaction;
  // A drive may send no emergency, or go on in spite of it. In position mode bit 13 has this one meaning.
  const bool off_track = mode_ == DriveMode::kPosition && (report_.statusword & kFollowingErrorBit) != 0;
  if (off_track && report_.phase == DrivePhase::kEnabled) return DriveFault::kFollowingError;
  if (in_fault && report_.phase != DrivePhase::kResetting) return DriveFault::kDriveFault;
  if (nmt_ != NmtState::kOperational) return DriveFault::kNotOperational;
  if (missed_ > timing_.most_missed) return DriveFault::kFeedbackMissing;
  // Position loops that use an old velocity would make the arm vibrate.
  if (unmeasured_ > (timing_.most_missed + 1) * timing_.measure_every) return DriveFault::kMeasurementMissing;
  if (core::seconds(now_ns - heartbeat_ns_) > timing_.heartbeat_timeout_s) return DriveFault::kHeartbeatLost;
  // A drive that is to be homed may be in homing mode before it is ready.
  const bool homes = report_.phase == DrivePhase::kReferencing || report_.phase == DrivePhase::kHoming ||
                     (homing_ && report_.phase == DrivePhase::kResetting);
  if (homes) return DriveFault::kNone;
  // A drive may show its mode some time after it has power: control() waits for it.
  const bool waits = report_.phase != DrivePhase::kEnabled && report_.mode == 0;
  if (!shows_mode() && !waits) return DriveFault::kModeMismatch;
  return DriveFault::kNone;
}

void Drive::watch(BusState bus, core::Nanoseconds now_ns) noexcept {
  if (bus == BusState::kBusOff) return fail(DriveFault::kBusOff, now_ns);
  if (bus == BusState::kDown) return fail(DriveFault::kBusDown, now_ns);
  if (const DriveFault fault = found_fault(now_ns); fault != DriveFault::kNone) fail(fault, now_ns);
}

void Drive::step(DriveGoal goal, bool reset, BusState bus, core::Nanoseconds now_ns, Outbox& out) noexcept {
  if (phase_ns_ < 0) enter(DrivePhase::kSearching, now_ns);
  if (reset && report_.phase == DrivePhase::kFault) leave_fault(now_ns);
  watch(bus, now_ns);
  switch (report_.phase) {
    case DrivePhase::kSearching:
      return search(now_ns, out);
    case DrivePhase::kConfiguring:
      return configure(now_ns, out);
    case DrivePhase::kStarting:
      return start(now_ns, out);
    case DrivePhase::kReferencing:
      return reference(goal, now_ns, out);
    case DrivePhase::kHoming:
      return home(goal, now_ns);
    default:
      return control(goal, now_ns);
  }
}

// Sets the controlword that serves the goal, from phase ready on.
void Drive::control(DriveGoal goal, core::Nanoseconds now_ns) noexcept {
  const PowerState power = report_.power;
  const DrivePhase phase = report_.phase;
  if (phase == DrivePhase::kFault) {
    controlword_ = stop_word_;
    return;
  }
  if (phase == DrivePhase::kResetting) {
    const bool in_fault = power == PowerState::kFault || power == PowerState::kFaultReaction;
    if (!in_fault)
      return enter(connected_phase(), now_ns);  // keeps the controlword: a drive that holds goes on
    // A rising edge resets the fault. The edge is repeated every few cycles, in case one was lost.
    const auto cycle = std::llround(phase_age_s(now_ns) / timing_.period_s);
    controlword_ = cycle % 8 >= 4 ? kCommandFaultReset : kCommandDisableVoltage;
    if (phase_age_s(now_ns) > timing_.state_timeout_s) fail(DriveFault::kDriveFault, now_ns);
    return;
  }
  const bool enabled = power == PowerState::kOperationEnabled;
  if (goal == DriveGoal::kEnabled && phase != DrivePhase::kEnabled && phase != DrivePhase::kEnabling)
    enter(DrivePhase::kEnabling, now_ns);
  if (goal == DriveGoal::kOff && phase != DrivePhase::kReady) enter(DrivePhase::kReady, now_ns);
  if (goal == DriveGoal::kQuickStop && phase != DrivePhase::kQuickStop) enter(DrivePhase::kQuickStop, now_ns);
  switch (report_.phase) {
    case DrivePhase::kEnabling:
      // What closes its brake is waited for: it cannot be turned back.
      controlword_ =
          brake_ && power == PowerState::kQuickStopActive ? kCommandQuickStop : towards_enabled(power);
      if (brake_is_open(now_ns) && shows_mode()) return enter(DrivePhase::kEnabled, now_ns);
      if (enabled && !shows_mode()) {
        if (phase_age_s(now_ns) > enable_timeout_s() + timing_.mode_timeout_s)
          fail(DriveFault::kModeMismatch, now_ns);
        return;
      }
      if (phase_age_s(now_ns) > enable_timeout_s()) fail(DriveFault::kEnableTimeout, now_ns);
      return;
    case DrivePhase::kEnabled:
      controlword_ = kCommandEnableOperation;
      if (!enabled) return fail(DriveFault::kLeftEnabled, now_ns);
      if (brake_seems_closed(now_ns)) fail(DriveFault::kBrakeClosed, now_ns);
      return;
    case DrivePhase::kQuickStop:
      controlword_ = kCommandQuickStop;
      return;
    default:
      // With a brake the torque ends when that holds.
      controlword_ = brake_ && (enabled || power == PowerState::kQuickStopActive) ? kCommandQuickStop
                                                                                  : kCommandDisableVoltage;
      return;
  }
}

void Drive::leave_fault(core::Nanoseconds now_ns) noexcept {
  const bool connected = nmt_ == NmtState::kOperational && missed_ <= timing_.most_missed &&
                         core::seconds(now_ns - heartbeat_ns_) <= timing_.heartbeat_timeout_s;
  const bool simple = is_reset_by_controlword(report_.fault) && connected && !booted_;
  enter(simple ? DrivePhase::kResetting : DrivePhase::kSearching, now_ns);
  forget_surplus();
}

void Drive::send_targets(const DriveTargets& targets, Outbox& out) noexcept {
  // A drive that was configured before and returns without having booted may still have its old targets. It
  // is commanded to stop while it is searched for.
  const bool may_run = report_.phase == DrivePhase::kSearching && was_set_up_;
  if (!is_watched() && report_.phase != DrivePhase::kFault && !may_run) return;
  const bool live = follows();
  CanFrame frame{.id = kCobRpdo1 + static_cast<std::uint32_t>(node_), .length = target_pdo_bytes(mode_)};
  const std::span bytes(frame.data);
  put_le(bytes, controlword_, 2);
  if (missed_ <= kStaleSyncs) torque_mille_ = targets.torque_mille;
  // While the brake opens the torque target already holds up the weight.
  const bool opens = brake_ && report_.phase == DrivePhase::kEnabling && powered_ns_ >= 0;
  const std::int16_t torque = live || opens || limits_force_ ? torque_mille_ : std::int16_t{0};
  switch (mode_) {
    case DriveMode::kPosition:
      put_le(bytes.subspan(2),
             static_cast<std::uint32_t>(live ? targets.position_counts : report_.position_counts), 4);
      put_le(bytes.subspan(6), static_cast<std::uint16_t>(torque), 2);
      break;
    case DriveMode::kVelocity:
      put_le(bytes.subspan(2), static_cast<std::uint32_t>(live ? targets.velocity_counts : 0), 4);
      put_le(bytes.subspan(6), static_cast<std::uint16_t>(torque), 2);
      break;
    case DriveMode::kTorque:
      put_le(bytes.subspan(2), static_cast<std::uint16_t>(torque), 2);
      break;
  }
  out.add(frame);
}

}  // namespace phantom::can
