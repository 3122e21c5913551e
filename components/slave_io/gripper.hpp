#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "common/core/health.hpp"
#include "common/core/snapshot.hpp"
#include "common/core/status.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/teleop/gripper/gripper.hpp"
#include "components/slave_io/homing_request.hpp"

namespace phantom::slave_io {

/// Operators' requests to the gripper, between the thread that takes commands and the servo's.
class GripperRequests {
 public:
  enum class State : std::uint8_t { kNotYet, kStopped, kReady };

  /// Before any thread uses it: there is a gripper.
  void open(const teleop::GripperLimits& limits) { limits_ = limits; }
  bool has_gripper() const noexcept { return limits_.has_value(); }

  /// Servo thread: reports what would become of a request now. Real-time safe: yes.
  void report(State state) noexcept { state_.store(state, std::memory_order_release); }
  /// Servo thread: reads the newest request. Real-time safe: yes.
  void read(teleop::GripperRequest& request) noexcept { newest_.read(request); }
  /// Requests a width in m, or a greatest force in N; or returns why not, and what is allowed. Always the
  /// same thread.
  core::Status ask_width(double width_m);
  core::Status ask_force(double force_N);

 private:
  core::Status refusal() const;

  std::optional<teleop::GripperLimits> limits_;
  std::atomic<State> state_{State::kNotYet};
  teleop::GripperRequest last_;
  core::Snapshot<teleop::GripperRequest> newest_;
};

/// Commands of a tick to the gripper's drive.
struct GripperCommand {
  teleop::GripperDemand demand;
  bool power = false;  ///< it may have power
  bool stop = false;   ///< a stop is in force: ends homing, and nothing else
  bool reset = false;  ///< a request came while it is in fault
  bool home = false;   ///< homing was requested
};

/// Interface of what moves the gripper's fingers: simulated, or a drive. All but health() belong to the servo
/// thread, allocate no memory and never wait.
class GripperDriver {
 public:
  virtual ~GripperDriver() = default;
  /// Returns the newest known state. Before the arm's move() of the same tick.
  virtual teleop::GripperSense sense() noexcept = 0;
  /// Returns whether it has to be homed.
  virtual HomingRequest::State homing() const noexcept = 0;
  /// Advances by `dt_s`. After the arm's move() of the same tick.
  virtual void move(const GripperCommand& command, double dt_s, core::Nanoseconds now_ns) noexcept = 0;
  /// Returns its health, whose message does not name the gripper. Only one thread may call it, and not the
  /// servo's.
  virtual core::ActuatorHealth health() = 0;
};

/// The gripper in the servo: requests, law and driver. Real-time safe: yes.
class Gripper {
 public:
  /// All arguments must outlive it.
  Gripper(const teleop::GripperLimits& limits, GripperDriver& driver, GripperRequests& requests) noexcept
      : limits_(limits), control_(limits), driver_(driver), requests_(requests) {}

  /// Before the arm's move() of the tick.
  void sense() noexcept { sense_ = driver_.sense(); }
  HomingRequest::State homing() const noexcept { return driver_.homing(); }
  /// After it. `link`: the arm's link state. `home`: homing was requested.
  void step(teleop::LinkState link, bool home, double dt_s, core::Nanoseconds now_ns) noexcept;
  messages::GripperState state() const noexcept;

 private:
  teleop::GripperLimits limits_;
  teleop::GripperControl control_;
  GripperDriver& driver_;
  GripperRequests& requests_;
  teleop::GripperSense sense_;
  teleop::GripperRequest request_;
  std::uint32_t width_number_ = 0;  // of the last request that was seen
  bool powered_ = false, unattended_ = false;
};

/// Returns `health` with the gripper's figures added. Trouble with it shows where the arm has none.
core::Health with_gripper(core::Health health, const core::ActuatorHealth& gripper,
                          const messages::GripperState& state);

}  // namespace phantom::slave_io
