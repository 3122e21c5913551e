#include "common/dds/admission/guarded_transport.hpp"

#include <atomic>
#include <cstring>
#include <mutex>
#include <optional>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/recovery/departure.hpp"

namespace phantom::dds {
namespace {

namespace rtps = fast_dds::rtps;

wire::Source source_of(const rtps::Locator_t& locator) {
  const rtps::octet* address = rtps::IPLocator::getIPv4(locator);
  return {static_cast<std::uint32_t>(address[0]) << 24 | static_cast<std::uint32_t>(address[1]) << 16 |
              static_cast<std::uint32_t>(address[2]) << 8 | address[3],
          static_cast<std::uint16_t>(rtps::IPLocator::getPhysicalPort(locator))};
}

/// A departure that is held until it is clear whether its participant still speaks.
struct Held {
  wire::GuidPrefix participant;
  std::vector<std::uint8_t> datagram;
  rtps::TransportReceiverInterface* above;
  rtps::Locator_t local, remote;
};

/// A receiving thread's own memory.
struct Receiving {
  wire::MessageFacts facts;
  std::vector<std::vector<std::uint8_t>> assembled;  // handed on after the lock is released
  std::vector<Held> due;
  std::vector<std::uint8_t> with_slack;
  std::size_t rewritten_bytes = 0;  // of what stands in `with_slack` in place of the datagram; 0: nothing
  bool of_discovery = false;        // what the datagram holds, whatever port it came in by
};

Receiving& receiving() {
  thread_local Receiving memory;
  return memory;
}

class GuardedTransport final : public fast_dds::MessageTransport {
 public:
  explicit GuardedTransport(const GuardedTransportDescriptor& descriptor)
      : MessageTransport(descriptor), descriptor_(descriptor), guard_(descriptor.guard) {
    if (descriptor_.leases != nullptr) descriptor_.leases->attach([this] { look_at_leases(); });
  }
  ~GuardedTransport() override {
    if (descriptor_.leases != nullptr) descriptor_.leases->attach({});
  }

  rtps::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }

  bool OpenOutputChannel(rtps::SendResourceList& senders, const rtps::Locator_t& locator) override {
    const bool opened = MessageTransport::OpenOutputChannel(senders, locator);
    if (opened) descriptor_.outbox->opened(locator);
    return opened;
  }

  bool send_on(rtps::SenderResource& below, const fast_dds::OutgoingMessage& message) override {
    const bool sent = message.send_by(below);
    descriptor_.outbox->send_by(below);
    return sent;
  }

  void receive(rtps::TransportReceiverInterface* above, const rtps::octet* message, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    const bool discovery = rtps::IPLocator::getPhysicalPort(local) % 2 == 0;
    // The octets are those of the socket's own buffer, of this thread alone.
    const std::span<std::uint8_t> datagram(const_cast<rtps::octet*>(message), size);
    Receiving& memory = receiving();
    memory.assembled.clear();
    memory.due.clear();
    memory.of_discovery = false;
    memory.rewritten_bytes = 0;
    const wire::Source source = source_of(remote);
    const bool pass = admit(datagram, source, discovery, {above, local, remote}, memory);
    const auto lock =
        discovery || memory.of_discovery ? std::unique_lock(discovery_) : std::unique_lock<std::mutex>();
    if (discovery) {
      discovered_by_.emplace(Inlet{above, local, remote});
      have_forgotten();
    }
    if (pass) forward(datagram, above, local, remote, memory);
    for (const auto& whole : memory.assembled)
      above->OnDataReceived(whole.data(), static_cast<std::uint32_t>(whole.size()), local, remote);
    for (const Held& held : memory.due)
      held.above->OnDataReceived(held.datagram.data(), static_cast<std::uint32_t>(held.datagram.size()),
                                 held.local, held.remote);
  }

 private:
  static constexpr std::size_t kMaxHeld = 16;
  static constexpr GuidPrefix kWhoeverReads{};
  struct Inlet {
    rtps::TransportReceiverInterface* above;
    rtps::Locator_t local, remote;
  };
  struct Way {
    rtps::TransportReceiverInterface* above;
    const rtps::Locator_t &local, &remote;
  };

