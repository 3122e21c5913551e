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

/// Lets two participants find each other again where Fast DDS 2.9.1 would leave them apart for ever: when one
/// has forgotten the other and the other has not, or both at different times (an outage about as long as the
/// lease, a process that stood still).
///
/// Secured, the handshake that the one begins is ignored by the other, which goes on hearing it and so never
/// forgets it (HandshakeWatch).
///
/// Of its readers and writers the one learns some or none: the other takes them for known, if its heartbeat
/// comes before the one's first request (ReaderProxy::acked_changes_set); and a peer that is discovered anew
/// while its loss is still being dealt with, loses what has just been matched
/// (PDP::remove_remote_participant). Whoever has known a peer's ends before sees that some are missing
/// (EndsWatch).
/// The one takes leave from the other, so that both begin anew. Nobody else notices, and no endpoint of this
/// process is touched.
///
/// Private to common/dds: the listener of a participant. It passes on what it hears to `next`.
class Readmission : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  /// Throws DdsError if there is no socket left.
  Readmission(std::string component, bool secured,
              std::shared_ptr<eprosima::fastdds::dds::DomainParticipantListener> next);
  ~Readmission() override;
  /// Call once, with the participant's own GUID, when it has been made; starts the thread.
  void start(const eprosima::fastrtps::rtps::GUID_t& own);
  /// Ends the thread; call it before the participant is deleted. May be called twice.
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
    std::vector<eprosima::fastrtps::rtps::Locator_t> addresses;  // where it listens for announcements; UDP
  };
  void run(const GuidPrefix& own);
  /// Returns where the peer is, for a person.
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
