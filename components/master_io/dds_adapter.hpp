#pragma once

#include <memory>
#include <string>

#include "common/core/health.hpp"
#include "common/core/histogram.hpp"
#include "common/core/network.hpp"
#include "common/core/snapshot.hpp"
#include "common/core/stop_requests.hpp"
#include "common/messages/arm_bounds.hpp"
#include "components/master_io/gains.hpp"
#include "components/master_io/master_io.hpp"

namespace phantom::master_io {

/// What one tick leaves for the topic master_state, and for who tells how the controller is.
struct MasterReport : messages::MasterState {
  MasterOutputs outputs;
  std::uint32_t stop_requests = 0;  ///< of the inbox, that are in force

  /// Takes over what the outputs have for the topic. Real-time safe: yes.
  void take(const MasterOutputs& made) noexcept;
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
  messages::ArmBounds arm;  ///< that the slave must be
  teleop::DragMode drag_mode = teleop::DragMode::kSeparable;
  GainRules gains;
};

/// master_io's ends of the topics. Stamps, and refuses what is invalid or out of order. Never used by the
/// servo thread.
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
