#include "common/wire/participants.hpp"

#include <algorithm>
#include <cstring>

namespace phantom::wire {

void TokenBucket::refill(core::Nanoseconds now) {
  if (filled_ != 0) tokens_ = std::min(burst_, tokens_ + core::seconds(now - filled_) * per_s_);
  filled_ = now;
}

bool TokenBucket::holds(double count, core::Nanoseconds now) {
  refill(now);
  return tokens_ >= count;
}

bool TokenBucket::take(core::Nanoseconds now) { return take_at_once(1.0, now); }

bool TokenBucket::take_at_once(double count, core::Nanoseconds now) {
  if (!holds(1.0, now)) return false;
  tokens_ -= count;
  return true;
}

bool Participant::owns(const Source& source) const {
  const auto end = sockets_.begin() + static_cast<std::ptrdiff_t>(socket_count_);
  return std::find(sockets_.begin(), end, source) != end;
}

bool Participant::hear(const Source& source, core::Nanoseconds now) {
  last_ = now;
  if (!owns(source)) {
    const bool learning = now - first_ <= kLearning || now - own_last_ > kSilence;
    if (!learning || is_held()) return false;
    if (socket_count_ == kMaxSockets) {  // the eldest goes: its network is another by now
      std::rotate(sockets_.begin(), sockets_.begin() + 1, sockets_.end());
      --socket_count_;
    }
    sockets_[socket_count_++] = source;
  }
  own_last_ = now;
  return true;
}

bool Participant::add_endpoint(EntityId endpoint, std::size_t most) {
  if (std::find(endpoints_.begin(), endpoints_.end(), endpoint) != endpoints_.end()) return true;
  if (endpoints_.size() >= most) return false;
  endpoints_.push_back(endpoint);
  return true;
}

void Participant::remove_endpoint(EntityId endpoint) {
  std::erase(endpoints_, endpoint);
  std::erase_if(samples_, [&](const auto& one) { return one.first == endpoint; });
}

WriterSamples* Participant::samples_of(EntityId writer, std::size_t most) {
  const auto known =
      std::find_if(samples_.begin(), samples_.end(), [&](const auto& one) { return one.first == writer; });
  if (known != samples_.end()) return &known->second;
  if (samples_.size() >= most + kMaxBuiltIn) return nullptr;
  return &samples_.emplace_back(writer, WriterSamples()).second;
}

bool Participant::keeps_fragment_size(EntityId writer, std::uint16_t bytes) {
  const auto known = std::find_if(fragment_sizes_.begin(), fragment_sizes_.end(),
                                  [&](const auto& one) { return one.first == writer; });
  if (known != fragment_sizes_.end()) return known->second == bytes;
  if (fragment_sizes_.size() >= kMaxFragmenting) return false;
  fragment_sizes_.emplace_back(writer, bytes);
  return true;
}

std::size_t Participants::Hash::operator()(const GuidPrefix& prefix) const noexcept {
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
  for (const std::uint8_t octet : prefix) hash = (hash ^ octet) * 0x100000001b3;
  return static_cast<std::size_t>(hash);
}

Participants::Participants(const Limits& limits) : limits_(limits) {
  known_.reserve(limits.total);
  addresses_.reserve(64);
}

Participant* Participants::find(const GuidPrefix& prefix) {
  const auto found = known_.find(prefix);
  return found == known_.end() ? nullptr : &found->second.participant;
}

void Participants::forget_expired(core::Nanoseconds now) {
  std::erase_if(known_, [&](const auto& one) { return one.second.participant.expired(now); });
}

std::vector<GuidPrefix> Participants::take_lapsed(core::Nanoseconds now) {
  std::vector<GuidPrefix> lapsed;
  std::erase_if(known_, [&](const auto& one) {
    const bool lapses = one.second.participant.lapsed(now);
    if (lapses) lapsed.push_back(one.first);
    return lapses;
  });
  return lapsed;
}

Participant* Participants::add(const GuidPrefix& prefix, const Source& source, core::Nanoseconds now) {
  if (Participant* known = find(prefix)) return known;
  Address& address = address_of(source.address, now);
  const auto count = [&] {
    return static_cast<std::size_t>(std::count_if(
        known_.begin(), known_.end(), [&](const auto& one) { return one.second.address == source.address; }));
  };
  if (!address.fresh.take(now)) return nullptr;
  if (known_.size() >= limits_.total || count() >= limits_.per_source) forget_expired(now);
  if (known_.size() >= limits_.total || count() >= limits_.per_source) return nullptr;
  const TokenBucket discovery(limits_.discovery_per_s, limits_.discovery_burst);
  return &known_.try_emplace(prefix, Known{Participant(discovery, now), source.address})
              .first->second.participant;
}

Participants::Address& Participants::address_of(std::uint32_t address, core::Nanoseconds now) {
  if (const auto known = addresses_.find(address); known != addresses_.end()) {
    known->second.last = now;
    return known->second;
  }
  if (addresses_.size() >= kMaxAddresses) {
    addresses_.erase(std::min_element(addresses_.begin(), addresses_.end(), [](const auto& a, const auto& b) {
      return a.second.last < b.second.last;
    }));
  }
  const Address fresh{{limits_.new_per_s, static_cast<double>(limits_.per_source)},
                      {limits_.discovery_per_s, limits_.discovery_burst},
                      {limits_.unannounced_per_s, limits_.unannounced_burst},
                      {limits_.counted_per_s, limits_.counted_burst},
                      {limits_.repeated_per_s, limits_.repeated_burst},
                      now};
  return addresses_.emplace(address, fresh).first->second;
}

bool Participants::admits_stranger(std::uint32_t address, core::Nanoseconds now) {
  return address_of(address, now).discovery.take(now);
}

bool Participants::admits_unannounced(std::uint32_t address, core::Nanoseconds now) {
  return address_of(address, now).unannounced.take(now);
}

bool Participants::admits_counting(Participant& participant, std::uint32_t address, double numbers,
                                   core::Nanoseconds now) {
  if (participant.counting().holds(numbers, now)) return participant.counting().take_at_once(numbers, now);
  return address_of(address, now).counting.take_at_once(numbers, now);
}

bool Participants::admits_repeating(std::uint32_t address, double numbers, core::Nanoseconds now) {
  return numbers == 0.0 || address_of(address, now).repeated.take_at_once(numbers, now);
}

}  // namespace phantom::wire
