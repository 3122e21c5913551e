#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "components/synthetic_viewer/review/review.hpp"
#include "components/synthetic_viewer/scene/cell_scene.hpp"
#include "components/synthetic_viewer/state/state.hpp"
#include "components/synthetic_viewer/state/synthetic_viewer.hpp"

namespace phantom::synthetic_viewer {

/// Facts for the page besides the state.
struct PageFacts {
  std::string cell;
  bool allow_commands = false;
  bool tool_view = false;
  double frames_per_s = 0.0;
  std::string graphics;
  core::Nanoseconds start_ns = 0;
  LocalizedText message;                   ///< what is missing; empty: nothing
  std::optional<Review::Position> review;  ///< of the recording that is shown; none: live
  std::string camera = {};                 ///< name of the real camera; empty: there is none
  double main_azimuth_rad = 0.0;           ///< of the main view's default camera, in W
  double gauges_share = 0.0;               ///< of the main picture's height that its strip of numbers covers
};

/// Returns what the page shows besides pictures: link, percept, joints, hits, components, view, review,
/// what limits the hand, and the stages of delay.
/// Unknown numbers are null. Texts may not be UTF-8. Only the page's scripts read it. Pure.
nlohmann::json page_state(const ViewerState& state, const CellScene& scene, const HitView& view,
                          const Staleness& staleness, const PageFacts& facts, core::Nanoseconds now_ns);

/// Returns the response to GET /stop: which sides are stopped, by each side's own report, and which topics a
/// second process sends. Pure.
std::string stop_json(const StopView& view);

}  // namespace phantom::synthetic_viewer
