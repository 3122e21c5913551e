#pragma once

#include "common/core/health.hpp"
#include "components/slave_io/dds_adapter.hpp"
#include "components/slave_io/slave_io.hpp"

namespace phantom::slave_io {

/// What a tick of the controller is told of the arm.
struct ArmSense {
  bool known = true;            ///< false: the encoders have not spoken yet; nothing else means anything
  core::JointArray position{};  ///< as the encoders say
  core::JointArray velocity{};
  core::JointArray gravity_Nm{};  ///< torques that hold the weight; zero if they are not wanted
  bool follows = true;            ///< the drives do what they are told
  bool fault = false;             ///< they hold or coast until a reset
};

/// What a tick of the controller asks of the arm.
struct ArmDemand {
  SlaveOutputs outputs;
  bool stop = false;   ///< a stop is in force
  bool reset = false;  ///< a reset that releases it was asked for since the last tick
};

/// What the servo moves: a simulated arm, or the drives of one. sense(), move() and fill() belong to the
/// servo thread, allocate nothing and never wait.
class ArmDriver {
 public:
  virtual ~ArmDriver() = default;

  /// The newest that is known of the arm.
  virtual const ArmSense& sense() noexcept = 0;
  /// Lets `dt_s` pass under the demand. `now_ns`: monotonic clock.
  virtual void move(const ArmDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept = 0;
  /// The last call, once the servo thread has ended: the arm goes on with nothing that it was told before.
  virtual void end(core::Nanoseconds now_ns) noexcept = 0;
  /// What this arm has to say in `state`: motion, torques, contact.
  virtual void fill(messages::SlaveState& state) const noexcept = 0;
  /// Whether periods that the loop missed must be lived through one by one, for an arm whose time is the
  /// loop's.
  virtual bool makes_up_periods() const noexcept = 0;
  /// One reader thread, any but the servo's.
  virtual core::ActuatorHealth health() = 0;
};

}  // namespace phantom::slave_io
