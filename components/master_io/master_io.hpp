#pragma once

#include <cstdint>
#include <limits>

#include "common/core/clock.hpp"
#include "common/core/joints.hpp"
#include "common/messages/percept.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/teleop/feedback_rendering.hpp"
#include "common/teleop/percept_rendering.hpp"
#include "common/teleop/servo_side.hpp"
#include "common/teleop/torque_slew.hpp"
#include "components/master_io/config.hpp"

namespace phantom::master_io {

/// The newest valid slave_state.
using SlaveSample = messages::Answer<messages::SlaveState>;

/// The newest valid drag_field.
struct DragSample : messages::Answer<messages::DragField> {
  using messages::Answer<messages::DragField>::Answer;
  double round_trip_s = -1.0;  ///< from our master_state that it goes back to; −1: not a new one
};

/// What operators have set so far.
struct Settings {
  core::JointArray percept_gain{};  ///< G, by joint
  teleop::BilateralLaw law = teleop::BilateralLaw::kSctfb;
  core::JointArray feedback_gain = teleop::everywhere(teleop::kLawsOwnGain);  ///< 1/A, by joint
  bool percept_enabled = true;
};

/// Whether the phantom says that the arm is in contact.
struct PhantomContact {
  core::Nanoseconds received_ns = 0;  ///< 0: no percept yet
  bool contact = false;
};

struct MasterInputs : teleop::SideInputs {
  SlaveSample slave;
  DragSample drag;
  double drag_age_s = std::numeric_limits<double>::infinity();  ///< since received; ∞: none yet
  double drag_round_trip_s =
      0.0;  ///< since the master_state was made that it goes back to; 0: none of ours yet
  PhantomContact phantom;
  double phantom_age_s = std::numeric_limits<double>::infinity();
  Settings settings;
  bool percept_wanted = true;  ///< by the script of reaches
};

struct MasterOutputs : teleop::SideOutputs {
  bool slave_touches = false;      ///< it says that it touches something
  core::JointArray motor_Nm{};     ///< to the device
  core::JointArray percept_Nm{};   ///< its parts: G·τ₁
  core::JointArray feedback_Nm{};  ///< and τ₂/A
  double percept_gain = 0.0;       ///< in force after the device's stability limit, the least of the joints'
  double feedback_gain = 0.0;      ///< 1/A in force, contact included, the least of the joints'
  double feedback_delay_s = 0.0;   ///< round trip in force, with which 1/A must be stable
  teleop::BilateralLaw law = teleop::BilateralLaw::kSctfb;  ///< in force
  bool percept_enabled = false;
  bool damping_limited = false, torque_limited = false;
  bool feedback_limited = false;  ///< 1/A of a joint is held at what is stable with the delay in force
  bool feedback_damped = false;   ///< the passivity guard damps
  bool force_missing = false;     ///< the law needs a force sensor that the slave does not have
};

/// The master's controller: watches the link, renders percept and slave feedback, sums them on the device.
///
/// Torques exist only while coupled; they fade in and out, and nothing that reaches the motors jumps. The
/// percept uses the velocity of this very tick. The device's drives get power once the slave is heard and
/// says that it is not stopped; in a stop they lose it when the torques have faded out.
class MasterIo {
 public:
  /// `latch`: with the stop that outlived the process before this one, if there is one.
  MasterIo(const Config& config, const teleop::StopLatch& latch);

  /// One tick. Pure; real-time safe: yes.
  MasterOutputs step(const MasterInputs& in, double dt_s) noexcept;

 private:
  void render_feedback(const MasterInputs& in, double dt_s, MasterOutputs& out) noexcept;

  std::size_t count_;
  ContactSource contact_source_;
  core::JointArray align_tolerance_;
  double percept_staleness_s_, round_trip_limit_s_;
  teleop::LinkMonitor link_;
  teleop::PerceptRenderer percept_;
  teleop::FeedbackRenderer feedback_;
  teleop::TorqueSlew slew_;
};

}  // namespace phantom::master_io
