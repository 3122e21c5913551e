// How a drive is looked for, set up and started.
#include <algorithm>
#include <array>
#include <span>

#include "common/can/drive.hpp"

namespace phantom::can {
namespace {

constexpr int kAttempts = 3;         // of an SDO transfer, because frames may be lost
constexpr double kAskAgain_s = 0.1;  // NMT commands are not acknowledged, so they are repeated
constexpr int kMaxSdoOwed = 8;
constexpr int kMaxBootDoublings = 3;  // of the time until a drive that is not heard is asked again

}  // namespace

void Drive::search(core::Nanoseconds now_ns, Outbox& out) noexcept {
  if (booted_) return enter(DrivePhase::kConfiguring, now_ns);
  // A drive that boots slowly is not to be reset again before it is done: the time doubles.
  const int doublings = std::clamp(searches_ - 1, 0, kMaxBootDoublings);
  if (asked_ns_ >= 0 && core::seconds(now_ns - asked_ns_) < timing_.boot_timeout_s * (1 << doublings)) return;
  ++searches_;
  out.add(nmt_frame(NmtCommand::kResetCommunication, static_cast<std::uint8_t>(node_)));
  asked_ns_ = now_ns;
}

void Drive::begin_setup_step(core::Nanoseconds now_ns) noexcept {
  const SetupStep& step = setup_[setup_next_];
  if (step.kind != SetupStep::Kind::kWrite) return sdo_.start_read(step.index, step.sub, now_ns);
  std::array<std::uint8_t, 4> bytes{};
  put_le(bytes, step.value | (step.keep ? kept_bits_ : 0U), step.size);
  sdo_.start_write(step.index, step.sub, std::span(bytes).first(step.size), now_ns);
}

void Drive::finish_setup_step(core::Nanoseconds now_ns) noexcept {
  const SetupStep& step = setup_[setup_next_];
  report_.sdo_index = step.index;
  report_.sdo_sub = step.sub;
  report_.sdo_abort = sdo_.abort_code();
  if (sdo_.state() == SdoClient::State::kTimedOut || sdo_.abort_code() == kAbortToggle) {
    if (++attempts_ >= kAttempts) return fail(DriveFault::kSetupTimeout, now_ns);
    return begin_setup_step(now_ns);
  }
  const bool aborted = sdo_.state() == SdoClient::State::kAborted;
  const bool keeps = step.kind == SetupStep::Kind::kKeep;
  if (aborted && !step.optional && !keeps) return fail(DriveFault::kSetupRefused, now_ns);
  const bool fits_word = !aborted && sdo_.data().size() <= 4;
  const std::uint32_t read =
      step.kind != SetupStep::Kind::kWrite && fits_word ? get_le(sdo_.data(), sdo_.data().size()) : 0;
  if (keeps) kept_bits_ = read & step.mask;
  if (step.kind != SetupStep::Kind::kWrite && !keeps && !aborted) {
    const std::uint32_t off = read > step.value ? read - step.value : step.value - read;
    const bool fits = step.kind == SetupStep::Kind::kExpect ? (read & step.mask) == step.value
                                                            : off <= step.value / 100 + 1;
    report_.sdo_value = read;
    if (!fits) return fail(DriveFault::kSetupRefused, now_ns);
  }
  attempts_ = 0;
  if (++setup_next_ == setup_.size()) return enter(DrivePhase::kStarting, now_ns);
  begin_setup_step(now_ns);
}

void Drive::configure(core::Nanoseconds now_ns, Outbox& out) noexcept {
  if (asked_ns_ < 0) {
    asked_ns_ = now_ns;
    booted_ = false;
    begin_setup_step(now_ns);
  } else if (booted_) {  // it booted again and has lost its settings
    return enter(DrivePhase::kConfiguring, now_ns);
  }
  const bool sent = send_request(now_ns, out);
  if (sdo_.state() == SdoClient::State::kBusy) return;
  finish_setup_step(now_ns);
  if (report_.phase == DrivePhase::kConfiguring && !sent) send_request(now_ns, out);  // one frame per cycle
}

bool Drive::send_request(core::Nanoseconds now_ns, Outbox& out) noexcept {
  const auto frame = sdo_.poll(now_ns);
  if (!frame) return false;
  out.add(*frame);
  if (sdo_.state() == SdoClient::State::kBusy) owed_sdo_ = std::min(owed_sdo_ + 1, kMaxSdoOwed);
  return true;  // an abort is not answered
}

void Drive::start(core::Nanoseconds now_ns, Outbox& out) noexcept {
  const bool connected = heartbeat_ns_ >= 0 && nmt_ == NmtState::kOperational;
  const bool all_heard = connected && report_.has_position && measured_;
  if (all_heard && may_show_mode()) {
    missed_ = 0;
    return enter(connected_phase(), now_ns);
  }
  if (phase_age_s(now_ns) > (all_heard ? timing_.mode_timeout_s : timing_.state_timeout_s)) {
    if (!connected) return fail(DriveFault::kNotOperational, now_ns);
    if (!report_.has_position) return fail(DriveFault::kFeedbackMissing, now_ns);
    return fail(measured_ ? DriveFault::kModeMismatch : DriveFault::kMeasurementMissing, now_ns);
  }
  if (nmt_ == NmtState::kOperational) return;
  if (asked_ns_ >= 0 && core::seconds(now_ns - asked_ns_) < kAskAgain_s) return;
  out.add(nmt_frame(NmtCommand::kStart, static_cast<std::uint8_t>(node_)));
  asked_ns_ = now_ns;
}

}  // namespace phantom::can
