#include "common/dds/handshake_watch.hpp"

#include <algorithm>

namespace phantom::dds {

void HandshakeWatch::discovered(const GuidPrefix& peer, core::Nanoseconds now) {
  waiting_[peer] = Waiting{now, now, 0};
}

int HandshakeWatch::admitted(const GuidPrefix& peer) {
  const auto found = waiting_.find(peer);
  if (found == waiting_.end()) return 0;
  const int attempts = found->second.attempts;
  waiting_.erase(found);
  return attempts;
}

void HandshakeWatch::left(const GuidPrefix& peer) { waiting_.erase(peer); }

std::vector<HandshakeWatch::Attempt> HandshakeWatch::overdue(const GuidPrefix& own, core::Nanoseconds now) {
  std::vector<decltype(waiting_)::pointer> due;
  for (auto& entry : waiting_) {
    const Waiting& state = entry.second;
    const core::Nanoseconds first = own < entry.first ? kPatience : kPatienceOfGreater;
    if (now - state.last >= (state.attempts < kAttemptsInARow ? first : kMostPatience)) due.push_back(&entry);
  }
  std::stable_sort(due.begin(), due.end(),
                   [](const auto* one, const auto* other) { return one->second.last < other->second.last; });
  if (due.size() > kMostAtOnce) due.resize(kMostAtOnce);
  std::vector<Attempt> attempts;
  for (auto* entry : due) {
    Waiting& state = entry->second;
    state.last = now;
    attempts.push_back({entry->first, ++state.attempts, now - state.since});
  }
  return attempts;
}

}  // namespace phantom::dds
