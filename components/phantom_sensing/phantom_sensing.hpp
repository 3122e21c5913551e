#pragma once

#include <cstdint>
#include <optional>

#include "common/core/joints.hpp"
#include "common/percept/hit_susceptibility.hpp"
#include "common/percept/motion_class.hpp"
#include "common/percept/principal_gradient.hpp"
#include "common/robot/drag.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/robot/skin.hpp"
#include "common/robot/skin_sensing.hpp"
#include "common/voxel/workspace.hpp"

namespace phantom::phantom_sensing {

/// How the percept is made of what the skin feels; see phantom_sensing.yaml for what each figure means.
struct PerceptSettings {
  robot::DragMode mode = robot::DragMode::kSeparable;
  robot::DirectionalLaw directional;
  int gradient_reach_vox = 4;
  int cluster_reach_vox = 3;
  percept::ZoneShape cluster_shape = percept::ZoneShape::kSphere;
  percept::MotionThresholds motion;
  percept::HitThresholds hit;
  percept::AlertTiming alert;
};

/// The phantom: an arm and its skin. Constant after loading.
struct PhantomModel {
  robot::SerialArm arm;
  robot::SkinLayout skin;
};

/// A workspace and what was found out about it beforehand; both outlive the step.
struct SensedWorkspace {
  const voxel::Workspace* voxels = nullptr;
  double greatest_neighbour_mu = 0.0;  ///< Pa·s/m
};

struct StepInputs {
  core::JointArray position{};  ///< rad or m; finite
  core::JointArray velocity{};  ///< rad/s or m/s; finite
  double dt_s = 0.0;            ///< since the step before, ≥ 0
  SensedWorkspace workspace;    ///< none: the result is invalid
  bool state_valid = false;     ///< false: position and velocity are stale; the result is invalid
};

/// What the whole skin perceives: the worst sensor's place and motion. In free space, or if invalid: all
/// zero.
struct SkinPercept {
  robot::WorstSensor worst;
  double closeness = 0.0;  ///< 0…1
  Eigen::Vector3d velocity_W_m_s = Eigen::Vector3d::Zero();
  percept::PrincipalGradient gradient;
  percept::MotionClass motion = percept::MotionClass::kNone;
  percept::HitRule rule = percept::HitRule::kNone;
  core::JointArray drag_torque{};  ///< N·m or N at the given velocity, before gain
};

struct StepOutputs {
  bool valid = false;
  std::uint64_t workspace_version = 0;  ///< 0: none
  std::size_t active_sensors = 0;
  robot::DragCoefficients drag;  ///< all zero if invalid
  SkinPercept percept;
  percept::AlertEvents alerts;
};

/// One tick of the phantom: kinematics, all sensors, drag coefficients, worst sensor, gradient, motion, hits.
/// The same inputs in the same order give the same outputs, bit for bit.
class PhantomSensing {
 public:
  /// The model outlives this. Allocates all that step() needs.
  PhantomSensing(const PhantomModel& model, const PerceptSettings& settings);
  /// Real-time safe: yes (no heap, lock, clock or file). Cost: bounded by the number of sensors.
  void step(const StepInputs& inputs, StepOutputs& outputs) noexcept;

 private:
  void perceive(const StepInputs& inputs, StepOutputs& outputs) noexcept;

  const PhantomModel& model_;
  PerceptSettings settings_;
  robot::SkinSensing sensing_;
  percept::ClusterZone zone_;
  percept::HitMonitor hits_;
  robot::LinkPoses X_WL_;
};

}  // namespace phantom::phantom_sensing
