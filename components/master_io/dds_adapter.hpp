#pragma once

#include <memory>
#include <string>

#include "common/core/health.hpp"
#include "common/core/histogram.hpp"
#include "common/core/network.hpp"
#include "common/core/snapshot.hpp"
#include "common/core/stop_requests.hpp"
#include "components/master_io/gains.hpp"
#include "components/master_io/master_io.hpp"

namespace phantom::master_io {

/// What one tick leaves for the topic master_state.
struct MasterReport {
  MasterOutputs outputs;
  std::uint32_t stop_requests = 0;  ///< of the inbox, that are in force
  core::JointArray position{};      ///< encoders, of the tick in which the torques were computed
  core::JointArray velocity{};
  core::JointArray operator_Nm{};
  std::int32_t reach = -1;
  core::SampleId slave, drag;  ///< newest of each
  double round_trip_s = -1.0;  ///< −1: no new one
};

/// What comes from the topics, validated. The servo thread is the reader of all.
struct Inbox {
  core::Snapshot<SlaveSample> slave;
  core::Snapshot<DragSample> drag;
  core::Snapshot<PhantomContact> phantom;
  core::Snapshot<Settings> settings;
  core::StopRequests stops;
};

/// What the adapter holds samples against.
struct Expectations {
  std::size_t joint_count = 0;
  core::JointArray lower{},
      upper{};  ///< joint limits; a slave farther beyond them than robot::near_limits allows is not believed
  teleop::DragMode drag_mode = teleop::DragMode::kSeparable;
  GainRules gains;
};

/// master_io's ends of the topics. Converts, stamps, refuses what is invalid or out of order. Never used by
/// the servo thread.
class DdsAdapter {
 public:
  /// `settings` are those in force at the start. `inbox` must outlive the adapter. Throws DdsError.
  DdsAdapter(const core::NetworkOptions& network, const Expectations& expectations, const Settings& settings,
             Inbox& inbox);
  ~DdsAdapter();

  void publish(const MasterReport& report);
  void publish_health(const core::Health& health);
  /// Stops this master at once and asks everyone else to; `issuer` for the logs. Any thread but the servo's.
  void emergency_stop(const std::string& issuer);
  /// Asks everyone else to stop, as this master did. The thread that publishes.
  void announce_stop(const std::string& issuer);
  /// Releases the stops that master and slave have in force now, on both sides. As emergency_stop().
  void reset(const std::string& issuer);
  /// Times from publishing a master_state until a drag_field that goes back to it arrived; each master_state
  /// counts once.
  core::DurationHistogram round_trips() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::master_io
