#include "common/dds/readmission.hpp"

#include <arpa/inet.h>
#include <fastrtps/utils/IPLocator.h>
#include <netinet/in.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>

#include "common/core/thread_place.hpp"
#include "common/dds/departure.hpp"
#include "common/dds/participant_impl.hpp"
#include "common/dds/security.hpp"

namespace phantom::dds {
namespace {

namespace edds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

constexpr std::chrono::seconds kLookPeriod{1};
// Greater than an announcement's sequence number, which counts how often its content has changed. A peer
// forgets the number together with the participant.
constexpr std::uint32_t kDepartureSequence = 1 << 20;

sockaddr_in socket_address(const rtps::Locator_t& locator) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(locator.port));
  std::copy_n(rtps::IPLocator::getIPv4(locator), 4, reinterpret_cast<std::uint8_t*>(&address.sin_addr));
  return address;
}

}  // namespace

Readmission::Readmission(std::string component, bool secured,
                         std::shared_ptr<edds::DomainParticipantListener> next)
    : component_(std::move(component)),
      secured_(secured),
      next_(std::move(next)),
      socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)),
      ends_(secured ? EndsWatch::kPatienceIfSecured : EndsWatch::kPatience) {
  if (socket_ < 0) throw DdsError("no UDP socket could be opened: " + std::generic_category().message(errno));
}

Readmission::~Readmission() {
  stop();
  close(socket_);
}

void Readmission::start(const rtps::GUID_t& own) {
  thread_ = std::thread([this, prefix = prefix_of(own)] {
    core::take_place(core::ThreadRole::kReadmission);
    run(prefix);
  });
}

void Readmission::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  stopped_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Readmission::on_participant_discovery(edds::DomainParticipant* participant,
                                           rtps::ParticipantDiscoveryInfo&& info) {
  using Status = rtps::ParticipantDiscoveryInfo;
  const GuidPrefix prefix = prefix_of(info.info.m_guid);
  {
    const std::lock_guard lock(mutex_);
    const core::Nanoseconds now = core::monotonic_ns();
    if (info.status == Status::DISCOVERED_PARTICIPANT) {
      // The name is not trusted: any participant can choose its own.
      Peer peer{identity_name(info.info.m_participantName.to_string()), {}};
      for (const rtps::Locator_t& locator : info.info.metatraffic_locators.unicast) {
        if (locator.kind == LOCATOR_KIND_UDPv4) peer.addresses.push_back(locator);
      }
      peers_[prefix] = std::move(peer);
      if (secured_) {
        handshakes_.discovered(prefix, now);
      } else {
        ends_.discovered(prefix, now);
      }
    } else if (info.status != Status::CHANGED_QOS_PARTICIPANT) {
      bool gone = ends_.left(prefix, now);
      if (secured_) gone = handshakes_.left(prefix, now);
      if (gone) peers_.erase(prefix);
    }
  }
  if (next_) next_->on_participant_discovery(participant, std::move(info));
}

void Readmission::onParticipantAuthentication(edds::DomainParticipant* participant,
                                              rtps::ParticipantAuthenticationInfo&& info) {
  // A refusal may be the answer to half of a handshake from before the outage, so the watch continues.
  if (info.status == rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT) {
    const GuidPrefix prefix = prefix_of(info.guid);
    const std::lock_guard lock(mutex_);
    ends_.discovered(prefix, core::monotonic_ns());
    if (const int attempts = handshakes_.admitted(prefix); attempts > 0)
      spdlog::info("{}: {} is admitted, after its handshake was begun anew {}", component_,
                   peers_[prefix].name, attempts == 1 ? "once" : std::to_string(attempts) + " times");
  }
  if (next_) next_->onParticipantAuthentication(participant, std::move(info));
}

void Readmission::on_subscriber_discovery(edds::DomainParticipant* participant,
                                          rtps::ReaderDiscoveryInfo&& info) {
  using Status = rtps::ReaderDiscoveryInfo;
  end_changed(info.info.guid(), info.status == Status::DISCOVERED_READER,
              info.status == Status::REMOVED_READER);
  if (next_) next_->on_subscriber_discovery(participant, std::move(info));
}

void Readmission::on_publisher_discovery(edds::DomainParticipant* participant,
                                         rtps::WriterDiscoveryInfo&& info) {
  using Status = rtps::WriterDiscoveryInfo;
  end_changed(info.info.guid(), info.status == Status::DISCOVERED_WRITER,
              info.status == Status::REMOVED_WRITER);
  if (next_) next_->on_publisher_discovery(participant, std::move(info));
}

void Readmission::end_changed(const rtps::GUID_t& guid, bool discovered, bool removed) {
  const GuidPrefix prefix = prefix_of(guid);
  const EndsWatch::End end = guid.entityId.to_uint32();
  const std::lock_guard lock(mutex_);
  const core::Nanoseconds now = core::monotonic_ns();
  if (discovered) ends_.end_discovered(prefix, end, now);
  if (removed) ends_.end_removed(prefix, end, now);
}

void Readmission::run(const GuidPrefix& own) {
  std::unique_lock lock(mutex_);
  while (!stopped_.wait_for(lock, kLookPeriod, [this] { return stop_; })) {
    const core::Nanoseconds now = core::monotonic_ns();
    const auto handshakes = handshakes_.overdue(own, now);
    const auto ends = ends_.overdue(own, now);
    const auto peers = handshakes.empty() && ends.empty() ? decltype(peers_)() : peers_;
    lock.unlock();  // the log may block this thread, but must not block those of Fast DDS
    const auto known = [&](const GuidPrefix& peer) {
      const auto found = peers.find(peer);
      return found == peers.end() ? Peer{} : found->second;
    };
    for (const auto& attempt : handshakes) begin_anew(own, attempt, known(attempt.peer));
    for (const auto& attempt : ends) begin_anew(own, attempt, known(attempt.peer));
    lock.lock();
  }
}

std::string Readmission::take_leave(const GuidPrefix& own, const GuidPrefix& peer, const Peer& known) const {
  char text[INET_ADDRSTRLEN] = "unknown";
  const std::vector<std::uint8_t> message = departure(own, peer, kDepartureSequence);
  for (const rtps::Locator_t& locator : known.addresses) {
    const sockaddr_in address = socket_address(locator);
    inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
    // A lost message is sent again at the next attempt.
    [[maybe_unused]] const auto sent = sendto(socket_, message.data(), message.size(), 0,
                                              reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
  return (known.name.empty() ? "somebody" : known.name) + " at " + text;
}

void Readmission::begin_anew(const GuidPrefix& own, const HandshakeWatch::Attempt& attempt,
                             const Peer& peer) const {
  const std::string who = take_leave(own, attempt.peer, peer);
  spdlog::warn(
      "{}: {} announces itself, but has not shown for {:.0f} s who it is; "
      "its handshake is begun anew (attempt {}). It is not spoken with until it succeeds; "
      "if it goes on, check its documents.",
      component_, who, core::seconds(attempt.waited_ns), attempt.number);
}

void Readmission::begin_anew(const GuidPrefix& own, const EndsWatch::Attempt& attempt,
                             const Peer& peer) const {
  const std::string who = take_leave(own, attempt.peer, peer);
  spdlog::warn(
      "{}: {} was lost and has returned, but {} of its readers and writers are not known again; "
      "discovery with it is begun anew (attempt {})",
      component_, who, attempt.missing, attempt.number);
}

}  // namespace phantom::dds
