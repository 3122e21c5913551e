#pragma once

#include <memory>
#include <string>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/core/snapshot.hpp"
#include "common/core/stop_requests.hpp"
#include "common/messages/arm_bounds.hpp"
#include "components/slave_io/slave_io.hpp"

namespace phantom::slave_io {

/// What one tick leaves for the topic slave_state, and for who tells how the controller is.
struct SlaveReport : messages::SlaveState {
  SlaveOutputs outputs;
  std::uint32_t stop_requests = 0;  ///< of the inbox, that are in force
};

/// What comes from the topics, validated. The servo thread is the reader.
struct Inbox {
  core::Snapshot<MasterSample> master;
  core::StopRequests stops;
};

/// slave_io's ends of the topics. Stamps, and refuses what is invalid or out of order. Never used by the
/// servo thread.
class DdsAdapter {
 public:
  /// `arm`: that the master must command. Throws DdsError. `inbox` must outlive the adapter.
  DdsAdapter(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox);
  ~DdsAdapter();

  void publish(const SlaveReport& report);
  void publish_health(const core::Health& health);
  /// Asks everyone else to stop, as this slave did; `issuer` for the logs. The thread that publishes.
  void announce_stop(const std::string& issuer);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::slave_io
