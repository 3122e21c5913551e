#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/teleop/guards/contact_latch.hpp"

namespace phantom::teleop {

/// A force, and a torque about the origin of a frame, both along its axes.
struct Wrench {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero(), torque_Nm = Eigen::Vector3d::Zero();
};

/// A force/torque sensor between the arm and what it carries. Its frame is S.
struct WristSensorParameters {
  std::size_t link = 1;  ///< the moving link that carries it, behind the arm's last joint
  geometry::Pose X_LS;   ///< in that link's frame
  double payload_kg = 0.0;
  Eigen::Vector3d payload_centre_m = Eigen::Vector3d::Zero();  ///< centre of mass of all behind it, in S
  /// Greatest force and torque along each axis that it measures, > 0.
  Eigen::Vector3d rated_N = Eigen::Vector3d::Ones(), rated_Nm = Eigen::Vector3d::Ones();
  double threshold_N = 1.0, threshold_Nm = 0.1;  ///< > 0; what noise, drift and the payload's motion may do
  double filter_s = 0.0;                         ///< time constant of a low-pass; 0: none
  double staleness_s = 0.02;                     ///< a sample that is older is not believed
  bool needs_tare = true;                        ///< nothing is measured before the first tare
  double tare_s = 0.5;                           ///< over which a tare averages
  double most_offset_N = 10.0, most_offset_Nm = 1.0;  ///< that a tare takes away; more is a contact
  core::JointArray still{};                           ///< greatest speed of each joint during a tare, > 0
};

/// What is known of the sensor at a tick.
struct WristSample {
  Wrench wrench;       ///< that acts on what it carries, weight included, about S's origin
  bool valid = false;  ///< the sensor vouches for it
  bool fresh = false;  ///< it came since the last tick
  double age_s = std::numeric_limits<double>::infinity();  ///< ∞: none came yet
};

enum class WristState : std::uint8_t {
  kSilent,     ///< no sample came yet
  kStale,      ///< the newest sample is too old
  kInvalid,    ///< the sensor or its bus reports an error, or a value is no number
  kSaturated,  ///< beyond the rated range
  kNotTared,   ///< its offset is unknown
  kTaring,
  kSettling,  ///< good samples come, but not for long enough yet
  kMeasured
};

enum class TareState : std::uint8_t {
  kNone,     ///< none was requested
  kRuns,     ///< averaging
  kDone,     ///< the offset is known
  kMoved,    ///< ended, as a joint moved
  kTouched,  ///< ended, as the force was beyond the limit or changed, or something touched the arm
  kLost      ///< ended, as the sensor did not measure
};

/// Why a tare cannot begin now; those but the last end one that runs.
enum class TareRefusal : std::uint8_t { kNone, kNotMeasured, kMoves, kTouched, kRuns };

/// Force on what the sensor carries, and what it does to the joints. Trivially copyable.
struct WristForce {
  WristState state = WristState::kSilent;
  core::JointArray torque_Nm{};  ///< F_e; zero unless measured
  bool contact = false;
  double force_N = -1.0;                ///< size of the force, without threshold; −1: not measured
  bool has_line = false;                ///< the force is great enough to say where it acts
  std::array<double, 3> on_line_W_m{};  ///< the point of its line of action that is nearest to the tip
  TareState tare = TareState::kNone;
  TareRefusal refusal = TareRefusal::kNotMeasured;
  double offset_N = 0.0, offset_Nm = 0.0;  ///< size of the offset that the last tare found

  bool measured() const noexcept { return state == WristState::kMeasured; }
};

/// Turns the samples of a wrist sensor into the external torques on the joints.
///
/// From each sample the offset of the last tare and the payload's weight in the present pose are taken; what
/// is left is the wrench w of the surroundings on all behind the sensor, and the payload's inertia times its
/// acceleration, which is not known here. Force and torque are each less by their threshold, towards zero, as
/// MomentumObserver's r is. F_e = Jᵀ·w, with J of S's origin. A force elsewhere on the arm is not seen.
///
/// Where a single force acts is known up to its line of action, the central axis of w. Contact: ContactLatch.
///
/// Nothing is measured while samples are stale, invalid or beyond the rated range, before the first tare and
/// during one; and afterwards only when the samples have been good for kRecovery_s.
class WristSensor {
 public:
  static constexpr double kRecovery_s = 0.05;
  /// A line of action that passes S farther away says that the wrench is a torque rather than a force.
  static constexpr double kFarthest_m = 2.0;

  /// `arm` must outlive the sensor. `tip_in_link_m`: the tool's tip, in the frame of the sensor's link.
  WristSensor(const robot::SerialArm& arm, const WristSensorParameters& parameters,
              const Eigen::Vector3d& tip_in_link_m)
      : arm_(arm), parameters_(parameters), tip_in_link_m_(tip_in_link_m) {}

  /// Takes what is known at a tick, `dt_s` after the one before, with the links at `X_WL` and joint
  /// velocities `v`. `touched`: something else tells that the arm is touched. Real-time safe: yes.
  const WristForce& step(const WristSample& sample, const robot::LinkPoses& X_WL, const core::JointArray& v,
                         bool touched, double dt_s) noexcept;
  /// Begins a tare with the next step; one that cannot begin then has failed. Real-time safe: yes.
  void tare() noexcept { tare_requested_ = true; }

 private:
  struct Tare {
    Wrench sum, first;
    int samples = 0;
    double for_s = 0.0;
  };
  WristState assess(const WristSample& sample) const noexcept;
  Wrench without_weight(const Wrench& wrench, const robot::LinkPoses& X_WL) const noexcept;
  bool is_offset(const Wrench& wrench) const noexcept;
  bool moves(const core::JointArray& v) const noexcept;
  void step_tare(const WristSample& sample, const Wrench& unloaded, TareRefusal obstacle,
                 double dt_s) noexcept;
  TareState tare_after(const Wrench& unloaded) noexcept;
  void filter(const Wrench& now) noexcept;
  void measure(const robot::LinkPoses& X_WL, double dt_s) noexcept;

  const robot::SerialArm& arm_;
  WristSensorParameters parameters_;
  Eigen::Vector3d tip_in_link_m_;
  Wrench offset_, felt_;  // felt_: behind the filter
  bool tared_ = false, tare_requested_ = false, filtering_ = false;
  Tare tare_;
  double good_s_ = 0.0, since_sample_s_ = 0.0;
  ContactLatch contact_;
  WristForce force_;
};

}  // namespace phantom::teleop
