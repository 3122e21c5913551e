#include "common/teleop/coupling/stop_latch.hpp"

namespace phantom::teleop {
namespace {

// SplitMix64 (Steele, Lea and Flood 2014): every state yields a different number.
std::uint64_t next_random(std::uint64_t& state) noexcept {
  std::uint64_t z = state += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace

void StopLatch::latch(StopCause cause) noexcept {
  // Of several causes, the first in the enumeration is reported. The id is that of the newest stop.
  const bool first = record_.cause == StopCause::kNone || cause < record_.cause;
  record_ = {next_random(random_), first ? cause : record_.cause};
  if (record_.id == 0) record_.id = 1;
  releasing_ = false;
}

ResetOutcome StopLatch::answer(const StopReset& reset) noexcept {
  if (reset.own != record_.id) return ResetOutcome::kRefused;
  if (reset.partner != 0) released_partner_ = reset.partner;
  releasing_ = true;
  return ResetOutcome::kReleased;
}

ResetOutcome StopLatch::step(const StopSigns& signs) noexcept {
  const ResetOutcome outcome = signs.reset != nullptr ? answer(*signs.reset) : ResetOutcome::kNone;
  if (signs.requests != requests_seen_) latch(StopCause::kEmergency);
  requests_seen_ = signs.requests;
  if (signs.drive_fault && !fault_before_) latch(StopCause::kDriveFault);
  fault_before_ = signs.drive_fault;
  if (releasing_ && !signs.drive_fault) record_ = {};
  if (!stopped()) releasing_ = false;
  const bool known = signs.partner_stop != 0 && signs.partner_stop == released_partner_;
  if (signs.partner_stopped && !known && !stopped()) latch(StopCause::kPartner);
  return outcome;
}

}  // namespace phantom::teleop
