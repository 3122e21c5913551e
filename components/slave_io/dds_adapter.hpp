#pragma once

#include <array>
#include <memory>
#include <string>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/core/snapshot.hpp"
#include "components/slave_io/slave_io.hpp"

namespace phantom::slave_io {

/// What one tick leaves for the topic slave_state.
struct SlaveReport {
  SlaveOutputs outputs;
  core::SampleId followed;      ///< the master_state in force
  core::JointArray position{};  ///< encoders
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

/// What comes from the topics, validated. The servo thread is the reader of both.
struct Inbox {
  core::Snapshot<MasterSample> master;
  core::Snapshot<teleop::StopRequests> requests;
};

/// slave_io's ends of the topics. Converts, stamps, refuses what is invalid or out of order. Never used by
/// the servo thread.
class DdsAdapter {
 public:
  /// Throws DdsError. `inbox` must outlive the adapter.
  DdsAdapter(const core::NetworkOptions& network, std::size_t joint_count, Inbox& inbox);
  ~DdsAdapter();

  void publish(const SlaveReport& report);
  void publish_health(const core::Health& health);
  /// Stops this slave at once and asks everyone else to; `issuer` for the logs. Any thread but the servo's.
  void emergency_stop(const std::string& issuer);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::slave_io
