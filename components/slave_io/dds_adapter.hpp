#pragma once

#include <array>
#include <memory>
#include <string>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/core/snapshot.hpp"
#include "common/core/stop_requests.hpp"
#include "components/slave_io/slave_io.hpp"

namespace phantom::slave_io {

/// What one tick leaves for the topic slave_state.
struct SlaveReport {
  SlaveOutputs outputs;
  std::uint32_t stop_requests = 0;  ///< of the inbox, that are in force
  core::SampleId followed;          ///< the master_state in force
  core::JointArray position{};      ///< encoders
  core::JointArray velocity{};
  bool force_measured = false;
  core::JointArray external_torque_Nm{};
  bool contact = false;
  double contact_force_N = 0.0;
  std::uint16_t contact_object = 0;
  std::array<double, 3> contact_point_W_m{};
  double clearance_m = -1.0;
  double tool_speed_m_s = 0.0;
};

/// What comes from the topics, validated. The servo thread is the reader.
struct Inbox {
  core::Snapshot<MasterSample> master;
  core::StopRequests stops;
};

/// What the adapter holds samples against.
struct Expectations {
  std::size_t joint_count = 0;
  core::JointArray lower{},
      upper{};  ///< joint limits; a master farther beyond them than robot::near_limits allows is not followed
};

/// slave_io's ends of the topics. Converts, stamps, refuses what is invalid or out of order. Never used by
/// the servo thread.
class DdsAdapter {
 public:
  /// Throws DdsError. `inbox` must outlive the adapter.
  DdsAdapter(const core::NetworkOptions& network, const Expectations& expectations, Inbox& inbox);
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
