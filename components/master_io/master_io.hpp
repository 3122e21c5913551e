#pragma once

#include <cstdint>
#include <limits>

#include "common/core/clock.hpp"
#include "common/core/joints.hpp"
#include "common/messages/percept.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/teleop/coupling/servo_side.hpp"
#include "common/teleop/guards/energy_tank.hpp"
#include "common/teleop/rendering/feedback_rendering.hpp"
#include "common/teleop/rendering/percept_rendering.hpp"
#include "common/teleop/rendering/percept_set.hpp"
#include "common/teleop/rendering/reaction_rendering.hpp"
#include "common/teleop/rendering/torque_slew.hpp"
#include "components/master_io/config.hpp"

namespace phantom::master_io {

/// The newest valid slave_state.
using SlaveSample = messages::Answer<messages::SlaveState>;

/// The newest valid drag_field.
struct DragSample : messages::Answer<messages::DragField> {
  using messages::Answer<messages::DragField>::Answer;
  double round_trip_s =
      -1.0;  ///< since our master_state from which it was computed; −1: already counted, or none
};

/// Settings made by operators so far.
struct Settings {
  core::JointArray percept_gain{};  ///< G, by joint
  teleop::BilateralLaw law = teleop::BilateralLaw::kSctfb;
  core::JointArray feedback_gain = teleop::everywhere(teleop::kLawsOwnGain);  ///< 1/A, by joint
  teleop::PerceptChoice percepts;
};

/// The phantom's report whether the arm is in contact.
struct PhantomContact {
  core::Nanoseconds received_ns = 0;  ///< 0: no percept received yet
  bool contact = false;
};

struct MasterInputs : teleop::SideInputs {
  SlaveSample slave;
  DragSample drag;
  double drag_age_s = std::numeric_limits<double>::infinity();  ///< since its receipt; ∞: none yet
  double drag_round_trip_s =
      0.0;  ///< age of the master_state from which the drag was computed; 0: none of ours yet
  PhantomContact phantom;
  double phantom_age_s = std::numeric_limits<double>::infinity();
  Settings settings;
  /// By how much the loop through a device that another process serves is longer than configured; ≥ 0.
  double device_longer_s = 0.0;
  double rendered_share = 1.0;  ///< of the last tick's torques, what the device rendered, 0…1
  bool percept_wanted = true;   ///< the script of reaches enables the percept
};

struct MasterOutputs : teleop::SideOutputs {
  bool slave_touches = false;      ///< the slave reports contact
  core::JointArray motor_Nm{};     ///< torque sent to the device
  core::JointArray percept_Nm{};   ///< its percept part: G·τ₁
  core::JointArray feedback_Nm{};  ///< its feedback part: τ₂/A
  double percept_gain = 0.0;       ///< in force after the device's stability limit; the least of the joints
  double feedback_gain = 0.0;      ///< 1/A in force, contact included; the least of the joints
  double feedback_delay_s = 0.0;   ///< round trip in force, with which 1/A must be stable
  teleop::BilateralLaw law = teleop::BilateralLaw::kSctfb;  ///< in force
  bool percept_enabled = false;                             ///< of drag: wanted by the script, too
  teleop::PerceptChoice percepts;
  teleop::Counterbalance counterbalance = teleop::Counterbalance::kMechanical;  ///< of the slave
  bool damping_limited = false, torque_limited = false;
  bool feedback_limited = false;  ///< 1/A of a joint is reduced to the stable value for the delay in force
  bool feedback_damped = false;   ///< the passivity guard adds damping, or the reaction's energy is used up
  bool force_missing = false;     ///< the law needs a force sensor that the slave does not have
};

/// The master's controller: monitors the link, renders percept and slave feedback, and sums them for the
/// device.
///
/// Torques exist only while coupled; they fade in and out, and the motors' torque changes at a bounded rate
/// (TorqueSlew). Percept and reaction each give the hand no more energy than they took and a small allowance,
/// by the device's positions alone (EnergyTank). The percept uses the velocity of the present tick. The
/// device's drives get power once the slave is heard and reports that it is not stopped. In a stop they lose
/// it when the torques have faded out.
class MasterIo {
 public:
  /// `latch` holds the stop that was in force when the previous process ended, if there was one.
  MasterIo(const Config& config, const teleop::StopLatch& latch);

  /// Computes one tick. Has no side effects outside this object. Real-time safe: yes.
  MasterOutputs step(const MasterInputs& in, double dt_s) noexcept;

 private:
  void render_feedback(const MasterInputs& in, const core::JointArray& reaction_Nm, double limit_share,
                       double dt_s, MasterOutputs& out) noexcept;

  std::size_t count_;
  ContactSource contact_source_;
  core::JointArray align_tolerance_;
  double percept_staleness_s_, round_trip_limit_s_, period_s_, delay_samples_;
  teleop::LinkMonitor link_;
  teleop::PerceptRenderer percept_;
  teleop::ReactionRenderer reaction_;
  teleop::FeedbackRenderer feedback_;
  teleop::EnergyTank percept_tank_, reaction_tank_;
  teleop::TorqueSlew slew_;
};

}  // namespace phantom::master_io