  /// Returns whether the datagram is handed on; fills what else is.
  bool admit(std::span<std::uint8_t> datagram, const wire::Source& source, bool discovery, const Way& way,
             Receiving& memory) {
    const auto refuse = [&](wire::Fault fault) {
      descriptor_.refused->add(fault, source);
      return false;
    };
    if (!guard_.admits(source)) return refuse(wire::Fault::kSource);
    if (const wire::Fault fault = wire::check_message(datagram, descriptor_.guard.receiver, memory.facts);
        fault != wire::Fault::kNone)
      return refuse(fault);
    if (descriptor_.bans->holds(memory.facts.sender)) return refuse(wire::Fault::kFlood);
    const std::lock_guard lock(guarding_);
    const core::Nanoseconds now = core::monotonic_ns();
    release_held(way, now, memory);
    memory.of_discovery = memory.facts.of_discovery();
    if (descriptor_.announcements != nullptr) {
      for (const GuidPrefix& lost : descriptor_.announcements->take_lost()) guard_.lost(lost);
    }
    const wire::Fault fault =
        guard_.check(datagram, memory.facts, source, discovery || memory.of_discovery, now);
    if (guard_.returned()) descriptor_.announcements->returns(memory.facts.sender);
    if (guard_.lapsed()) descriptor_.leases->lapse(memory.facts.sender);
    if (fault != wire::Fault::kNone) return refuse(fault);
    if (descriptor_.announcements != nullptr) {
      for (std::size_t i = 0; i < memory.facts.participant_count; ++i)
        descriptor_.announcements->note(memory.facts.participants[i], now);
    }
    if (descriptor_.gaps != nullptr)
      descriptor_.gaps->note({memory.facts.discovery.data(), memory.facts.discovery_count}, now);
    if (descriptor_.leases != nullptr) {
      for (std::size_t i = 0; i < memory.facts.participant_count; ++i) {
        const wire::ParticipantFact& fact = memory.facts.participants[i];
        if (!fact.departs) descriptor_.leases->announced(fact.announced, fact.lease_s);
      }
    }
    for (const auto& whole : guard_.assembled()) memory.assembled.emplace_back(whole.begin(), whole.end());
    if (const auto rewritten = guard_.rewritten(); !rewritten.empty()) {
      std::copy(rewritten.begin(), rewritten.end(), slack(memory).begin());
      memory.rewritten_bytes = rewritten.size();
    }
    if (!guard_.to_hold()) return true;
    hold(datagram, way, memory);
    return false;
  }

  /// Finds who has lapsed, also while nothing is received. Called once a second by another thread.
  void look_at_leases() {
    {
      const std::lock_guard lock(guarding_);
      for (const GuidPrefix& lapsed : guard_.take_lapsed(core::monotonic_ns()))
        descriptor_.leases->lapse(lapsed);
    }
    const std::lock_guard lock(discovery_);
    if (discovered_by_) have_forgotten();
  }

  /// Hands Fast DDS a departure of each participant that was banned or has lapsed, so that it frees what it
  /// keeps of it. Needs the lock `discovery_`, which the inlet's receiver is used under.
  void have_forgotten() {
    const auto depart = [this](const GuidPrefix& participant) {
      const auto message = departure(participant, kWhoeverReads, kDepartureSequence);
      discovered_by_->above->OnDataReceived(message.data(), static_cast<std::uint32_t>(message.size()),
                                            discovered_by_->local, discovered_by_->remote);
    };
    for (const GuidPrefix& banned : descriptor_.bans->take_fresh()) depart(banned);
    if (descriptor_.leases == nullptr) return;
    for (const GuidPrefix& lapsed : descriptor_.leases->take_lapsed()) depart(lapsed);
  }

  void hold(std::span<const std::uint8_t> datagram, const Way& way, const Receiving& memory) {
    if (held_.size() == kMaxHeld) {
      descriptor_.refused->add(wire::Fault::kDeparture, source_of(held_.front().remote));
      held_.erase(held_.begin());
    }
    for (std::size_t i = 0; i < memory.facts.participant_count; ++i) {
      const wire::ParticipantFact& fact = memory.facts.participants[i];
      if (!fact.departs) continue;
      held_.push_back({fact.announced, {datagram.begin(), datagram.end()}, way.above, way.local, way.remote});
      return;
    }
  }

  /// Each by the way it came: only of that one it is sure that it is still open.
  void release_held(const Way& way, core::Nanoseconds now, Receiving& memory) {
    for (auto held = held_.begin(); held != held_.end();) {
      const wire::Verdict verdict =
          held->above == way.above ? guard_.held(held->participant, now) : wire::Verdict::kHold;
      if (verdict == wire::Verdict::kHold) {
        ++held;
        continue;
      }
      if (verdict == wire::Verdict::kPass) {
        memory.due.push_back(std::move(*held));
      } else {
        descriptor_.refused->add(wire::Fault::kDeparture, source_of(held->remote));
      }
      held = held_.erase(held);
    }
  }

  /// Room for a datagram, or what it was rewritten to, with Guard::kSlack octets behind it.
  static std::vector<std::uint8_t>& slack(Receiving& memory) {
    memory.with_slack.resize(3 * wire::Guard::kSlack);
    return memory.with_slack;
  }

  /// Fragments are handed on where Guard::kSlack octets behind them may be read.
  static void forward(std::span<const std::uint8_t> datagram, rtps::TransportReceiverInterface* above,
                      const rtps::Locator_t& local, const rtps::Locator_t& remote, Receiving& memory) {
    const rtps::octet* octets = datagram.data();
    std::size_t size = datagram.size();
    if (memory.rewritten_bytes > 0) {
      octets = memory.with_slack.data();
      size = memory.rewritten_bytes;
    } else if (memory.facts.fragment_count > 0) {
      std::copy(datagram.begin(), datagram.end(), slack(memory).begin());
      octets = memory.with_slack.data();
    }
    above->OnDataReceived(octets, static_cast<std::uint32_t>(size), local, remote);
  }

  GuardedTransportDescriptor descriptor_;
  std::mutex discovery_, guarding_;
  wire::Guard guard_;
  std::vector<Held> held_;
  std::optional<Inlet> discovered_by_;  // where messages of discovery came in last; needs `discovery_`
};

}  // namespace

rtps::TransportInterface* GuardedTransportDescriptor::create_transport() const {
  return new GuardedTransport(*this);
}

}  // namespace phantom::dds
