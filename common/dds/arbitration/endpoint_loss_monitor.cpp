#include "common/dds/arbitration/endpoint_loss_monitor.hpp"

#include <algorithm>

namespace phantom::dds {

void EndpointLossMonitor::discovered(const GuidPrefix& peer, core::Nanoseconds now) {
  Peer& known = peers_[peer];
  ++known.present;
  known.last = now;
}

bool EndpointLossMonitor::left(const GuidPrefix& peer, core::Nanoseconds now) {
  const auto found = peers_.find(peer);
  if (found == peers_.end()) return true;
  Peer& known = found->second;
  known.present = std::max(0, known.present - 1);
  known.last = now;
  for (auto entry = known.ends.begin(); entry != known.ends.end();) {
    KnownEnd& end = entry->second;
    const bool closed_before = end.state == EndState::kRemoved && now - end.removed > kTogether;
    if (end.state == EndState::kRemoved && !closed_before) end.state = EndState::kMissing;
    entry = closed_before ? known.ends.erase(entry) : std::next(entry);
  }
  if (known.present > 0) return false;
  forget_oldest();
  return true;
}

void EndpointLossMonitor::end_discovered(const GuidPrefix& peer, End end, core::Nanoseconds now) {
  Peer& known = peers_[peer];
  known.ends[end] = KnownEnd{};
  known.last = now;
}

void EndpointLossMonitor::end_removed(const GuidPrefix& peer, End end, core::Nanoseconds now) {
  const auto found = peers_.find(peer);
  if (found == peers_.end()) return;
  const auto known = found->second.ends.find(end);
  if (known != found->second.ends.end()) known->second = {EndState::kRemoved, now};
}

std::vector<EndpointLossMonitor::Attempt> EndpointLossMonitor::overdue(const GuidPrefix& own,
                                                                       core::Nanoseconds now) {
  std::vector<Attempt> attempts;
  for (auto& [prefix, peer] : peers_) {
    if (peer.present == 0) continue;
    const auto missing =
        static_cast<std::size_t>(std::count_if(peer.ends.begin(), peer.ends.end(), [](const auto& entry) {
          return entry.second.state == EndState::kMissing;
        }));
    if (missing == 0) peer.attempts = 0;
    const core::Nanoseconds first = own < prefix ? patience_ : patience_ + patience_ / 2;
    if (missing == 0 || now - peer.last < first << peer.attempts) continue;
    if (peer.attempts == kMaxAttempts) {  // the peer has closed them
      std::erase_if(peer.ends, [](const auto& entry) { return entry.second.state == EndState::kMissing; });
      peer.attempts = 0;
      continue;
    }
    peer.last = now;
    attempts.push_back({prefix, ++peer.attempts, missing});
  }
  return attempts;
}

void EndpointLossMonitor::forget_oldest() {
  std::size_t lost = 0;
  auto oldest = peers_.end();
  for (auto entry = peers_.begin(); entry != peers_.end(); ++entry) {
    if (entry->second.present > 0) continue;
    ++lost;
    if (oldest == peers_.end() || entry->second.last < oldest->second.last) oldest = entry;
  }
  if (lost <= kMaxLost) return;
  peers_.erase(oldest);
  ++forgotten_;
}

}  // namespace phantom::dds
