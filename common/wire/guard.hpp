#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/core/clock.hpp"
#include "common/wire/fault.hpp"
#include "common/wire/message.hpp"
#include "common/wire/participants.hpp"
#include "common/wire/sample_assembly.hpp"
#include "common/wire/whole_samples.hpp"

namespace phantom::wire {

/// An IPv4 network: addresses that agree with `address` in the bits of `mask`. Host byte order.
struct Network {
  std::uint32_t address = 0, mask = 0xffffffff;
  bool holds(std::uint32_t other) const { return ((other ^ address) & mask) == 0; }
};

/// What the guard keeps of others, and from whom it accepts anything.
struct GuardOptions {
  Receiver receiver;
  bool relayed = false;             ///< discovery servers speak for others
  bool forgets_by_silence = false;  ///< Fast DDS heeds no departure, only a lease that has run out
  bool crashes_on_interleaved_fragments =
      false;                      ///< Fast DDS does, after a lost fragment (FragmentReassembler)
  std::vector<Network> networks;  ///< senders are in one of these; empty: anywhere
  std::size_t participants = 1024, participants_per_source = 128;
  std::size_t endpoints_per_participant = 512;
  std::uint32_t sample_bytes = 64 << 20;  ///< the largest sample that any endpoint carries
  /// Datagrams of discovery and handshakes that one sender may send in a second, and at once.
  double discovery_per_s = 2000.0, discovery_burst = 8000.0;
  /// Other datagrams of senders that have not announced themselves, of one address. Nobody has a reason to
  /// send any: who knows our readers and writers was known to us before. Not where discovery is relayed.
  double unannounced_per_s = 4000.0, unannounced_burst = 8000.0;
  double new_participants_per_s = 16.0;  ///< as many as participants_per_source at once
  /// Sequence numbers through which one sender may make readers count in a second, and at once.
  double counted_per_s = 1 << 18, counted_burst = 1 << 22;
  /// Numbers that were declared missing before: each costs a comparison. Writers repeat them with each sample
  /// until all readers have acknowledged it. Above this, such a GAP is hidden, and its datagram passes.
  double repeated_per_s = 1 << 22, repeated_burst = 1 << 22;
};

enum class Verdict : std::uint8_t {
  kPass,    ///< hand the datagram on
  kRefuse,  ///< drop it
  kHold,    ///< keep it for Guard::kHold: somebody else than the participant says that it leaves
};

/// Decides about each datagram before Fast DDS reads it. It keeps, in bounded memory taken at construction,
/// who has announced itself from where, how many endpoints each has, and the fragment size of each writer.
///
/// Fragments of built-in endpoints never reach Fast DDS: the guard assembles them, checks the whole, and
/// hands on one DATA. Of other endpoints' fragments Fast DDS trusts the size that the first one said; a
/// writer that changes it is refused, so that with kSlack octets behind a datagram no read of Fast DDS leaves
/// the memory that it was given (CacheChange_t::add_fragments).
///
/// A reader of Fast DDS counts, one by one, from the last sample that it knows to the first that a HEARTBEAT
/// says is left (StatefulReader::NotifyChanges), with the reader locked: 2^62 of them stop a participant for
/// ever. It keeps a record of each number that a GAP declares missing. So what a sender may make readers
/// count is bounded by number and in time.
///
/// Not thread-safe. Real-time safe: yes, but for what is new: a participant, a sender or an endpoint takes
/// memory.
class Guard {
 public:
  /// Octets that must be readable behind a datagram that is handed on.
  static constexpr std::size_t kSlack = 65536;
  /// A departure that comes from another address than the participant's own messages is believed if the
  /// participant is not heard for this time: it announces itself every second.
  static constexpr core::Nanoseconds kHold = 1200 * core::kNsPerMillisecond;
  /// With `forgets_by_silence`, a participant that has left is not heard for its lease and this time.
  static constexpr core::Nanoseconds kForgetting = 500 * core::kNsPerMillisecond;

  /// Greatest step of a writer's first sample: two years of a writer of one sample a second.
  static constexpr std::int64_t kMaxStep = 1 << 26;
  /// The same of writers that announce endpoints: each number is an endpoint that came or went.
  static constexpr std::int64_t kMaxStepOfDiscovery = 1 << 16;
  /// A number that a GAP declares missing costs as much as so many that are counted: it takes memory.
  static constexpr double kCostOfMissing = 16.0;
  /// Between two GAPs are samples. As many are passed over at the price of missing ones; a GAP that lies
  /// farther ahead is not remembered.
  static constexpr std::int64_t kMaxBetweenGaps = 8192;

