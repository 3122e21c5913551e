#pragma once

#include "common/can/arm_drives.hpp"
#include "common/core/health.hpp"
#include "common/robot/kinematics/payload.hpp"
#include "components/slave_io/dds_adapter.hpp"
#include "components/slave_io/slave_io.hpp"

namespace phantom::slave_io {

/// State of the arm at a tick of the controller.
struct ArmSense {
  bool known = true;            ///< false: the encoders have not reported yet, and nothing else is valid
  core::JointArray position{};  ///< as measured by the encoders
  core::JointArray velocity{};
  core::JointArray gravity_Nm{};  ///< torques that hold weight and lift; without use for a balanced arm
  HomingRequest::State homing = HomingRequest::State::kNotNeeded;  ///< without regard to stops
  bool follows = true;                                             ///< the drives follow their commands
  bool fault = false;                                              ///< the drives hold or coast until a reset
  can::DigitalInputs inputs;                                       ///< of its drives, if one is to send them
};

/// Commands of a tick of the controller to the arm.
struct ArmDemand {
  SlaveOutputs outputs;
  bool stop = false;   ///< a stop is in force, or homing has to end
  bool reset = false;  ///< a reset that releases the stop was requested since the last tick
  bool home = false;   ///< homing was requested since the last tick, and no stop is in force
};

/// Interface of the arm that the servo moves: simulated, or with drives. sense(), move(), carry() and fill()
/// belong to the servo thread, allocate no memory and never wait.
class ArmDriver {
 public:
  virtual ~ArmDriver() = default;

  /// Returns the newest known state of the arm.
  virtual const ArmSense& sense() noexcept = 0;
  /// Advances the arm by `dt_s` under the demand. `now_ns`: monotonic clock.
  virtual void move(const ArmDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept = 0;
  /// Ends the arm after the servo thread has ended: the arm stops following earlier commands. It is the last
  /// call.
  virtual void end(core::Nanoseconds now_ns) noexcept = 0;
  /// Counts with what the arm carries from now on. An arm that does not know its torques need not.
  virtual void carry(const robot::Payload&) noexcept {}
  /// Fills in what this arm reports in `state`: motion, torques, contact.
  virtual void fill(messages::SlaveState& state) const noexcept = 0;
  /// Returns whether missed periods must be simulated one by one, as for an arm whose time is the loop's.
  virtual bool makes_up_periods() const noexcept = 0;
  /// Returns the arm's health. Only one thread may call it, and not the servo's.
  virtual core::ActuatorHealth health() = 0;
};

}  // namespace phantom::slave_io
