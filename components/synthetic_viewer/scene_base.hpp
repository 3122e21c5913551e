#pragma once

#include <array>
#include <memory>

#include "common/runtime/other_arms.hpp"
#include "components/synthetic_viewer/compositor.hpp"

namespace phantom::synthetic_viewer {

/// What the drawing thread knows of the scene after a round, for who follows the scene stream. Constant.
struct SceneBase {
  ViewerState state;  ///< without what is not in the scene: components and alerts
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
  std::array<ArmSample, runtime::kMostOtherArms> others;  ///< in the order of ViewerState::others
};

}  // namespace phantom::synthetic_viewer
