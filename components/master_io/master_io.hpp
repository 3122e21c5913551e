#pragma once

#include <cstdint>
#include <limits>

#include "common/core/clock.hpp"
#include "common/core/joints.hpp"
#include "common/teleop/bilateral.hpp"
#include "common/teleop/link_state.hpp"
#include "common/teleop/percept_rendering.hpp"
#include "common/teleop/ramp.hpp"
#include "components/master_io/config.hpp"

namespace phantom::master_io {

/// A stamp to send back to whoever made it.
struct EchoStamp {
  std::uint64_t sequence_number = 0;  ///< 0: nothing received yet
  std::int64_t monotonic_ns = 0;
  std::uint64_t session = 0;
};

/// The newest valid slave_state.
struct SlaveSample {
  core::Nanoseconds received_ns = 0;  ///< this host's monotonic clock; 0: none yet
  EchoStamp stamp;
  teleop::LinkState state = teleop::LinkState::kInit;
  core::JointArray position{};  ///< rad or m
  core::JointArray loop_torque_Nm{};
  bool contact = false;
  std::uint16_t contact_object = 0;
  double tool_speed_m_s = 0.0;
  double clearance_m = -1.0;
};

/// The newest valid drag_field.
struct DragSample {
  core::Nanoseconds received_ns = 0;  ///< 0: none yet
  EchoStamp stamp;
  teleop::DragCoefficients drag;
  double round_trip_s = -1.0;  ///< from our master_state that it goes back to; −1: not a new one
};

/// What operators have asked for so far.
struct Wishes {
  teleop::StopRequests requests;
  double percept_gain = 0.0;   ///< G
  double feedback_gain = 0.0;  ///< 1/A
  bool percept_enabled = true;
};

struct MasterInputs {
  SlaveSample slave;
  DragSample drag;
  double slave_age_s = std::numeric_limits<double>::infinity();  ///< since received; ∞: none yet
  double drag_age_s = std::numeric_limits<double>::infinity();
  Wishes wishes;
  bool percept_wanted = true;   ///< by the script of reaches
  core::JointArray position{};  ///< as the encoders say
  core::JointArray velocity{};
};

struct MasterOutputs {
  teleop::LinkState state = teleop::LinkState::kInit;
  core::JointArray motor_Nm{};     ///< to the device
  core::JointArray percept_Nm{};   ///< its parts: G·τ₁
  core::JointArray feedback_Nm{};  ///< and τ₂/A
  double percept_gain = 0.0;       ///< in force after the device's stability limit
  double feedback_gain = 0.0;
  bool percept_enabled = false;
  bool damping_limited = false, torque_limited = false;
};

/// The master's controller: watches the link, renders percept and slave feedback, sums them on the device.
///
/// Torques exist only while coupled; they fade in and out, never jump. The percept uses the velocity of this
/// very tick.
class MasterIo {
 public:
  explicit MasterIo(const Config& config);

  /// One tick. Pure; real-time safe: yes.
  MasterOutputs step(const MasterInputs& in, double dt_s) noexcept;

 private:
  core::JointArray render_feedback(const MasterInputs& in, bool coupled, double dt_s) noexcept;

  std::size_t count_;
  teleop::BilateralLaw law_;
  core::JointArray align_tolerance_, torque_limit_Nm_, feedback_cap_Nm_;
  double percept_staleness_s_;
  teleop::LinkMonitor link_;
  teleop::PerceptRenderer percept_;
  teleop::Ramp feedback_authority_;
  double feedback_gain_ = 0.0;  ///< in force: follows the wish within the ramp's time
  double gain_slew_per_s_;
};

}  // namespace phantom::master_io
