#pragma once

#include "common/core/health.hpp"
#include "common/dds/endpoint.hpp"
#include "common/dds/stamp.hpp"

namespace phantom::dds {

/// Publishes this process's component_status: its health plus what DDS reported about each of its endpoints.
class StatusReporter {
 public:
  explicit StatusReporter(Participant& participant);
  /// Sends one sample, and tells the service manager, whose watchdog thus watches the caller's loop; call it
  /// about twice a second (and at every change of state). Not thread-safe.
  void publish(const core::Health& health);

 private:
  Participant& participant_;
  Stamper stamper_;
  Writer<msg::ComponentStatus> writer_;
  std::string host_;
};

}  // namespace phantom::dds
