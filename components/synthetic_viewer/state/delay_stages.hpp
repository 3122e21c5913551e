#pragma once

#include <array>

#include "components/synthetic_viewer/state/state.hpp"

namespace phantom::synthetic_viewer {

/// One stage of the way from the arm's encoders to the viewer.
struct DelayStage {
  const char* name = "";  ///< text "delay.<name>"
  double age_s = -1.0;    ///< that it adds; −1: not known
  double budget_s = 0.0;  ///< beyond which the operator is told
};
inline constexpr std::size_t kDelayStages = 4;

/// Returns how much each stage adds: encoder → slave_io → phantom_sensing → master_io → viewer. The clocks of
/// hosts need not agree: of each sample that is echoed, the time when it came here is reconstructed from a
/// newer one of the same writer, so that a stage counts its own time and the difference between the two ways
/// to this host. Budgets: two periods of slave_io's slowest loop; the link's staleness (0.02 s) for each hop;
/// `staleness.slave_s` for the viewer. Pure.
std::array<DelayStage, kDelayStages> delay_stages(const ViewerState& state, const Staleness& staleness,
                                                  core::Nanoseconds now_ns);

}  // namespace phantom::synthetic_viewer
