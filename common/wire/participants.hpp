#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/core/clock.hpp"
#include "common/wire/rtps.hpp"

namespace phantom::wire {

/// Lets so many things pass in a second on average, and `burst` at once. Real-time safe: yes.
///
/// take() takes one. take_at_once() takes `count`, which may be more than are left, but then nothing passes
/// until that many have come back.
class TokenBucket {
 public:
  TokenBucket(double per_s, double burst) : per_s_(per_s), burst_(burst), tokens_(burst) {}
  bool take(core::Nanoseconds now);
  bool take_at_once(double count, core::Nanoseconds now);
  /// Returns whether `count` are left.
  bool holds(double count, core::Nanoseconds now);

 private:
  void refill(core::Nanoseconds now);
  double per_s_, burst_, tokens_;
  core::Nanoseconds filled_ = 0;
};

/// How far readers have counted a writer's samples.
struct WriterSamples {
  std::int64_t first = 1;  ///< the first that it still had, by its HEARTBEATs
  /// All numbers below were charged as missing ones, or are older than `first`.
  std::int64_t missing_to = 1;
};

/// What is known of one participant that has announced itself.
class Participant {
 public:
  /// A participant's sockets are those from which its first messages come, within this time.
  static constexpr core::Nanoseconds kLearning = 2 * core::kNsPerSecond;
  /// Another socket is learnt once none of the known ones has been heard for this time: its network changed.
  static constexpr core::Nanoseconds kSilence = 3 * core::kNsPerSecond;
  static constexpr std::size_t kMaxSockets = 8, kMaxFragmenting = 64, kMaxBuiltIn = 16;
  /// What each participant may make readers count without its sender's budget.
  static constexpr double kCountedPerS = 64.0, kCountedBurst = 1024.0;

  Participant(const TokenBucket& discovery, core::Nanoseconds now)
      : discovery_(discovery), first_(now), last_(now) {}

  /// Takes note of a message from `source`. Returns whether that is one of its sockets.
  bool hear(const Source& source, core::Nanoseconds now);
  bool owns(const Source& source) const;
  TokenBucket& discovery() { return discovery_; }
  TokenBucket& counting() { return counting_; }

  void lease(core::Nanoseconds lease) { lease_ = lease; }
  /// True once Fast DDS has forgotten it, too.
  bool expired(core::Nanoseconds now) const { return now - last_ > lease_ + lease_ / 4 + core::kNsPerSecond; }

  /// Adds an endpoint; false if it has `most` others already.
  bool add_endpoint(EntityId endpoint, std::size_t most);
  void remove_endpoint(EntityId endpoint);

  /// Returns whether the writer's fragments have that size, which its first ones decide.
  bool keeps_fragment_size(EntityId writer, std::uint16_t bytes);

  /// Returns how far the writer's samples were counted, to be changed by the caller; null if that is kept of
  /// `most` endpoints and the built-in ones already.
  WriterSamples* samples_of(EntityId writer, std::size_t most);

  /// One of its messages was handed on to Fast DDS, whose lease of it begins anew.
  void passed(core::Nanoseconds now) { passed_ = now; }
  /// True if none was for its lease. Never, before the first.
  bool lapsed(core::Nanoseconds now) const { return passed_ != 0 && now - passed_ > lease_; }
  /// If none was for its lease, Fast DDS has forgotten it, and its readers begin at the start again.
  void forget_samples_after_lease(core::Nanoseconds now) {
    if (now - passed_ >= lease_) samples_.clear();
  }

  /// It has said that it leaves. Its lease may still run in Fast DDS.
  void leave(core::Nanoseconds now) {
    left_ = now;
    lost_ = false;
  }
  /// It was not heard for its lease. One that has left is expected to be silent.
  void lose() { lost_ = !has_left(); }
  bool is_lost() const { return lost_; }
  bool has_left() const { return left_ != 0; }
  /// True if its lease and `margin` have run out since it left.
  bool forgotten(core::Nanoseconds margin, core::Nanoseconds now) const {
    return now - left_ > lease_ + margin;
  }

  /// A departure that somebody else sends is held from `now` on.
  void hold(core::Nanoseconds now) { held_ = now; }
  bool is_held() const { return held_ != 0; }
  core::Nanoseconds held_since() const { return held_; }
  /// True if one of its sockets was heard after the departure that is held.
  bool spoke_since_held() const { return own_last_ > held_; }
  void release() { held_ = 0; }

 private:
  TokenBucket discovery_, counting_{kCountedPerS, kCountedBurst};
  core::Nanoseconds first_, last_, own_last_ = 0, passed_ = 0, held_ = 0, left_ = 0, lease_ = 0;
  bool lost_ = false;
  std::array<Source, kMaxSockets> sockets_;
  std::size_t socket_count_ = 0;
  std::vector<EntityId> endpoints_;
  std::vector<std::pair<EntityId, std::uint16_t>> fragment_sizes_;
  std::vector<std::pair<EntityId, WriterSamples>> samples_;
};

/// The participants that have announced themselves, and what senders without one may send. Bounded in total
/// and by sender. Allocates only when a participant, an endpoint or a sender is new.
class Participants {
 public:
  struct Limits {
    std::size_t total, per_source;
    double new_per_s, discovery_per_s, discovery_burst, unannounced_per_s, unannounced_burst, counted_per_s,
        counted_burst, repeated_per_s, repeated_burst;
  };
  explicit Participants(const Limits& limits);

  Participant* find(const GuidPrefix& prefix);
  /// Returns the participant, new or known; null if there are too many, in all or of that sender's address.
  Participant* add(const GuidPrefix& prefix, const Source& source, core::Nanoseconds now);
  void remove(const GuidPrefix& prefix) { known_.erase(prefix); }
  /// Removes and returns those of which nothing was handed on for their lease.
  std::vector<GuidPrefix> take_lapsed(core::Nanoseconds now);
  std::size_t size() const { return known_.size(); }

  /// Lets a stranger's datagram of discovery pass; all strangers of one address share its budget.
  bool admits_stranger(std::uint32_t address, core::Nanoseconds now);
  /// The same of any other datagram.
  bool admits_unannounced(std::uint32_t address, core::Nanoseconds now);
  /// Lets a participant make readers count `numbers`: few by its own budget, more by its address's.
  bool admits_counting(Participant& participant, std::uint32_t address, double numbers,
                       core::Nanoseconds now);
  /// Returns whether an address may name so many numbers again that it has declared missing before.
  bool admits_repeating(std::uint32_t address, double numbers, core::Nanoseconds now);

 private:
  static constexpr std::size_t kMaxAddresses = 1024;
  struct Hash {
    std::size_t operator()(const GuidPrefix& prefix) const noexcept;
  };
  struct Address {
    TokenBucket fresh, discovery, unannounced, counting, repeated;
    core::Nanoseconds last = 0;
  };
  struct Known {
    Participant participant;
    std::uint32_t address;
  };
  Address& address_of(std::uint32_t address, core::Nanoseconds now);
  void forget_expired(core::Nanoseconds now);

  Limits limits_;
  std::unordered_map<GuidPrefix, Known, Hash> known_;
  std::unordered_map<std::uint32_t, Address> addresses_;
};

}  // namespace phantom::wire
