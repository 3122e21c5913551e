#include "common/teleop/coupling/device_watch.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {
namespace {

constexpr double kForgotten = 0.1;  // s of the loop's length per s
// By how much the pose may differ from where its velocities lead, besides a share of the way itself:
// encoders' steps, filters, and 50 m/s² of a hand over the longest gap between two samples.
constexpr double kJump_m = 0.005, kJump_rad = 0.05, kShareOfWay = 0.5;

constexpr double kVelocityLag_s = 0.02;  // that a device's filter of its velocity may have

using Vector = Eigen::Map<const Eigen::Vector3d>;

bool apart(const Eigen::Vector3d& moved, const Eigen::Vector3d& before, const Eigen::Vector3d& after,
           double dt_s, double most) noexcept {
  const Eigen::Vector3d expected = 0.5 * dt_s * (before + after);
  return !((moved - expected).norm() <= most + kShareOfWay * dt_s * std::max(before.norm(), after.norm()));
}

Eigen::Matrix3d rotation(const HandleMotion& handle) noexcept {
  return Eigen::Map<const Eigen::Matrix3d>(handle.R_DH.data());
}

HandState hand_of(const DeviceReading& reading) noexcept {
  HandState hand;
  hand.pose.rotation = rotation(reading.handle);
  hand.pose.translation_m = Vector(reading.handle.position_m.data());
  hand.twist << Vector(reading.handle.velocity_m_s.data()),
      Vector(reading.handle.angular_velocity_rad_s.data());
  hand.clutch = reading.clutch;
  hand.valid = true;
  return hand;
}

}  // namespace

const char* sentence(DeviceTrouble trouble) noexcept {
  switch (trouble) {
    case DeviceTrouble::kNone:
      return "";
    case DeviceTrouble::kSilent:
      return "no matching haptic device: torques off";
    case DeviceTrouble::kNotReady:
      return "the haptic device says that it is not ready (not homed, in fault, or off): torques off";
    case DeviceTrouble::kUnanswered:
      return "the haptic device does not say which wrench acts (wrench_echo): torques off";
    case DeviceTrouble::kLate:
      return "the loop through the haptic device takes too long: torques off";
    case DeviceTrouble::kJumped:
      return "the haptic device's pose jumped: torques off; release the clutch";
    case DeviceTrouble::kDisagrees:
      return "the haptic device's velocity does not fit its pose (a wrong sign or unit): torques off; release "
             "the clutch";
    case DeviceTrouble::kRestarted:
      return "another process serves the haptic device now: torques off; release the clutch";
    case DeviceTrouble::kClutchIn:
      return "haptic device connected again: release the clutch";
  }
  return "";
}

bool DeviceWatch::jumped(const DeviceReading& newest) const noexcept {
  const HandleMotion &a = last_.handle, &b = newest.handle;
  const double dt_s = core::seconds(newest.measured_ns - last_.measured_ns);
  if (!(dt_s > 0.0)) return true;  // its order was checked: the clock of a living device goes on
  if (dt_s > parameters_.staleness_s) return true;
  const Eigen::Vector3d moved = Vector(b.position_m.data()) - Vector(a.position_m.data());
  const Eigen::Vector3d turned = geometry::rotation_vector(rotation(b) * rotation(a).transpose());
  return apart(moved, Vector(a.velocity_m_s.data()), Vector(b.velocity_m_s.data()), dt_s, kJump_m) ||
         apart(turned, Vector(a.angular_velocity_rad_s.data()), Vector(b.angular_velocity_rad_s.data()), dt_s,
               kJump_rad);
}

bool DeviceWatch::disagrees(const DeviceReading& newest) noexcept {
  const HandleMotion &a = last_.handle, &b = newest.handle;
  const double dt_s = core::seconds(newest.measured_ns - last_.measured_ns);
  const Eigen::Vector3d moved = Vector(b.position_m.data()) - Vector(a.position_m.data());
  const Eigen::Vector3d turned = geometry::rotation_vector(rotation(b) * rotation(a).transpose());
  const double kept = std::exp(-dt_s / core::MotionAgreement::kMemory_s);
  bool any = false;
  for (std::size_t i = 0; i < coordinates_.size(); ++i) {
    const bool turns = i >= 3;
    const std::size_t k = i % 3;
    const double way = turns ? turned[static_cast<Eigen::Index>(k)] : moved[static_cast<Eigen::Index>(k)];
    const double velocity = turns ? 0.5 * (a.angular_velocity_rad_s[k] + b.angular_velocity_rad_s[k])
                                  : 0.5 * (a.velocity_m_s[k] + b.velocity_m_s[k]);
    Coordinate& c = coordinates_[i];
    c.fastest_by_pose = std::max(kept * c.fastest_by_pose, std::abs(way) / dt_s);
    c.fastest_by_velocity = std::max(kept * c.fastest_by_velocity, std::abs(velocity));
    const double lag = kVelocityLag_s * std::min(c.fastest_by_pose, c.fastest_by_velocity);
    c.agreement.step(way, velocity, dt_s, (turns ? kJump_rad : kJump_m) + lag);
    any = any || c.agreement.disagrees();
  }
  return any;
}

DeviceTrouble DeviceWatch::present(const DeviceReading& newest, double loop_s,
                                   core::Nanoseconds now_ns) const noexcept {
  using enum DeviceTrouble;
  if (newest.received_ns == 0 || core::seconds(now_ns - newest.received_ns) > parameters_.staleness_s)
    return kSilent;
  if (!newest.ready) return kNotReady;
  if (newest.answers_ns == 0) return kUnanswered;
  if (loop_s > parameters_.round_trip_limit_s) return kLate;
  // Before anything was taken of it, a device may stand anywhere.
  if (latched_ != kNone) return kNone;
  if (newest.session != last_.session) return kRestarted;
  return newest.received_ns != last_.received_ns && jumped(newest) ? kJumped : kNone;
}

const DeviceVerdict& DeviceWatch::step(const DeviceReading& newest, core::Nanoseconds now_ns,
                                       double dt_s) noexcept {
  const double loop_s = newest.answers_ns != 0 ? core::seconds(now_ns - newest.answers_ns) : 0.0;
  // Beyond the limit nothing is rendered, so that nothing longer has to be remembered.
  round_trip_s_ =
      std::min(parameters_.round_trip_limit_s, std::max(loop_s, round_trip_s_ - kForgotten * dt_s));
  DeviceTrouble now = present(newest, loop_s, now_ns);
  if (now != DeviceTrouble::kNone || latched_ != DeviceTrouble::kNone) {
    coordinates_ = {};
  } else if (newest.received_ns != last_.received_ns && disagrees(newest)) {
    now = DeviceTrouble::kDisagrees;
  }
  last_ = newest;
  if (now != DeviceTrouble::kNone) {
    latched_ = now;
  } else if (latched_ != DeviceTrouble::kNone && !newest.clutch) {
    latched_ = DeviceTrouble::kNone;
  } else if (latched_ != DeviceTrouble::kNone && latched_ != DeviceTrouble::kJumped &&
             latched_ != DeviceTrouble::kDisagrees && latched_ != DeviceTrouble::kRestarted) {
    latched_ = DeviceTrouble::kClutchIn;
  }
  verdict_.trouble = latched_;
  verdict_.longer_s = std::max(0.0, round_trip_s_ - parameters_.loop_s);
  verdict_.hand = latched_ == DeviceTrouble::kNone ? hand_of(newest) : HandState{};
  return verdict_;
}

}  // namespace phantom::teleop
