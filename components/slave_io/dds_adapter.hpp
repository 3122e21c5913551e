#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/core/snapshot.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/teleop/commands/stop_requests.hpp"
#include "components/slave_io/gripper.hpp"
#include "components/slave_io/payload.hpp"
#include "components/slave_io/slave_io.hpp"
#include "components/slave_io/tare_request.hpp"

namespace phantom::slave_io {

/// Result of one tick: the sample of topic slave_state, and the outputs for the controller's health.
struct SlaveReport : messages::SlaveState {
  SlaveOutputs outputs;
  std::uint32_t stop_requests = 0;  ///< those of the inbox that are in force
  std::optional<messages::GripperState> gripper;
  teleop::WristForce wrist;  ///< of the sensor at the wrist, if there is one
};

/// A person's choice whether the gravity model carries the arm's weight, between the thread that takes
/// commands and the servo's. Real-time safe: yes.
class CounterbalanceRequest {
 public:
  /// Says what is so at the start. Before that, requests are refused.
  void begin(bool balanced, bool on) noexcept {
    state_.store(balanced ? State::kBalanced : on ? State::kOn : State::kOff, std::memory_order_release);
  }
  /// Servo thread: returns what is wanted now.
  bool on() const noexcept { return state_.load(std::memory_order_acquire) == State::kOn; }
  /// Requests it, or returns why it is refused and what is allowed.
  core::Status ask(bool on);

 private:
  enum class State : std::uint8_t { kNotYet, kBalanced, kOff, kOn };
  std::atomic<State> state_{State::kNotYet};
};

using ReceivedWrench = messages::Received<messages::WristWrench>;

/// Validated data from the topics. The servo thread is the reader.
struct Inbox {
  core::Snapshot<MasterSample> master;
  teleop::StopRequests stops;
  HomingRequest homing;
  GripperRequests gripper;
  CounterbalanceRequest counterbalance;
  core::Snapshot<ReceivedWrench> wrist;
  core::Snapshot<robot::Payload> payload;
  core::Snapshot<BoundedPlaces> places;  ///< of the objects with a bound of force
  TareRequest tare;
};

/// Connects slave_io to the topics. It stamps what it publishes and refuses samples that are invalid or out
/// of order. Never used by the servo thread.
class DdsAdapter {
 public:
  /// `arm`: bounds of the arm that the master must command. `inbox` must outlive the adapter; whether there
  /// is a gripper is known in it by now. Throws DdsError.
  DdsAdapter(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox);
  ~DdsAdapter();

  /// Begins to pass what `rule`'s arm carries to the inbox, and where objects with a bound are, as wva_server
  /// says it. Call it at most once. Throws DdsError.
  void follow_workspace(const PayloadRule& rule, const std::vector<ObjectForceBound>& bounded);
  void publish(const SlaveReport& report);
  void publish_health(const core::Health& health);
  /// Requests a stop from everyone else after this slave has stopped. `issuer` is for the logs. Called by the
  /// publishing thread.
  void announce_stop(const std::string& issuer);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::slave_io
