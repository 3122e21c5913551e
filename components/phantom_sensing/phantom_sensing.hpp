#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/percept/allowed_contact.hpp"
#include "common/percept/hit_susceptibility.hpp"
#include "common/percept/motion_class.hpp"
#include "common/percept/principal_gradient.hpp"
#include "common/robot/drag.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/robot/skin.hpp"
#include "common/robot/skin_sensing.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::phantom_sensing {

/// How the percept is made of what the skin feels; see phantom_sensing.yaml for what each figure means.
struct PerceptSettings {
  robot::DragMode mode = robot::DragMode::kSeparable;
  robot::DirectionalLaw directional;
  int gradient_reach_vox = 4;
  int cluster_reach_vox = 3;
  percept::ZoneShape cluster_shape = percept::ZoneShape::kSphere;
  robot::MemoryWeights memory;    ///< of point sensors; none: no smoothing
  robot::ResponseCurve response;  ///< of cluster sensors
  percept::MotionThresholds motion;
  percept::HitThresholds hit;
  percept::AlertTiming alert;
  /// That share the sensors, the step's own included; 0: one for each kSensorsOfThread, at most as many as
  /// the host has cores. They do not change the result.
  std::size_t threads = 0;
  static constexpr std::size_t kSensorsOfThread = 200'000;
};

/// A place of the arm that is watched by itself, beside the whole skin: an elbow, a motor body.
struct InterestPoint {
  std::string name;
  std::size_t link = 0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the link's frame
};

/// The phantom: an arm, its skin and its interest points. Constant after loading.
struct PhantomModel {
  robot::SerialArm arm;
  robot::SkinLayout skin;
  std::vector<InterestPoint> interest_points;
};

/// A workspace and what was found out about it beforehand; both outlive the step.
struct SensedWorkspace {
  const workspace::Workspace* voxels = nullptr;
  double greatest_neighbour_mu = 0.0;  ///< Pa·s/m
};

struct StepInputs {
  core::JointArray position{};      ///< rad or m; finite
  core::JointArray velocity{};      ///< rad/s or m/s; finite
  double dt_s = 0.0;                ///< since the step before, ≥ 0
  SensedWorkspace workspace;        ///< none: the result is invalid
  bool state_valid = false;         ///< false: position and velocity are stale; the result is invalid
  percept::AllowedContact allowed;  ///< what may be touched now
};

/// What is perceived at one place of the arm: percept parameters of spec 2.5. In free space, or if invalid:
/// all zero.
struct PlacePercept {
  double mu = 0.0;           ///< Pa·s/m
  double closeness = 0.0;    ///< 0…1
  std::uint16_t object = 0;  ///< whose fluid it is; 0: none
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_W_m_s = Eigen::Vector3d::Zero();
  percept::PrincipalGradient gradient;
  percept::MotionClass motion = percept::MotionClass::kNone;
  percept::HitRule rule = percept::HitRule::kNone;
};

/// What the whole skin perceives: the worst sensor's place and motion.
struct SkinPercept : PlacePercept {
  std::size_t link = 0, sensor = 0;  ///< that carries the worst sensor, and its index in the layout
  core::JointArray drag_torque{};    ///< N·m or N at the given velocity, before gain
};

/// What an interest point perceives. Its position and velocity are there also in free space.
struct InterestPercept : PlacePercept {
  percept::AlertEvents alerts;
  bool muted = false;  ///< it meets fluid of an object that it may touch
};

struct StepOutputs {
  bool valid = false;
  std::uint64_t workspace_version = 0;  ///< 0: none
  std::size_t active_sensors = 0;
  robot::DragCoefficients drag;                             ///< all zero if invalid
  robot::DragMode drag_mode = robot::DragMode::kSeparable;  ///< how they become torque
  SkinPercept percept;
  percept::AlertEvents alerts;                ///< of the whole skin
  std::size_t muted_sensors = 0;              ///< sensors that meet fluid of an object that they may touch
  std::span<const InterestPercept> interest;  ///< as the model's points; lasts until the next step
};

/// One tick of the phantom: kinematics, all sensors, drag coefficients, worst sensor, gradient, motion, hits,
/// and the same for each interest point. The same inputs in the same order give the same outputs, bit for
/// bit.
class PhantomSensing {
 public:
  /// The model outlives this. Allocates all that step() needs.
  PhantomSensing(const PhantomModel& model, const PerceptSettings& settings);
  /// Real-time safe: yes (no heap, lock, clock or file). Cost: bounded by the numbers of sensors and interest
  /// points.
  void step(const StepInputs& inputs, StepOutputs& outputs) noexcept;

 private:
  void perceive_skin(const StepInputs& inputs, StepOutputs& outputs) noexcept;
  void perceive_interest_points(const StepInputs& inputs) noexcept;
  percept::HitCandidate perceive_place(const StepInputs& inputs, std::size_t link, workspace::Index3 voxel,
                                       PlacePercept& place) const noexcept;
  void forget() noexcept;
  void mute(const percept::AllowedContact& allowed) noexcept;

  const PhantomModel& model_;
  PerceptSettings settings_;
  robot::SkinSensing sensing_;
  percept::AllowedContact muted_;  // as sensing_ has it
  percept::ClusterZone zone_;
  /// Hits of one place, with the running number of the alert that is up.
  struct Watch {
    percept::HitMonitor hits;
    std::uint32_t alert = 0;
  };
  percept::AlertEvents numbered(Watch& watch, percept::AlertEvents events) noexcept;

  Watch skin_watch_;
  std::vector<Watch> interest_watches_;
  std::vector<InterestPercept> interest_;
  std::uint32_t alerts_raised_ = 0;
  robot::LinkPoses X_WL_;
};

}  // namespace phantom::phantom_sensing
