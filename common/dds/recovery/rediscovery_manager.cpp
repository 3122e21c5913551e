#include "common/dds/recovery/rediscovery_manager.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "common/core/thread_config.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/security.hpp"
#include "common/dds/recovery/departure.hpp"

namespace phantom::dds {
namespace {

namespace rtps = fast_dds::rtps;

constexpr std::chrono::seconds kLookPeriod{1};
constexpr core::Nanoseconds kHalfKnownLogPeriod_ns = 60 * core::kNsPerSecond;

rtps::Locator_t locator_of(const wire::Source& address) {
  rtps::Locator_t locator(LOCATOR_KIND_UDPv4, address.port);
  const std::uint32_t octets = address.address;
  rtps::IPLocator::setIPv4(locator, static_cast<rtps::octet>(octets >> 24),
                           static_cast<rtps::octet>(octets >> 16), static_cast<rtps::octet>(octets >> 8),
                           static_cast<rtps::octet>(octets));
  return locator;
}

}  // namespace

RediscoveryManager::RediscoveryManager(std::string component, bool secured, std::shared_ptr<Outbox> outbox,
                                       std::shared_ptr<Announcements> announcements,
                                       std::shared_ptr<DiscoveryGaps> gaps,
                                       std::shared_ptr<LeaseMonitor> leases,
                                       std::shared_ptr<DiscoveryEvents> next)
    : component_(std::move(component)),
      secured_(secured),
      outbox_(std::move(outbox)),
      announcements_(std::move(announcements)),
      gaps_(std::move(gaps)),
      leases_(std::move(leases)),
      next_(std::move(next)),
      ends_(secured ? EndpointLossMonitor::kPatienceIfSecured : EndpointLossMonitor::kPatience) {}

RediscoveryManager::~RediscoveryManager() { stop(); }

void RediscoveryManager::start(const rtps::GUID_t& own) {
  {
    const std::lock_guard lock(mutex_);
    own_ = prefix_of(own);
  }
  thread_ = std::thread([this] {
    core::apply_thread_config(core::ThreadRole::kReadmission);
    run();
  });
}

void RediscoveryManager::leave(const GuidPrefix& peer) {
  const std::lock_guard lock(mutex_);
  if (const auto known = peers_.find(peer); known != peers_.end()) take_leave(peer, known->second);
}

void RediscoveryManager::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  stopped_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::uint64_t RediscoveryManager::forgotten() const {
  const std::lock_guard lock(mutex_);
  return ends_.forgotten();
}

std::string RediscoveryManager::half_known() const {
  if (!gaps_) return "";
  const core::Nanoseconds now = core::monotonic_ns();
  const auto incomplete = gaps_->incomplete(now - kHalfKnown);
  if (incomplete.empty()) return "";
  const std::lock_guard lock(mutex_);
  for (const DiscoveryGaps::Incomplete& one : incomplete) {
    const auto peer = peers_.find(one.participant);
    if (peer == peers_.end()) continue;
    return fmt::format(
        "some readers and writers of {} at {} have not become known for {:.0f} s: a firewall or tunnel may "
        "drop IP fragments; phantom-doctor tries it",
        peer->second.name, address_of(peer->second), core::seconds(now - one.since));
  }
  return "";
}

void RediscoveryManager::log_half_known(core::Nanoseconds now) {
  if (now < half_known_quiet_until_ns_) return;
  const std::string sentence = half_known();
  if (sentence.empty()) return;
  spdlog::warn("{}: {}", component_, sentence);
  half_known_quiet_until_ns_ = now + kHalfKnownLogPeriod_ns;
}

void RediscoveryManager::on_participant(const FoundParticipant& participant) {
  leases_ ? take(leases_->judged(participant)) : take(participant);
}

void RediscoveryManager::take(const FoundParticipant& participant) {
  const GuidPrefix prefix = prefix_of(participant.guid);
  {
    const std::lock_guard lock(mutex_);
    const core::Nanoseconds now = core::monotonic_ns();
    if (participant.event == Discovered::kFound) {
      // The name is not trusted: any participant can choose its own.
      Peer peer{identity_name(participant.name), {}};
      for (const rtps::Locator_t& locator : participant.announcements) {
        if (locator.kind == LOCATOR_KIND_UDPv4) peer.addresses.push_back(locator);
      }
      peers_[prefix] = std::move(peer);
      if (announcements_) {
        admit(prefix, now);  // else Fast DDS would not have reported it
      } else if (secured_) {
        handshakes_.discovered(prefix, now);
      } else {
        ends_.discovered(prefix, now);
      }
    } else if (participant.event != Discovered::kChanged) {
      if (gaps_) gaps_->forget(prefix);
      bool gone = ends_.left(prefix, now);
      if (secured_ && (gone || !announcements_)) gone = handshakes_.left(prefix, now);
      if (gone) peers_.erase(prefix);
      if (gone && announcements_ && participant.event == Discovered::kLost) announcements_->lose(prefix);
    }
  }
  if (next_) next_->on_participant(participant);
}

void RediscoveryManager::admit(const GuidPrefix& prefix, core::Nanoseconds now) {
  ends_.discovered(prefix, now);
  if (const int attempts = handshakes_.admitted(prefix); attempts > 0)
    spdlog::info("{}: {} is authenticated, after its handshake was restarted {}", component_,
                 peers_[prefix].name, attempts == 1 ? "once" : std::to_string(attempts) + " times");
}

RediscoveryManager::Peer RediscoveryManager::at(const wire::Source& listens) {
  Peer peer{{}, {}, false};
  if (listens.port != 0) peer.addresses.push_back(locator_of(listens));
  return peer;
}

/// Takes leave of who was lost and has returned, and watches the handshake of everybody who announces itself
/// and is not reported. Needs the lock.
void RediscoveryManager::look_at_announcements(core::Nanoseconds now) {
  for (const auto& [prefix, listens] : announcements_->take_returned()) take_leave(prefix, at(listens));
  std::set<GuidPrefix> present;
  for (const auto& [prefix, listens] : announcements_->present(now)) {
    if (prefix == own_) continue;
    present.insert(prefix);
    if (peers_.contains(prefix)) continue;
    peers_.emplace(prefix, at(listens));
    handshakes_.discovered(prefix, now);
  }
  std::erase_if(peers_, [&](const auto& each) {
    const bool gone = !each.second.reported && !present.contains(each.first);
    if (gone) handshakes_.left(each.first, now);
    return gone;
  });
}

void RediscoveryManager::on_authentication(const rtps::GUID_t& guid, bool admitted) {
  // A refusal may be the answer to half of a handshake from before the outage, so the watch continues.
  if (admitted && !announcements_) {
    const std::lock_guard lock(mutex_);
    admit(prefix_of(guid), core::monotonic_ns());
  }
  if (next_) next_->on_authentication(guid, admitted);
}

void RediscoveryManager::on_endpoint(const FoundEndpoint& endpoint) {
  {
    const GuidPrefix prefix = prefix_of(endpoint.guid);
    const EndpointLossMonitor::End end = endpoint.guid.entityId.to_uint32();
    const std::lock_guard lock(mutex_);
    const core::Nanoseconds now = core::monotonic_ns();
    if (endpoint.event == Discovered::kFound) ends_.end_discovered(prefix, end, now);
    if (endpoint.event == Discovered::kLeft) ends_.end_removed(prefix, end, now);
  }
  if (next_) next_->on_endpoint(endpoint);
}

void RediscoveryManager::run() {
  std::unique_lock lock(mutex_);
  while (!stopped_.wait_for(lock, kLookPeriod, [this] { return stop_; })) {
    const core::Nanoseconds now = core::monotonic_ns();
    if (announcements_) look_at_announcements(now);
    if (leases_) {
      lock.unlock();  // Fast DDS reports who is forgotten, to on_participant()
      leases_->look();
      lock.lock();
    }
    for (const auto& [prefix, peer] : peers_) outbox_->keep(peer.addresses);
    const auto handshakes = handshakes_.overdue(own_, now);
    const auto ends = ends_.overdue(own_, now);
    const auto peers = handshakes.empty() && ends.empty() ? decltype(peers_)() : peers_;
    lock.unlock();  // the log may block this thread, but must not block those of Fast DDS
    const auto known = [&](const GuidPrefix& peer) {
      const auto found = peers.find(peer);
      return found == peers.end() ? Peer{} : found->second;
    };
    for (const auto& attempt : handshakes) restart(attempt, known(attempt.peer));
    for (const auto& attempt : ends) restart(attempt, known(attempt.peer));
    log_half_known(now);
    lock.lock();
  }
}

std::string RediscoveryManager::address_of(const Peer& peer) {
  return peer.addresses.empty() ? "unknown" : rtps::IPLocator::ip_to_string(*peer.addresses.begin());
}

std::string RediscoveryManager::take_leave(const GuidPrefix& peer, const Peer& known) const {
  outbox_->put(departure(own_, peer, kDepartureSequence), known.addresses);
  return (known.name.empty() ? "somebody" : known.name) + " at " + address_of(known);
}

void RediscoveryManager::restart(const HandshakeWatch::Attempt& attempt, const Peer& peer) const {
  const std::string who = take_leave(attempt.peer, peer);
  spdlog::warn(
      "{}: {} announces itself, but has not authenticated for {:.0f} s; "
      "restarting its handshake (attempt {}). It is ignored until that succeeds; "
      "if this repeats, check its documents, and by phantom-doctor whether IP fragments pass.",
      component_, who, core::seconds(attempt.waited_ns), attempt.number);
}

void RediscoveryManager::restart(const EndpointLossMonitor::Attempt& attempt, const Peer& peer) const {
  const std::string who = take_leave(attempt.peer, peer);
  spdlog::warn(
      "{}: {} was lost and has returned, but {} of its readers and writers are unknown; "
      "restarting discovery with it (attempt {})",
      component_, who, attempt.missing, attempt.number);
}

}  // namespace phantom::dds
