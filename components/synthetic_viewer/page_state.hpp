#pragma once

#include <string>

#include "components/synthetic_viewer/cell_scene.hpp"
#include "components/synthetic_viewer/state.hpp"
#include "components/synthetic_viewer/synthetic_viewer.hpp"

namespace phantom::synthetic_viewer {

/// What the page is told besides the state.
struct PageFacts {
  std::string cell;
  bool allow_commands = false;
  bool tool_view = false;
  double frames_per_s = 0.0;
  std::string graphics;
  core::Nanoseconds start_ns = 0;
  std::string message;  ///< what is missing; empty: nothing
};

/// One server-sent event's JSON: link, percept, joints, hits, components, view. Numbers that are not known
/// are null. The page's web/page.js is the only reader. Pure.
std::string page_state_json(const ViewerState& state, const CellScene& scene, const HitView& view,
                            const Staleness& staleness, const PageFacts& facts, core::Nanoseconds now_ns);

/// What GET /stop gives: who is stopped, by each side's own word, and which topics a second process sends.
/// Pure.
std::string stop_json(const StopView& view);

}  // namespace phantom::synthetic_viewer
