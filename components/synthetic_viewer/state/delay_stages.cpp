#include "components/synthetic_viewer/state/delay_stages.hpp"

#include <algorithm>

namespace phantom::synthetic_viewer {
namespace {

constexpr double kHopBudget_s = 0.02;  // the link's staleness, as LinkTiming has it by default
constexpr double kUsualPeriod_s = 0.001;

/// Returns the time from the receipt here of the sample that `echo` names to `used_ns`, when its use was
/// heard of. `newest` is of the same writer and came at `newest_ns`. −1: not known.
double hop_s(const core::SampleId& echo, const core::SampleId& newest, core::Nanoseconds newest_ns,
             core::Nanoseconds used_ns) {
  if (used_ns == 0 || newest_ns == 0 || echo.sequence_number == 0 || echo.session != newest.session)
    return -1.0;
  const core::Nanoseconds echoed_ns = echo.monotonic_ns + (newest_ns - newest.monotonic_ns);
  return std::max(0.0, core::seconds(used_ns - echoed_ns));
}

/// From an encoder's reading to its slave_state: a period of slave_io's servo, and how late that wakes up.
DelayStage encoder_stage(const ViewerState& state) {
  DelayStage stage{"encoder", -1.0, 2 * kUsualPeriod_s};
  for (const auto& [key, component] : state.components) {
    if (component.component != "slave_io") continue;
    for (const core::LoopStatistics& loop : component.loops) {
      if (loop.name != "servo" || loop.period_s <= 0) continue;
      stage.budget_s = 2 * loop.period_s;
      stage.age_s = loop.period_s + loop.wakeup_p99_us * 1e-6;
    }
  }
  return stage;
}

}  // namespace

std::array<DelayStage, kDelayStages> delay_stages(const ViewerState& state, const Staleness& staleness,
                                                  core::Nanoseconds now_ns) {
  const ArmSample& arm = state.arm;
  const PerceptSample& percept = state.percept;
  const MasterSample& master = state.master;
  const double shown_s = master.received_ns == 0 ? -1.0 : age_s(master.received_ns, now_ns);
  return {
      {encoder_stage(state),
       {"sensing", hop_s(percept.slave_echo, arm.stamp, arm.received_ns, percept.received_ns), kHopBudget_s},
       {"master", hop_s(master.drag_echo, percept.stamp, percept.received_ns, master.received_ns),
        kHopBudget_s},
       {"viewer", shown_s, staleness.slave_s}}};
}

}  // namespace phantom::synthetic_viewer
