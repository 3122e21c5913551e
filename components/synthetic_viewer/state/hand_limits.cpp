#include "components/synthetic_viewer/state/hand_limits.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

#include "common/robot/kinematics/jacobian.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr double kNearEnd = 0.01;        // of a joint's range
constexpr double kSingularBelow = 0.02;  // tool_freedom()

/// Returns what keeps the arm from following at all; empty: it follows.
LocalizedText withheld(const ViewerState& state, const Staleness& staleness, core::Nanoseconds now_ns) {
  const ArmSample& arm = state.arm;
  const MasterSample& master = state.master;
  if (state.stops.in_force || arm.state == LinkState::kStopped) return {"limit.stopped", {}};
  if (arm.received_ns == 0 || age_s(arm.received_ns, now_ns) > staleness.slave_s)
    return {"limit.arm_silent", {}};
  if (master.received_ns == 0 || age_s(master.received_ns, now_ns) > staleness.slave_s)
    return {"limit.master_silent", {}};
  if (!master.motion_permitted) return {"limit.master_switch", {}};
  if (!arm.motion_permitted) return {"limit.arm_switch", {}};
  switch (arm.state) {
    case LinkState::kInit:
      return {"limit.waits", {}};
    case LinkState::kReady:
    case LinkState::kAligned:
      return {"limit.alignment", {}};
    case LinkState::kDegraded:
      return {"limit.link", {}};
    case LinkState::kCoupled:
    case LinkState::kStopped:
      return {};
  }
  return {};
}

}  // namespace

double tool_freedom(const robot::SerialArm& arm, const core::JointArray& position) {
  const auto count = static_cast<Eigen::Index>(arm.joint_count());
  if (count < 3) return 1.0;
  robot::LinkPoses X_WL;
  arm.link_poses(position, X_WL);
  const Eigen::Matrix3Xd J = robot::tool_jacobian(arm, X_WL).topLeftCorner(3, count);
  const Eigen::Vector3d squares =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(J * J.transpose(), Eigen::EigenvaluesOnly).eigenvalues();
  return squares[2] > 0.0 ? std::sqrt(std::max(0.0, squares[0]) / squares[2]) : 0.0;
}

HeldBack held_back(const ViewerState& state, core::Nanoseconds now_ns) {
  constexpr double kStatusStale_s = 1.5;
  const bool limited = state.master.percept_limited;
  const auto master = state.components.find("master_io");
  if (master == state.components.end() || age_s(master->second.received_ns, now_ns) > kStatusStale_s)
    return {.percept_guarded = limited};
  const auto& figures = master->second.figures;
  const auto share = [&figures](const char* name) -> std::optional<double> {
    const auto found = std::ranges::find(figures, name, &core::HealthFigure::name);
    return found == figures.end() ? std::nullopt : std::optional(found->value);
  };
  const auto guarded = share("percept_guarded"), capped = share("percept_capped");
  if (!guarded || !capped) return {.percept_guarded = limited};
  return {limited && *guarded > 0.0, limited && *capped > 0.0, share("feedback_capped").value_or(0.0) > 0.0,
          share("drag_masked").value_or(0.0) > 0.5};
}

std::vector<LocalizedText> hand_limits(const ViewerState& state, std::span<const robot::Joint> joints,
                                       double freedom, const Staleness& staleness, core::Nanoseconds now_ns) {
  if (LocalizedText all = withheld(state, staleness, now_ns); !all.empty()) return {std::move(all)};
  std::vector<LocalizedText> limits;
  const std::size_t count =
      std::min({joints.size(), static_cast<std::size_t>(state.arm.joint_count), core::kMaxJoints});
  for (std::size_t i = 0; i < count; ++i) {
    const robot::Joint& joint = joints[i];
    const double near = kNearEnd * (joint.upper - joint.lower), at = state.arm.position[i];
    if (at < joint.lower + near || at > joint.upper - near)
      limits.push_back({"limit.joint", {{"joint", joint.name}}});
  }
  if (freedom < kSingularBelow) limits.push_back({"limit.singular", {}});
  const MasterSample& master = state.master;
  if (master.feedback_limited)
    limits.push_back({"limit.delay", {{"delay_ms", std::max(0.0, master.round_trip_s) * 1e3}}});
  if (master.feedback_damped) limits.push_back({"limit.damped", {}});
  const HeldBack held = held_back(state, now_ns);
  if (held.percept_guarded) limits.push_back({"limit.percept", {{"gain", master.percept_gain}}});
  if (held.percept_capped) limits.push_back({"limit.percept_capped", {}});
  if (held.feedback_capped) limits.push_back({"limit.feedback_capped", {}});
  if (held.drag_masked) limits.push_back({"limit.masked", {}});
  if (master.force_missing) limits.push_back({"limit.no_force_sensor", {}});
  return limits;
}

}  // namespace phantom::synthetic_viewer
