#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "common/core/health.hpp"
#include "common/core/histogram.hpp"
#include "common/core/network.hpp"
#include "common/core/snapshot.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/teleop/commands/stop_requests.hpp"
#include "components/master_io/gains.hpp"
#include "components/master_io/master_io.hpp"

namespace phantom::master_io {

/// How the view stands that the operator looks at.
struct SeenView {
  core::Nanoseconds received_ns = 0;  ///< 0: none received yet
  std::array<double, 9> R_WC{};       ///< camera in W: x right, y up, z backward; by columns
};

/// The newest valid haptic_device.
using HapticSample = messages::Answer<messages::HapticDevice>;

/// Validated data from the topics. The servo thread is the reader of all.
struct Inbox {
  core::Snapshot<SlaveSample> slave;
  core::Snapshot<DragSample> drag;
  core::Snapshot<Vicinity> phantom;
  core::Snapshot<SeenView> view;
  core::Snapshot<HapticSample> haptic;
  core::Snapshot<Settings> settings;
  teleop::StopRequests stops;
};

/// What a haptic device must be able to do.
struct HapticNeeds {
  double mass_kg = 0.0, inertia_kg_m2 = 0.0;  ///< at least, as the damping limits are found with
  double force_N = 0.0, moment_N_m = 0.0;     ///< at least
  bool orientation = true;                    ///< it measures its orientation
};

/// What received samples must match.
struct Expectations {
  messages::ArmBounds arm;  ///< bounds that the slave's arm must have
  teleop::DragMode drag_mode = teleop::DragMode::kSeparable;
  GainRules gains;
  std::optional<HapticNeeds> haptic;  ///< none: no haptic device is used
};

/// Connects master_io to the topics. It stamps what it publishes and refuses samples that are invalid or out
/// of order. Never used by the servo thread.
class DdsAdapter {
 public:
  /// `settings` are those in force at the start. `inbox` must outlive the adapter. Throws DdsError.
  DdsAdapter(const core::NetworkOptions& network, const Expectations& expectations, const Settings& settings,
             Inbox& inbox);
  ~DdsAdapter();

  void publish(const MasterReport& report);
  void publish_health(const core::Health& health);
  /// Stops this master at once and requests a stop from everyone else. `issuer` is for the logs. May be
  /// called by any thread but the servo's.
  void emergency_stop(const std::string& issuer);
  /// Requests a stop from everyone else after this master has stopped. Called by the publishing thread.
  void announce_stop(const std::string& issuer);
  /// Releases the stops that master and slave have in force now, on both sides. Thread and `issuer` as for
  /// emergency_stop().
  void reset(const std::string& issuer);
  /// Requests a width of the slave's gripper, in m; 1: as wide as it opens. Thread and `issuer` as for
  /// emergency_stop(). A refusal shows in the slave's log.
  void ask_gripper(double width_m, const std::string& issuer);
  /// Chooses the percepts by a key of the desk. Thread and `issuer` as for emergency_stop().
  void choose_percepts(PerceptKey key, const std::string& issuer);
  /// Returns the times from publishing a master_state to receiving a drag_field computed from it. Each
  /// master_state counts once.
  core::DurationHistogram round_trips() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::master_io
