#include "common/dds/admission/handshake_watch.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace phantom::dds {

void HandshakeWatch::discovered(const GuidPrefix& peer, core::Nanoseconds now) {
  Peer& known = peers_[peer];
  known = Peer{known.present + 1, true, now, now, known.attempts};
}

int HandshakeWatch::admitted(const GuidPrefix& peer) {
  const auto found = peers_.find(peer);
  if (found == peers_.end() || !found->second.waiting) return 0;
  found->second.waiting = false;
  return std::exchange(found->second.attempts, 0);
}

bool HandshakeWatch::left(const GuidPrefix& peer, core::Nanoseconds now) {
  const auto found = peers_.find(peer);
  if (found == peers_.end()) return true;
  Peer& known = found->second;
  if (--known.present > 0) return false;
  known.waiting = false;
  known.last = now;
  return true;
}

void HandshakeWatch::forget(core::Nanoseconds now) {
  for (auto entry = peers_.begin(); entry != peers_.end();) {
    const Peer& peer = entry->second;
    const bool gone = peer.present == 0 && (peer.attempts == 0 || now - peer.last > kMaxPatience);
    entry = gone ? peers_.erase(entry) : std::next(entry);
  }
}

std::vector<HandshakeWatch::Attempt> HandshakeWatch::overdue(const GuidPrefix& own, core::Nanoseconds now) {
  forget(now);
  std::vector<decltype(peers_)::pointer> due;
  for (auto& entry : peers_) {
    const Peer& peer = entry.second;
    const core::Nanoseconds first = own < entry.first ? kPatience : kPatienceOfGreater;
    const core::Nanoseconds patience = std::min(first << std::min(peer.attempts, 8), kMaxPatience);
    if (peer.waiting && now - peer.last >= patience) due.push_back(&entry);
  }
  std::stable_sort(due.begin(), due.end(),
                   [](const auto* one, const auto* other) { return one->second.last < other->second.last; });
  if (due.size() > kMaxAtOnce) due.resize(kMaxAtOnce);
  std::vector<Attempt> attempts;
  for (auto* entry : due) {
    Peer& peer = entry->second;
    peer.last = now;
    attempts.push_back({entry->first, ++peer.attempts, now - peer.since});
  }
  return attempts;
}

}  // namespace phantom::dds
