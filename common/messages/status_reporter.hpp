#pragma once

#include <string>
#include <vector>

#include "common/core/health.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/publisher.hpp"

namespace phantom::messages {

/// Name of the figure that counts what was forgotten of names, addresses and the like that come from the
/// network: the maps of them are bounded.
inline constexpr const char* kForgotten = "forgotten";

/// Publishes this process's component_status: its health, that its security documents end soon, that a
/// component's readers and writers do not become known (dropped fragments of IP), the DDS
/// statistics of each of its endpoints, how much was forgotten (kForgotten, if any), and how many datagrams
/// were refused, as two figures for each reason: {"refused: REASON", count, "datagrams"} and {"refused from:
/// REASON", count, address}, the address that sent most of them, and how many at least.
class StatusReporter {
 public:
  /// `name`: in its samples, where several processes of a host are the same component; empty: the
  /// component's.
  explicit StatusReporter(dds::Participant& participant, const std::string& name = "");
  /// Counts what another participant of this process refuses, too; it outlives this object's last publish().
  void count_refusals_of(dds::Participant& other) { guarded_.push_back(&other); }
  /// Sends one sample, and notifies the service manager that this process is alive. Call it about twice a
  /// second, and at every change of state. If one of `health.loops` hangs, or a reader's callback has not
  /// returned for a second, the component is in fault whatever `health.state` says, the message says so, and
  /// the service manager is not notified that the process is alive: its watchdog thus watches the caller's
  /// loop and all of those. Not thread-safe.
  void publish(const core::Health& health);

 private:
  void add_security(core::Health& health);

  dds::Participant& participant_;
  const std::string name_;
  Publisher<ComponentStatus> publisher_;
  std::vector<dds::Participant*> guarded_;  // whose refusals are told
  core::Nanoseconds security_quiet_until_ns_ = 0;
};

}  // namespace phantom::messages
