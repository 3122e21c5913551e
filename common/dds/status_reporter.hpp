#pragma once

#include "common/core/health.hpp"
#include "common/dds/endpoint.hpp"
#include "common/dds/stamp.hpp"

namespace phantom::dds {

/// Of this host, as component_status names it.
std::string host_name();

/// Publishes this process's component_status: its health plus what DDS reported about each of its endpoints.
class StatusReporter {
 public:
  explicit StatusReporter(Participant& participant);
  /// Sends one sample, and tells the service manager that this process is alive; call it about twice a second
  /// (and at every change of state). Where one of `health.loops` hangs, or a reader's callback has not
  /// returned for a second, the component is in fault whatever `health.state` says, the message says so, and
  /// the service manager is not told that the process is alive: its watchdog thus watches the caller's loop
  /// and all of those. Not thread-safe.
  void publish(const core::Health& health);

 private:
  Participant& participant_;
  Stamper stamper_;
  Writer<msg::ComponentStatus> writer_;
  std::string host_;
};

}  // namespace phantom::dds
