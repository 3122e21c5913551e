#include "common/dds/handshake_watch.hpp"

#include <algorithm>

namespace phantom::dds {

void HandshakeWatch::discovered(const GuidPrefix& peer, core::Nanoseconds now) {
  Peer& known = peers_[peer];
  known = Peer{known.present + 1, true, now, now, 0};
}

int HandshakeWatch::admitted(const GuidPrefix& peer) {
  const auto found = peers_.find(peer);
  if (found == peers_.end() || !found->second.waiting) return 0;
  found->second.waiting = false;
  return found->second.attempts;
}

bool HandshakeWatch::left(const GuidPrefix& peer) {
  const auto found = peers_.find(peer);
  if (found != peers_.end() && --found->second.present > 0) return false;
  if (found != peers_.end()) peers_.erase(found);
  return true;
}

std::vector<HandshakeWatch::Attempt> HandshakeWatch::overdue(const GuidPrefix& own, core::Nanoseconds now) {
  std::vector<decltype(peers_)::pointer> due;
  for (auto& entry : peers_) {
    const Peer& peer = entry.second;
    const core::Nanoseconds first = own < entry.first ? kPatience : kPatienceOfGreater;
    const core::Nanoseconds patience = peer.attempts < kAttemptsInARow ? first : kMostPatience;
    if (peer.waiting && now - peer.last >= patience) due.push_back(&entry);
  }
  std::stable_sort(due.begin(), due.end(),
                   [](const auto* one, const auto* other) { return one->second.last < other->second.last; });
  if (due.size() > kMostAtOnce) due.resize(kMostAtOnce);
  std::vector<Attempt> attempts;
  for (auto* entry : due) {
    Peer& peer = entry->second;
    peer.last = now;
    attempts.push_back({entry->first, ++peer.attempts, now - peer.since});
  }
  return attempts;
}

}  // namespace phantom::dds
