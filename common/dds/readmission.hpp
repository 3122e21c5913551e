#pragma once

#include <condition_variable>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/dds/ends_watch.hpp"
#include "common/dds/handshake_watch.hpp"

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
/// some are missing (EndsWatch).
///
/// The participant that notices takes leave of the other alone (departure.hpp), so that both restart
/// discovery. No other participant notices, and no endpoint of this process is touched.
///
/// Private to common/dds: the listener of a participant. It passes every callback on to `next`.
class Readmission : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  /// Throws DdsError if no socket can be opened.
  Readmission(std::string component, bool secured,
              std::shared_ptr<eprosima::fastdds::dds::DomainParticipantListener> next);
  ~Readmission() override;
  /// Starts the thread. Call it once, with the participant's own GUID, when the participant has been created.
  void start(const eprosima::fastrtps::rtps::GUID_t& own);
  /// Ends the thread. Call it before the participant is deleted; it may be called twice.
  void stop();

  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;
  void onParticipantAuthentication(eprosima::fastdds::dds::DomainParticipant* participant,
                                   eprosima::fastrtps::rtps::ParticipantAuthenticationInfo&& info) override;
  void on_subscriber_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& info) override;
  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override;

 private:
  struct Peer {
    std::string name;
    std::vector<eprosima::fastrtps::rtps::Locator_t> addresses;  // UDP, where it listens for announcements
  };
  void run(const GuidPrefix& own);
  /// Sends the departure message to `peer`. Returns the peer's name and address, for a log message.
  std::string take_leave(const GuidPrefix& own, const GuidPrefix& peer, const Peer& known) const;
  void begin_anew(const GuidPrefix& own, const HandshakeWatch::Attempt& attempt, const Peer& peer) const;
  void begin_anew(const GuidPrefix& own, const EndsWatch::Attempt& attempt, const Peer& peer) const;
  void end_changed(const eprosima::fastrtps::rtps::GUID_t& guid, bool discovered, bool removed);

  const std::string component_;
  const bool secured_;
  const std::shared_ptr<eprosima::fastdds::dds::DomainParticipantListener> next_;
  const int socket_;
  std::mutex mutex_;
  std::condition_variable stopped_;
  bool stop_ = false;
  HandshakeWatch handshakes_;
  EndsWatch ends_;
  std::map<GuidPrefix, Peer> peers_;
  std::thread thread_;
};

}  // namespace phantom::dds
