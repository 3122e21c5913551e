#pragma once

#include <array>
#include <memory>

#include "common/runtime/cell/other_arms.hpp"
#include "components/synthetic_viewer/scene/compositor.hpp"

namespace phantom::synthetic_viewer {

/// What the drawing thread knows of the scene after a round, for who follows the scene stream. Constant.
struct SceneBase {
  ViewerState state;  ///< without what is not in the scene: components and alerts
  /// In a review the moment that is shown, by the recording's clock: `state` is then all that is known of it.
  /// 0: what is shown is live.
  core::Nanoseconds recorded_ns = 0;
  std::shared_ptr<const CellScene> scene;
  RayScene objects;  ///< obstacles without the arm
  HitView hit;
  Compositor::Homes homes;
};

/// What changes between the rounds: the newest samples.
struct LiveSamples {
  ArmSample arm;
  PerceptSample percept;
  MasterSample master;
  GripperSample gripper;
  StopView stops;
  std::array<ArmSample, runtime::kMaxOtherArms> others;  ///< in the order of ViewerState::others
};

}  // namespace phantom::synthetic_viewer
