#include "components/synthetic_viewer/samples/recent_samples.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr core::Nanoseconds kStillTrue_ns = 50 * core::kNsPerMillisecond;

template <class Array>
void blend(Array& values, const Array& towards, double share) {
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += share * (towards[i] - values[i]);
}

ArmSample between(const Past<ArmSample>& samples, core::Nanoseconds time_ns, core::Nanoseconds silence_ns) {
  const auto around = samples.at(time_ns, kStillTrue_ns, silence_ns);
  if (!around) return {};
  ArmSample arm = around->before;
  blend(arm.position, around->after.position, around->share);
  arm.received_ns = time_ns;
  return arm;
}

}  // namespace

ArmSample RecentSamples::arm_at(core::Nanoseconds time_ns, core::Nanoseconds silence_ns) const {
  return between(arms, time_ns, silence_ns);
}

ArmSample RecentSamples::other_at(std::size_t other, core::Nanoseconds time_ns,
                                  core::Nanoseconds silence_ns) const {
  return between(others[other], time_ns, silence_ns);
}

PerceptSample RecentSamples::percept_at(core::Nanoseconds time_ns, core::Nanoseconds silence_ns) const {
  const auto around = percepts.at(time_ns, silence_ns, silence_ns);
  if (!around) return {};
  PerceptSample percept = around->before;
  if (percept.valid && around->after.valid && percept.link == around->after.link) {
    blend(percept.position_m, around->after.position_m, around->share);
    blend(percept.velocity_m_s, around->after.velocity_m_s, around->share);
    percept.closeness += around->share * (around->after.closeness - percept.closeness);
  }
  percept.received_ns = time_ns;
  return percept;
}

GripperSample RecentSamples::gripper_at(core::Nanoseconds time_ns, core::Nanoseconds silence_ns) const {
  const auto around = grippers.at(time_ns, kStillTrue_ns, silence_ns);
  if (!around) return {};
  GripperSample gripper = around->before;
  gripper.sense.width_m += around->share * (around->after.sense.width_m - gripper.sense.width_m);
  gripper.received_ns = time_ns;
  return gripper;
}

}  // namespace phantom::synthetic_viewer
