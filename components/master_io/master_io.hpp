#pragma once

#include <cstdint>
#include <limits>

#include "common/core/clock.hpp"
#include "common/core/joints.hpp"
#include "common/messages/haptic_device.hpp"
#include "common/messages/percept.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/teleop/coupling/servo_side.hpp"
#include "common/teleop/guards/energy_tank.hpp"
#include "common/teleop/rendering/drag_masking.hpp"
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

/// What the phantom reports of what is near the arm.
struct Vicinity {
  core::Nanoseconds received_ns = 0;  ///< 0: no percept received yet
  bool contact = false;               ///< a sensor is in an object's innermost layer, or deeper
  double closeness = 0.0;             ///< 0…1, that the tone tells
  double threat_closeness = 0.0;      ///< 0…1, of the most urgent threat, which the view shows; 0: none
};

/// Slightly more than a percept period: an older report of the phantom does not count.
inline constexpr double kPhantomStaleness_s = 0.1;

struct MasterInputs : teleop::SideInputs {
  SlaveSample slave;
  DragSample drag;
  double drag_age_s = std::numeric_limits<double>::infinity();  ///< since its receipt; ∞: none yet
  double drag_round_trip_s =
      0.0;  ///< age of the master_state from which the drag was computed; 0: none of ours yet
  Vicinity phantom;
  double phantom_age_s = std::numeric_limits<double>::infinity();
  Settings settings;
  /// By how much the loop through a device that another process serves is longer than configured; ≥ 0.
  double device_longer_s = 0.0;
  double rendered_share = 1.0;  ///< of the last tick's torques, what the device rendered, 0…1
  bool percept_wanted = true;   ///< the script of reaches enables the percept
};

/// The controller's outputs that are no part of topic master_state.
struct MasterOutputs : teleop::SideOutputs {
  bool slave_touches = false;     ///< the slave reports contact
  core::JointArray motor_Nm{};    ///< torque sent to the device: percept and feedback
  double feedback_delay_s = 0.0;  ///< round trip in force, with which 1/A must be stable
  teleop::PerceptChoice percepts;
  teleop::Counterbalance counterbalance = teleop::Counterbalance::kMechanical;  ///< of the slave
  bool damping_limited = false;  ///< the percept, to what the device renders stably, or by its energy
  bool percept_capped = false, feedback_capped = false;  ///< a joint's torque is at its cap
  bool drag_masked = false;  ///< outside contact, the slave's feedback hides the drag (MaskingMonitor)
};

/// Result of one tick: the sample of topic master_state, and the outputs for the controller's health.
struct MasterReport : messages::MasterState {
  MasterOutputs outputs;
  std::uint32_t stop_requests = 0;  ///< those of the inbox that are in force
  std::uint32_t gripper_asked = 0;  ///< how often a simulated operator has asked something of the gripper
  bool gripper_open = false;        ///< what
  bool has_wrench = false;          ///< a haptic device is served by another process
  messages::HapticDeviceWrench wrench;
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

  /// Computes one tick: sets `report.outputs`, and of the message all that the controller decides. Gains are
  /// the least of the joints', as they are in force. Has no side effects outside this object. Real-time safe:
  /// yes.
  void step(const MasterInputs& in, double dt_s, MasterReport& report) noexcept;

 private:
  bool touches(const MasterInputs& in) const noexcept;
  void render_feedback(const MasterInputs& in, const core::JointArray& reaction_Nm, double limit_share,
                       double dt_s, MasterReport& report) noexcept;
  void judge_masking(const MasterInputs& in, const core::JointArray& reaction_Nm, double dt_s,
                     MasterReport& report) noexcept;

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
  teleop::MaskingMonitor masking_;
};

}  // namespace phantom::master_io
