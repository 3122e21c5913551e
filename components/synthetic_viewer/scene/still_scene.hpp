#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/runtime/cell/cell.hpp"
#include "common/workspace/workspace.hpp"
#include "components/synthetic_viewer/render/renderer.hpp"
#include "components/synthetic_viewer/scene/cell_scene.hpp"
#include "components/synthetic_viewer/state/state.hpp"

namespace phantom::synthetic_viewer {

/// A cell with its arm in one pose, in the state that the topics would give, but without any topic: the cell
/// is activated and the phantom's skin evaluated in this process. For pictures, tests of them and benchmarks.
struct StillScene {
  CellScene scene;
  ViewerState state;  ///< arm, objects, percept, skin, workspace; received at kNow_ns
  std::size_t triangles = 0;
  std::shared_ptr<const workspace::Workspace> workspace = nullptr;  ///< in which the skin was evaluated
  static constexpr core::Nanoseconds kNow_ns = core::kNsPerSecond;
  /// Returns the worst sensor as hit alert number 1. Its object is 0 if nothing is near.
  HitSample hit() const;
};

struct StillPose {
  std::string arm;               ///< arm of the cell; empty: the only one
  std::vector<double> position;  ///< rad or m, one per joint; empty: the arm's home
  std::vector<double> velocity;  ///< rad/s or m/s, one per joint; empty: at rest
};

/// Makes the scene, which takes seconds because the whole cell is activated. The meshes go to `renderer`,
/// which must outlive the scene. Throws core::ConfigError naming what does not fit, core::MissingError for a
/// missing file.
StillScene make_still_scene(const runtime::CellConfig& cell, const StillPose& pose, Renderer& renderer);

}  // namespace phantom::synthetic_viewer
