#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/dds/admission/handshake_watch.hpp"
#include "common/dds/arbitration/announcements.hpp"
#include "common/dds/arbitration/discovery.hpp"
#include "common/dds/arbitration/discovery_gaps.hpp"
#include "common/dds/arbitration/endpoint_loss_monitor.hpp"
#include "common/dds/endpoints/outbox.hpp"
#include "common/dds/recovery/lease_monitor.hpp"

namespace phantom::dds {

/// Lets two participants discover each other again where Fast DDS 2.9.1 would leave them apart for ever. This
/// happens when one has forgotten the other but not the other way round, or when both forget at different
/// times (an outage about as long as the lease, a process that did not run for a while).
///
/// On a secured site, the participant that forgot begins a handshake. The other ignores it; it keeps hearing
/// its peer, so it never forgets it (HandshakeWatch).
///
/// The participant that forgot also learns only some, or none, of the other's readers and writers. The other
/// takes them for known if its heartbeat arrives before the first request (ReaderProxy::acked_changes_set). A
/// peer that is rediscovered while its loss is still being processed loses the endpoints that have just
/// been matched (PDP::remove_remote_participant). A participant that knew a peer's endpoints before sees that
/// some are missing (EndpointLossMonitor).
///
/// The participant that notices takes leave of the other alone (departure.hpp), so that both restart
/// discovery. No other participant notices, and no endpoint of this process is touched.
///
/// Fast DDS 3 leaves secured participants apart in the same way. It reports a participant only once that has
/// authenticated, so that Announcements tell of one that has not.
///
/// Private to common/dds. It passes every event on to `next`.
class RediscoveryManager : public DiscoveryEvents {
 public:
  /// `outbox`, `announcements`, `gaps`, `leases`: of the participant's transport.
  RediscoveryManager(std::string component, bool secured, std::shared_ptr<Outbox> outbox,
                     std::shared_ptr<Announcements> announcements, std::shared_ptr<DiscoveryGaps> gaps,
                     std::shared_ptr<LeaseMonitor> leases, std::shared_ptr<DiscoveryEvents> next);
  ~RediscoveryManager() override;
  /// Starts the thread. Call it once, with the participant's own GUID, when the participant has been created.
  void start(const fast_dds::rtps::GUID_t& own);
  /// Ends the thread. Call it before the participant is deleted; it may be called twice.
  void stop();
  /// Takes leave of `peer`, so that it forgets this participant, too, and both know nothing of each other
  /// when they meet again. Thread-safe.
  void leave(const GuidPrefix& peer);
  /// Returns a sentence about a component of whose readers and writers some have been missing for
  /// kHalfKnown; empty if there is none. Thread-safe.
  std::string half_known() const;
  static constexpr core::Nanoseconds kHalfKnown = 12 * core::kNsPerSecond;
  /// Returns how many lost participants were forgotten for others. Thread-safe.
  std::uint64_t forgotten() const;

  void on_participant(const FoundParticipant& participant) override;
  void on_authentication(const fast_dds::rtps::GUID_t& guid, bool admitted) override;
  void on_endpoint(const FoundEndpoint& endpoint) override;

 private:
  struct Peer {
    std::string name;
    fast_dds::rtps::LocatorList_t addresses;  // UDP, where it listens for announcements
    bool reported = true;                     // by Fast DDS; else it was seen to announce itself
  };
  static std::string address_of(const Peer& peer);
  static Peer at(const wire::Source& listens);
  void take(const FoundParticipant& participant);
  void run();
  void log_half_known(core::Nanoseconds now);
  void admit(const GuidPrefix& prefix, core::Nanoseconds now);
  void look_at_announcements(core::Nanoseconds now);
  /// Sends the departure message to `peer`. Returns the peer's name and address, for a log message.
  std::string take_leave(const GuidPrefix& peer, const Peer& known) const;
  void restart(const HandshakeWatch::Attempt& attempt, const Peer& peer) const;
  void restart(const EndpointLossMonitor::Attempt& attempt, const Peer& peer) const;

  const std::string component_;
  const bool secured_;
  const std::shared_ptr<Outbox> outbox_;
  const std::shared_ptr<Announcements> announcements_;  // null: Fast DDS reports who announces itself
  const std::shared_ptr<DiscoveryGaps> gaps_;           // null: not seen
  const std::shared_ptr<LeaseMonitor> leases_;          // null: Fast DDS judges leases
  const std::shared_ptr<DiscoveryEvents> next_;
  mutable std::mutex mutex_;
  std::condition_variable stopped_;
  bool stop_ = false;
  HandshakeWatch handshakes_;
  EndpointLossMonitor ends_;
  std::map<GuidPrefix, Peer> peers_;
  core::Nanoseconds half_known_quiet_until_ns_ = 0;  // the thread's
  GuidPrefix own_{};                                 // set by start()
  std::thread thread_;
};

}  // namespace phantom::dds
