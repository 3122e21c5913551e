#pragma once

#include "common/core/health.hpp"
#include "common/dds/endpoint.hpp"
#include "common/dds/stamp.hpp"

namespace phantom::dds {

/// Returns the name of this host, as component_status gives it.
std::string host_name();

/// Publishes this process's component_status: its health and the DDS statistics of each of its endpoints.
class StatusReporter {
 public:
  explicit StatusReporter(Participant& participant);
  /// Sends one sample, and notifies the service manager that this process is alive. Call it about twice a
  /// second, and at every change of state. If one of `health.loops` hangs, or a reader's callback has not
  /// returned for a second, the component is in fault whatever `health.state` says, the message says so, and
  /// the service manager is not notified that the process is alive: its watchdog thus watches the caller's
  /// loop and all of those. Not thread-safe.
  void publish(const core::Health& health);

 private:
  Participant& participant_;
  Stamper stamper_;
  Writer<msg::ComponentStatus> writer_;
  std::string host_;
};

}  // namespace phantom::dds
