#include "common/wire/guard.hpp"

#include <algorithm>
#include <cstring>

namespace phantom::wire {
namespace {

constexpr std::size_t kRewrittenBytes = 65536 + kMaxGrown;
constexpr std::size_t kDataHead = kHeaderBytes + kSubmessageHeader + 20;
constexpr std::size_t kAssembledBytes = kDataHead + SampleAssembly::kMaxBytes;

/// Writes an RTPS message with one DATA of that payload; returns its octets.
std::span<std::uint8_t> data_message(std::span<std::uint8_t> into, const FragmentFact& fragment,
                                     std::uint16_t vendor, std::span<const std::uint8_t> payload) {
  std::uint8_t* at = into.data();
  const auto put = [&at](std::initializer_list<std::uint32_t> octets) {
    for (const std::uint32_t octet : octets) *at++ = static_cast<std::uint8_t>(octet);
  };
  put({'R', 'T', 'P', 'S', 2, 2, static_cast<std::uint32_t>(vendor >> 8), vendor & 0xffu});
  at = std::copy(fragment.writer.prefix.begin(), fragment.writer.prefix.end(), at);
  put({static_cast<std::uint32_t>(SubmessageId::kData), 0x05, 0, 0});  // little-endian, data; up to the end
  put({0, 0, 16, 0});
  for (const EntityId entity : {fragment.reader, fragment.writer.entity})
    put({entity >> 24, entity >> 16 & 0xff, entity >> 8 & 0xff, entity & 0xff});
  const auto sequence = static_cast<std::uint64_t>(fragment.sequence);
  for (const int shift : {32, 40, 48, 56, 0, 8, 16, 24})
    put({static_cast<std::uint32_t>(sequence >> shift & 0xff)});
  at = std::copy(payload.begin(), payload.end(), at);
  return into.first(static_cast<std::size_t>(at - into.data()));
}

/// Makes a submessage padding, which Fast DDS skips by its length.
void blank(std::span<std::uint8_t> datagram, const Place& place) {
  const std::size_t length = place.end - place.begin - kSubmessageHeader;
  std::uint8_t* header = datagram.data() + place.begin;
  header[0] = static_cast<std::uint8_t>(SubmessageId::kPad);
  header[place.little_endian ? 2 : 3] = static_cast<std::uint8_t>(length);
  header[place.little_endian ? 3 : 2] = static_cast<std::uint8_t>(length >> 8);
}

/// What a GAP makes readers of one writer count.
struct GapCost {
  double fresh = 0.0;           ///< for numbers that were not declared missing before
  double repeated = 0.0;        ///< numbers that were
  std::int64_t missing_to = 1;  ///< of the writer, once that is paid
};

GapCost cost_of(const SequenceFact& gap, const WriterSamples& samples) {
  const std::int64_t known_to = std::max(samples.missing_to, samples.first);
  if (gap.end <= known_to) return {0.0, static_cast<double>(gap.missing), known_to};
  const auto repeated =
      static_cast<double>(std::clamp<std::int64_t>(std::min(gap.base, known_to) - gap.start, 0, gap.missing));
  GapCost cost{Guard::kCostOfMissing * (gap.missing - repeated), repeated, known_to};
  const std::int64_t between = std::max<std::int64_t>(gap.start - known_to, 0);
  if (between > Guard::kMaxBetweenGaps) return cost;
  cost.fresh += Guard::kCostOfMissing * static_cast<double>(between);
  cost.missing_to = gap.end;
  return cost;
}

std::int64_t longest_step(EntityId writer) {
  switch (writer) {
    case kTopicWriter:
    case kPublicationWriter:
    case kSubscriptionWriter:
    case kSecurePublicationWriter:
    case kSecureSubscriptionWriter:
      return Guard::kMaxStepOfDiscovery;
    default:
      return Guard::kMaxStep;
  }
}

}  // namespace

Guard::Guard(const GuardOptions& options)
    : options_(options),
      participants_({options.participants, options.participants_per_source, options.new_participants_per_s,
                     options.discovery_per_s, options.discovery_burst, options.unannounced_per_s,
                     options.unannounced_burst, options.counted_per_s, options.counted_burst,
                     options.repeated_per_s, options.repeated_burst}),
      assembled_facts_(std::make_unique<MessageFacts>()),
      assembled_octets_(std::make_unique_for_overwrite<std::uint8_t[]>(kMaxAssembled * kAssembledBytes)) {
  if (!options.crashes_on_interleaved_fragments) return;
  whole_samples_ = std::make_unique<FragmentReassembler>();
  rewritten_octets_ = std::make_unique_for_overwrite<std::uint8_t[]>(kRewrittenBytes);
}

bool Guard::admits(const Source& source) const {
  return options_.networks.empty() ||
         std::any_of(options_.networks.begin(), options_.networks.end(),
                     [&](const Network& network) { return network.holds(source.address); });
}

Fault Guard::check(std::span<std::uint8_t> datagram, const MessageFacts& facts, const Source& source,
                   bool discovery, core::Nanoseconds now) {
  to_hold_ = returned_ = lapsed_ = false;
  assembled_count_ = 0;
  rewritten_ = {};
  // Only a relay speaks for others; whose sockets these are is known of the message's sender alone.
  if (facts.for_another && !options_.relayed) return Fault::kIdentity;
  if (is_leaving(facts.sender, now)) return Fault::kLeft;
  lapsed_ = has_lapsed(facts.sender, now);
  Fault fault = discovery ? check_rate(facts, source, now) : check_unannounced(facts, source, now);
  if (fault == Fault::kNone) fault = check_fragments(datagram, facts, source, now);
  if (fault == Fault::kNone) fault = check_participants(facts, source, now);
  if (fault == Fault::kNone) fault = check_endpoints(facts);
  if (fault == Fault::kNone) fault = check_sequences(datagram, facts, source, now);
  if (fault != Fault::kNone) return fault;
  if (Participant* const sender = participants_.find(facts.sender)) sender->passed(now);
  if (whole_samples_) keep_from_mixed(datagram, facts);
  return Fault::kNone;
}

/// Secured submessages are signed, so they stay as they are.
void Guard::keep_from_mixed(std::span<const std::uint8_t> datagram, const MessageFacts& facts) {
  if (options_.receiver.secured || datagram.size() > 65536) return;
  if (facts.fragment_count == 0 && !facts.for_another && !whole_samples_->awaits(facts.sender)) return;
  rewritten_ = whole_samples_->rewrite(datagram, {rewritten_octets_.get(), kRewrittenBytes});
}

/// A participant's own sockets have a budget of their own, which strangers cannot use up.
Fault Guard::check_rate(const MessageFacts& facts, const Source& source, core::Nanoseconds now) {
  Participant* const known = participants_.find(facts.sender);
  const bool passes = known != nullptr && known->owns(source)
                          ? known->discovery().take(now)
                          : participants_.admits_stranger(source.address, now);
  return passes ? Fault::kNone : Fault::kRate;
}

/// Discovery servers may have said that a participant left which was only cut off, and goes on sending.
Fault Guard::check_unannounced(const MessageFacts& facts, const Source& source, core::Nanoseconds now) {
  const bool passes = options_.relayed || participants_.find(facts.sender) != nullptr ||
                      participants_.admits_unannounced(source.address, now);
  return passes ? Fault::kNone : Fault::kUnannounced;
}

Fault Guard::check_participants(const MessageFacts& facts, const Source& source, core::Nanoseconds now) {
  bool departs = false;
  for (const ParticipantFact& fact : std::span(facts.participants.data(), facts.participant_count)) {
    if (!options_.relayed && fact.announced != facts.sender) return Fault::kIdentity;
    if (fact.departs) {
      departs = true;
      if (const Fault fault = check_departure(fact, source, now); fault != Fault::kNone) return fault;
      continue;
    }
    Participant* const participant = participants_.add(fact.announced, source, now);
    if (participant == nullptr) return Fault::kParticipants;
    if (options_.relayed) {
      participant->hear(source, now);
    } else if (!participant->hear(source, now)) {
      return Fault::kIdentity;
    }
    participant->lease(core::from_seconds(fact.lease_s));
  }
  // Who departs has not spoken by that: it may be somebody else's message.
  if (departs || facts.participant_count > 0) return Fault::kNone;
  Participant* const sender = participants_.find(facts.sender);
  const bool own = sender == nullptr || sender->hear(source, now) || options_.relayed;
  return own ? Fault::kNone : Fault::kIdentity;
}

bool Guard::is_leaving(const GuidPrefix& prefix, core::Nanoseconds now) {
  if (!options_.forgets_by_silence) return false;
  Participant* const participant = participants_.find(prefix);
  if (participant == nullptr) return false;
  returned_ = participant->is_lost();
  if (returned_) participant->leave(now);
  if (!participant->has_left()) return false;
  if (!participant->forgotten(kForgetting, now)) return true;
  participants_.remove(prefix);
  return false;
}

bool Guard::has_lapsed(const GuidPrefix& prefix, core::Nanoseconds now) {
  if (!options_.receiver.unchecked_leases) return false;
  const Participant* const participant = participants_.find(prefix);
  if (participant == nullptr || !participant->lapsed(now)) return false;
  participants_.remove(prefix);
  return true;
}

std::vector<GuidPrefix> Guard::take_lapsed(core::Nanoseconds now) {
  return options_.receiver.unchecked_leases ? participants_.take_lapsed(now) : std::vector<GuidPrefix>{};
}

void Guard::lost(const GuidPrefix& prefix) {
  if (Participant* const participant = participants_.find(prefix)) participant->lose();
}

void Guard::leaves(const GuidPrefix& prefix, core::Nanoseconds now) {
  if (!options_.forgets_by_silence) return participants_.remove(prefix);
  if (Participant* const participant = participants_.find(prefix)) participant->leave(now);
}

Fault Guard::check_departure(const ParticipantFact& fact, const Source& source, core::Nanoseconds now) {
  Participant* const participant = participants_.find(fact.announced);
  if (participant == nullptr) return Fault::kNone;  // Fast DDS does not know it either
  if (options_.relayed || participant->owns(source)) {
    leaves(fact.announced, now);
    return Fault::kNone;
  }
  if (participant->is_held()) return Fault::kDeparture;
  participant->hold(now);
  to_hold_ = true;
  return Fault::kNone;
}

Verdict Guard::held(const GuidPrefix& prefix, core::Nanoseconds now) {
  Participant* const participant = participants_.find(prefix);
  if (participant == nullptr) return Verdict::kPass;
  if (participant->spoke_since_held()) {
    participant->release();
    return Verdict::kRefuse;
  }
  if (now - participant->held_since() < kHold) return Verdict::kHold;
  leaves(prefix, now);
  return Verdict::kPass;
}

Fault Guard::check_endpoints(const MessageFacts& facts) {
  for (const EndpointFact& fact : std::span(facts.endpoints.data(), facts.endpoint_count)) {
    if (!options_.relayed && fact.endpoint.prefix != facts.sender) return Fault::kIdentity;
    Participant* const participant = participants_.find(fact.endpoint.prefix);
    if (participant == nullptr) continue;  // Fast DDS takes nothing from it
    if (fact.departs) {
      participant->remove_endpoint(fact.endpoint.entity);
    } else if (!participant->add_endpoint(fact.endpoint.entity, options_.endpoints_per_participant)) {
      return Fault::kEndpoints;
    }
  }
  return Fault::kNone;
}

/// Discovery servers announce a participant once, and may have said that it left while it was cut off.
Participant* Guard::speaker(const GuidPrefix& prefix, const Source& source, core::Nanoseconds now) {
  return options_.relayed ? participants_.add(prefix, source, now) : participants_.find(prefix);
}

/// HEARTBEATs and GAPs of one that is not known, as of one that has just left, are hidden: Fast DDS, which
/// believes fewer departures than the guard, may still know it.
Fault Guard::check_sequences(std::span<std::uint8_t> datagram, const MessageFacts& facts,
                             const Source& source, core::Nanoseconds now) {
  for (const SequenceFact& fact : std::span(facts.sequences.data(), facts.sequence_count)) {
    Participant* const participant = speaker(fact.writer.prefix, source, now);
    if (participant == nullptr) {
      blank(datagram, fact.place);
      continue;
    }
    participant->forget_samples_after_lease(now);
    WriterSamples* const known =
        participant->samples_of(fact.writer.entity, options_.endpoints_per_participant);
    if (known == nullptr) return Fault::kEndpoints;
    if (fact.first == 0) {
      const GapCost gap = cost_of(fact, *known);
      if (!participants_.admits_repeating(source.address, gap.repeated, now)) {
        blank(datagram, fact.place);  // it will be told again
        continue;
      }
      if (gap.fresh > 0.0 && !participants_.admits_counting(*participant, source.address, gap.fresh, now))
        return Fault::kCounting;
      known->missing_to = gap.missing_to;
      continue;
    }
    const std::int64_t step = fact.first - known->first;
    if (step <= 0) continue;
    if (step > longest_step(fact.writer.entity)) return Fault::kCounting;
    if (!participants_.admits_counting(*participant, source.address, static_cast<double>(step), now))
      return Fault::kCounting;
    known->first = fact.first;
  }
  return Fault::kNone;
}

Fault Guard::check_fragments(std::span<std::uint8_t> datagram, const MessageFacts& facts,
                             const Source& source, core::Nanoseconds now) {
  for (const FragmentFact& fragment : std::span(facts.fragments.data(), facts.fragment_count)) {
    if (fragment.built_in) {
      if (const Fault fault = assemble(datagram, fragment, facts.vendor, source, now); fault != Fault::kNone)
        return fault;
      continue;
    }
    if (fragment.sample_bytes > options_.sample_bytes) return Fault::kSampleSize;
    Participant* const participant = speaker(fragment.writer.prefix, source, now);
    if (participant == nullptr) return Fault::kStranger;
    if (!participant->keeps_fragment_size(fragment.writer.entity, fragment.fragment_bytes))
      return Fault::kFragmentSize;
  }
  return Fault::kNone;
}

Fault Guard::assemble(std::span<std::uint8_t> datagram, const FragmentFact& fragment, std::uint16_t vendor,
                      const Source& source, core::Nanoseconds now) {
  bool refused = false;
  const std::span<std::uint8_t> payload = assembly_.add(datagram, fragment, now, refused);
  if (refused) return Fault::kSampleSize;
  blank(datagram, fragment.place);
  if (payload.empty()) return Fault::kNone;
  if (assembled_count_ == kMaxAssembled) return Fault::kFragment;
  const std::span<std::uint8_t> into(assembled_octets_.get() + assembled_count_ * kAssembledBytes,
                                     kAssembledBytes);
  const std::span<std::uint8_t> message = data_message(into, fragment, vendor, payload);
  Fault fault = check_message(message, options_.receiver, *assembled_facts_);
  if (fault == Fault::kNone) fault = check_participants(*assembled_facts_, source, now);
  if (fault == Fault::kNone) fault = check_endpoints(*assembled_facts_);
  if (to_hold_) fault = Fault::kDeparture;  // nobody sends a departure in fragments
  if (fault == Fault::kNone) assembled_[assembled_count_++] = message;
  return fault;
}

}  // namespace phantom::wire