  explicit Guard(const GuardOptions& options);

  /// Returns whether a sender of that address may send anything. Cheap; asked before the message is parsed.
  bool admits(const Source& source) const;
  /// Decides about a datagram of which check_message() has found no fault. `discovery`: it came in at a port
  /// of discovery. May turn submessages of `datagram` into padding: fragments of built-in endpoints, and
  /// what participants say that are not known. kNone: pass.
  Fault check(std::span<std::uint8_t> datagram, const MessageFacts& facts, const Source& source,
              bool discovery, core::Nanoseconds now);
  /// True if the datagram that was just checked is to be held (its fault is kNone).
  bool to_hold() const { return to_hold_; }
  /// Samples of built-in endpoints that became complete with the datagram just checked, each as a datagram of
  /// its own that check_message() has passed. Valid until the next check().
  std::span<const std::span<const std::uint8_t>> assembled() const {
    return {assembled_.data(), assembled_count_};
  }
  /// With `crashes_on_interleaved_fragments`: what is to be handed on in place of the datagram just checked
  /// (FragmentReassembler); empty: the datagram itself. Valid until the next check().
  std::span<const std::uint8_t> rewritten() const { return rewritten_; }
  /// With `forgets_by_silence`: Fast DDS has not heard a participant for its lease, and has forgotten it. If
  /// that returns, it is handled as one that leaves with its first datagram: it may not have forgotten us,
  /// and half a handshake would keep both apart.
  void lost(const GuidPrefix& participant);
  /// Returns whether the datagram just checked is the first of one that was lost.
  bool returned() const { return returned_; }
  /// With `receiver.unchecked_leases`: forgets and returns the participants of which nothing was handed on
  /// for their lease. The caller makes Fast DDS forget them. Allocates if there are any.
  std::vector<GuidPrefix> take_lapsed(core::Nanoseconds now);
  /// With `receiver.unchecked_leases`: returns whether the lease of the sender of the datagram just checked
  /// had run out before. It is checked as one of a new participant; Fast DDS must forget the old one first.
  bool lapsed() const { return lapsed_; }
  /// Returns what becomes of the departure that is held for `participant`.
  Verdict held(const GuidPrefix& participant, core::Nanoseconds now);

 private:
  Fault check_participants(const MessageFacts& facts, const Source& source, core::Nanoseconds now);
  bool is_leaving(const GuidPrefix& prefix, core::Nanoseconds now);
  bool has_lapsed(const GuidPrefix& prefix, core::Nanoseconds now);
  void leaves(const GuidPrefix& prefix, core::Nanoseconds now);
  Fault check_departure(const ParticipantFact& fact, const Source& source, core::Nanoseconds now);
  Fault check_rate(const MessageFacts& facts, const Source& source, core::Nanoseconds now);
  Fault check_unannounced(const MessageFacts& facts, const Source& source, core::Nanoseconds now);
  Fault check_endpoints(const MessageFacts& facts);
  Fault check_sequences(std::span<std::uint8_t> datagram, const MessageFacts& facts, const Source& source,
                        core::Nanoseconds now);
  Participant* speaker(const GuidPrefix& prefix, const Source& source, core::Nanoseconds now);
  Fault check_fragments(std::span<std::uint8_t> datagram, const MessageFacts& facts, const Source& source,
                        core::Nanoseconds now);
  Fault assemble(std::span<std::uint8_t> datagram, const FragmentFact& fragment, std::uint16_t vendor,
                 const Source& source, core::Nanoseconds now);

  void keep_from_mixed(std::span<const std::uint8_t> datagram, const MessageFacts& facts);

  GuardOptions options_;
  Participants participants_;
  SampleAssembly assembly_;
  std::unique_ptr<MessageFacts> assembled_facts_;
  static constexpr std::size_t kMaxAssembled = 4;  // of one datagram
  std::unique_ptr<std::uint8_t[]> assembled_octets_;
  std::array<std::span<const std::uint8_t>, kMaxAssembled> assembled_;
  std::size_t assembled_count_ = 0;
  std::unique_ptr<FragmentReassembler> whole_samples_;
  std::unique_ptr<std::uint8_t[]> rewritten_octets_;
  std::span<const std::uint8_t> rewritten_;
  bool to_hold_ = false, returned_ = false, lapsed_ = false;
};

}  // namespace phantom::wire
