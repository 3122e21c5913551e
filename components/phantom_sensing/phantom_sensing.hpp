#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/bounded_list.hpp"
#include "common/core/joints.hpp"
#include "common/percept/allowed_contact.hpp"
#include "common/percept/hit_susceptibility.hpp"
#include "common/percept/model_doubt.hpp"
#include "common/percept/motion_class.hpp"
#include "common/percept/principal_gradient.hpp"
#include "common/percept/threat_monitor.hpp"
#include "common/robot/drag/drag.hpp"
#include "common/robot/kinematics/model_identity.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "common/robot/sensing/soft_sensing.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/workspace/workspace.hpp"
#include "components/phantom_sensing/gradient_cache.hpp"
#include "components/phantom_sensing/prospects.hpp"

namespace phantom::phantom_sensing {

/// When what the arm feels contradicts the model.
struct DoubtSettings {
  int tolerance_vox = 4;          ///< the model may be wrong by so much; at most percept::kMaxNearVoxels
  double rest_speed_m_s = 0.005;  ///< slower is rest
  percept::DoubtTiming timing;
};

/// Settings from which the percept is computed; phantom_sensing.yaml explains each value.
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
  DoubtSettings doubt;
  /// Number of threads that share the sensors, including the one that calls step(). 0: one for each
  /// kSensorsOfThread sensors, at most as many as the host has cores. It does not affect the result.
  std::size_t threads = 0;
  static constexpr std::size_t kSensorsOfThread = 200'000;
};

/// A place on the arm that is monitored individually, beside the whole skin: an elbow, a motor body.
struct InterestPoint {
  std::string name;
  std::size_t link = 0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the link's frame, with an open gripper
  Eigen::Vector3d closing_m = Eigen::Vector3d::Zero();   ///< its way as the gripper closes
};

/// How far a gripper is closed: 0 at its widest, 1 closed.
struct Fingers {
  double closed = 0.0, closing_per_s = 0.0;
};

/// What the arm feels of its surroundings, as slave_state has it.
struct FeltForce {
  bool known = false;    ///< a contact would be reported
  bool contact = false;  ///< something touches the arm
  bool located = false;  ///< point_W_m is known
  Eigen::Vector3d point_W_m = Eigen::Vector3d::Zero();
  double force_N = -1.0;       ///< −1: not known
  bool torques_known = false;  ///< torque_Nm is
  core::JointArray torque_Nm{};
};

/// A link of another arm as it is now: the fluid around it, where it is, and how it moves.
struct OtherLink {
  const workspace::Workspace* fluid = nullptr;  ///< in the link's frame
  double greatest_neighbour_mu = 0.0;           ///< Pa·s/m, of that fluid
  geometry::Pose X_WL;
  Eigen::Vector3d linear_W_m_s = Eigen::Vector3d::Zero();  ///< velocity of the link's origin
  Eigen::Vector3d angular_W_rad_s = Eigen::Vector3d::Zero();
  /// Returns the velocity of the fluid at a place. Real-time safe: yes.
  Eigen::Vector3d velocity_W(const Eigen::Vector3d& position_W_m) const noexcept {
    return linear_W_m_s + angular_W_rad_s.cross(position_W_m - X_WL.translation_m);
  }
};
inline constexpr std::size_t kMaxOtherLinks = robot::SkinSensing::kMaxFluids;

/// Greatest number of shares of a skin that other processes sense.
inline constexpr std::size_t kMaxShares = 4;

/// Links whose skin a process of its own senses.
struct SkinShare {
  std::string name;
  robot::LinkSet links;
  /// DDS partition of the workspace of its own that it is sensed in; empty: in the arm's.
  std::string partition = {};
  bool has_own_workspace() const noexcept { return !partition.empty(); }
};

/// The phantom: an arm with its skin and interest points. Constant after loading.
struct PhantomModel {
  robot::SerialArm arm;
  robot::SkinLayout skin;
  std::vector<InterestPoint> interest_points = {};
  std::string name = {};                 ///< the arm's, in the cell file
  robot::SkinOptions skin_options = {};  ///< from which `skin` was laid out
  robot::Medium medium = {};             ///< that fills the space around the cell's objects
  std::vector<robot::SoftBody> soft_bodies = {};
  std::vector<SkinShare> shares = {};    ///< at most kMaxShares; no link is in two
  std::optional<std::size_t> own_share;  ///< the one that this process senses, and nothing else; none: it is
                                         ///< the arm's process

  robot::ModelIdentity identity = {};  ///< by which others know arm and cell

  std::size_t other_links = 0;  ///< greatest number of StepInputs::others, at most kMaxOtherLinks
  /// The first link at which the arm feels what touches it: behind a sensor at the wrist, say.
  std::size_t first_feeling_link = 1;

  /// Returns whether the arm has a gripper that moves what is sensed.
  bool has_fingers() const noexcept {
    return !skin.closing_m.empty() ||
           std::any_of(interest_points.begin(), interest_points.end(),
                       [](const InterestPoint& point) { return !point.closing_m.isZero(0.0); });
  }
};

/// Returns the options with which a skin of the model with so many sensors senses.
robot::SensingOptions sensing_options(const PhantomModel& model, const PerceptSettings& settings,
                                      std::size_t sensors);

/// Bounds of a link's sensors in its frame, wherever a gripper's fingers are.
struct LinkBox {
  std::size_t link;
  Eigen::AlignedBox3d box_m;
};
/// Returns those of the own share's links in a layout of the model's skin; none if the own share has no
/// workspace of its own. Not real-time safe.
std::vector<LinkBox> boxes_of_share(const PhantomModel& model, const robot::SkinLayout& layout);

/// A workspace, a value precomputed from it, and the skin that belongs to it; all must outlive the step.
struct SensedWorkspace {
  const workspace::Workspace* voxels = nullptr;
  double greatest_neighbour_mu = 0.0;  ///< Pa·s/m
  /// Senses with the skin of the arm and of what it carries in this version; null: it carries nothing.
  robot::SkinSensing* carrying = nullptr;
  /// Tells what the arm carries from all else that it may carry, alike in every process; 0: nothing.
  std::uint64_t carried_key = 0;
  /// boxes_of_share() of that skin; null: of the model's.
  const std::vector<LinkBox>* boxes = nullptr;
};

/// Objects of which a depth camera sees that they do not stand where the model has them. Bounded; real-time
/// safe: yes.
class DisplacedObjects {
 public:
  static constexpr std::size_t kMax = 64;

  /// Where there are more than kMax, every object counts as displaced.
  void add(std::uint16_t id) noexcept { all_ = !ids_.push_back(id) || all_; }
  bool contains(std::uint16_t id) const noexcept {
    return id != 0 && (all_ || std::ranges::find(ids_, id) != ids_.end());
  }

 private:
  core::BoundedList<std::uint16_t, kMax> ids_;
  bool all_ = false;
};

struct StepInputs {
  core::JointArray position{};        ///< rad or m; finite
  core::JointArray velocity{};        ///< rad/s or m/s; finite
  double dt_s = 0.0;                  ///< time since the previous step, ≥ 0
  SensedWorkspace workspace;          ///< if none, the result is invalid
  bool state_valid = false;           ///< false: position and velocity are stale, and the result is invalid
  percept::AllowedContact allowed;    ///< contacts allowed now
  Fingers fingers;                    ///< as long as their width is not known: at their widest
  std::span<const OtherLink> others;  ///< links of other arms, as they are now
  FeltForce force;
  DisplacedObjects displaced;
};

/// The percept at one place of the arm: the percept parameters of spec 2.5. All zero in free space and if
/// invalid.
struct PlacePercept {
  double mu = 0.0;           ///< Pa·s/m
  double closeness = 0.0;    ///< 0…1
  std::uint16_t object = 0;  ///< id of the object that the fluid belongs to; 0: none
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero();
  /// Of the place, relative to the fluid that it is in: that moves with the object (another arm's link).
  Eigen::Vector3d velocity_W_m_s = Eigen::Vector3d::Zero();
  percept::PrincipalGradient gradient;
  percept::MotionClass motion = percept::MotionClass::kNone;
  percept::HitRule rule = percept::HitRule::kNone;
  percept::TimeToContact contact;
};

/// The percept at a sensor: of a link, and by its index in the layout.
struct SensorPercept : PlacePercept {
  std::size_t link = 0, sensor = 0;
};

/// A link that an object threatens: the percept at the most urgent of its places there.
struct Threat : SensorPercept {
  std::int32_t interest_point = -1;  ///< whose place it is; −1: the skin's
  /// Whether the rule holds at the full speed limit, so that an alert is raised. False: only at the share of
  /// it that keeps an alert up.
  bool raises = false;
};
/// Returns whether a threat is more urgent than another one: one that raises an alert before one that only
/// keeps it up; then the sooner contact, and a contact that nears before one that does not; then the greater
/// μ; then the lower link, object and sensor. A total order. Real-time safe: yes.
bool more_urgent(const Threat& a, const Threat& b) noexcept;

/// The most urgent threats, each link and object once. Real-time safe: yes.
class ThreatList : public core::BoundedList<Threat, percept::ThreatMonitor::kMax> {
 public:
  /// Keeps a threat, unless a more urgent one of the same link and object is there, or as many more urgent
  /// ones as there is room for. What is kept does not depend on the order of the offers.
  void offer(const Threat& threat) noexcept;
  void sort() noexcept;  ///< most urgent first
};

/// The percept that leads tone and view: at the most urgent threat's place or, where none threatens, at the
/// worst sensor.
struct SkinPercept : SensorPercept {
  core::JointArray drag_torque{};  ///< N·m or N at the given velocity, before gain
};

/// The percept of an interest point. Position and velocity are set in free space too.
struct InterestPercept : PlacePercept {
  bool muted = false;  ///< it is in fluid of an object that it may touch
};

struct StepOutputs {
  bool valid = false;
  /// A share's process with a workspace of its own: a link reaches out of it, so nothing is sensed.
  bool outside = false;
  std::uint64_t workspace_version = 0;  ///< 0: none
  std::uint64_t carried_key = 0;        ///< SensedWorkspace::carried_key
  std::size_t active_sensors = 0;
  robot::DragCoefficients drag;                             ///< all zero if invalid
  robot::JointReaction reaction;                            ///< of soft bodies; all zero if invalid
  robot::DragMode drag_mode = robot::DragMode::kSeparable;  ///< the law that turns them into torque
  SkinPercept percept;  ///< of the arm's process; that of a share has the worst sensor here
  /// The worst sensor: the one of greatest μ on the whole skin. Its closeness is the greatest there is.
  SensorPercept worst;
  ThreatList threats;  ///< most urgent first
  percept::ThreatMonitor::Changes alerts;
  percept::ModelDoubtMonitor::Changes doubts;
  /// A doubt holds, or the object that leads the percept is displaced.
  bool model_in_doubt = false;
  std::size_t muted_sensors = 0;  ///< sensors in fluid of an object that they may touch
  /// In the order of the model's interest points; valid until the next step.
  std::span<const InterestPercept> interest;
  Eigen::Vector3d tip_W_m = Eigen::Vector3d::Zero();  ///< where the arm's tip is, if valid
};

/// What another process has sensed of a share's links, at the same pose, in the same workspace or in one of
/// the share's own.
struct SensedShare {
  robot::DragCoefficients drag;  ///< of these links alone
  float mu = 0.0F;               ///< Pa·s/m, at the worst sensor; 0: all are in free space
  std::size_t sensor = 0;        ///< the worst, by its index in the whole layout of that process
  std::size_t muted_sensors = 0;
  ThreatList threats = {};
  // Of a share with a workspace of its own: the percept at the worst sensor, and its link.
  PlacePercept place = {};
  std::size_t link = 0;
  std::uint64_t carried_key = 0;       ///< of such a share: with what it was sensed
  robot::JointReaction reaction = {};  ///< of soft bodies to these links alone
};
/// By the model's shares; null: this process senses them.
using SensedShares = std::array<const SensedShare*, kMaxShares>;

/// Computes one tick of the phantom: kinematics, all sensors, drag coefficients, worst sensor, gradient,
/// motion, the same for each interest point, and which links threaten to hit which objects. The same inputs
/// in the same order give the same outputs, bit for bit, whoever senses the shares of the skin in the arm's
/// workspace. The coefficients of the arm, and what soft bodies do to it, are those of the links in no share
/// plus those of each share, in that order; without shares they differ from that by rounding. A share with a
/// workspace of its own, whose voxels are finer, say, is felt as its process has sensed it there
/// (thesis 7.3(2)); as long as that has sensed nothing, or the arm carries something else there, as the arm's
/// workspace has it.
class PhantomSensing {
 public:
  /// Allocates all memory that step() needs. The model must outlive this.
  PhantomSensing(const PhantomModel& model, const PerceptSettings& settings);
  PhantomSensing(const PhantomSensing&) = delete;
  PhantomSensing& operator=(const PhantomSensing&) = delete;
  /// Real-time safe: yes (no heap, lock, clock or file). Cost: bounded by the numbers of sensors and interest
  /// points.
  void step(const StepInputs& inputs, StepOutputs& outputs) noexcept {
    begin(inputs, outputs);
    end(inputs, {}, outputs);
  }
  /// The same in two parts, between which others can finish their shares. begin() senses the links in no
  /// share; end() adds the shares and senses those that are null, or that are not so here (their worst sensor
  /// does not meet their μ). Returns how many it has sensed. Real-time safe: yes, both.
  void begin(const StepInputs& inputs, StepOutputs& outputs) noexcept;
  std::size_t end(const StepInputs& inputs, const SensedShares& shares, StepOutputs& outputs) noexcept;
  /// Senses with that skin from now on, as SensedWorkspace names it, until the next call; what it senses with
  /// now must live until this returns. step() calls it, too. Real-time safe: yes (no heap, lock, clock or
  /// file).
  void set_active_skin(robot::SkinSensing* carrying) noexcept;
  /// Greatest number of a link's sensors in one fluid that are looked at because they may be too fast near an
  /// object whose threat is not found yet: all of the shipped arms'. Of more, so many evenly chosen.
  static constexpr std::size_t kMaxFastPlaces = 8192;

 private:
  void add_drag_of(const robot::LinkSet& links, const StepInputs& inputs, StepOutputs& outputs) noexcept;
  void add_reaction_of(const robot::LinkSet& links, const StepInputs& inputs, StepOutputs& outputs) noexcept;
  bool take_share(const StepInputs& inputs, std::size_t which, const SensedShare& share,
                  StepOutputs& outputs) noexcept;
  bool reaches_out(const SensedWorkspace& workspace) const noexcept;
  percept::HitSituation situation_of(const PlacePercept& place) const noexcept;
  void perceive_worst(const StepInputs& inputs, StepOutputs& outputs) const noexcept;
  void perceive_interest_points(const StepInputs& inputs, ThreatList& threats) noexcept;
  /// A place of the arm in fluid: of the workspace (0), or of others[fluid − 1], whose grid `voxel` is in.
  struct Felt {
    std::size_t link;
    Eigen::Vector3d closing_m;
    workspace::Index3 voxel;
    std::size_t fluid;
  };
  void perceive_place(const StepInputs& inputs, const Felt& felt, PlacePercept& place) const noexcept;
  void classify(PlacePercept& place) const noexcept;
  Felt feel(const StepInputs& inputs, const InterestPoint& point, InterestPercept& percept) const noexcept;
  Eigen::Vector3d velocity_W(const StepInputs& inputs, std::size_t link, const Eigen::Vector3d& closing_m,
                             const Eigen::Vector3d& position_W_m) const noexcept;
  // Threats (threats.cpp).
  bool offer(const Threat& threat, ThreatList& threats) const noexcept;
  void time_contact(const StepInputs& inputs, std::size_t fluid, PlacePercept& place) const noexcept;
  struct LinkInFluid;
  void search(const LinkInFluid& in, Prospects& found) const noexcept;
  bool assess(const StepInputs& inputs, std::size_t link, std::uint16_t object, const Prospect& prospect,
              ThreatList& threats) const noexcept;
  void assess(const StepInputs& inputs, std::size_t link, const Prospects& found,
              ThreatList& threats) const noexcept;
  void complete(const StepInputs& inputs, const LinkInFluid& in, std::size_t& gradients,
                ThreatList& threats) noexcept;
  void assess_fast_places(const StepInputs& inputs, const LinkInFluid& in, std::size_t& gradients,
                          ThreatList& threats) noexcept;
  void find_threats(const StepInputs& inputs, StepOutputs& outputs) noexcept;
  void lead(StepOutputs& outputs) const noexcept;
  void alert(double dt_s, StepOutputs& outputs) noexcept;
  // Doubts (doubts.cpp).
  void doubt(const StepInputs& inputs, const SensedShares& shares, StepOutputs& outputs) noexcept;
  bool may_touch_unseen(const StepInputs& inputs, const SensedShares& shares,
                        const StepOutputs& outputs) const noexcept;
  std::optional<percept::DoubtEvidence> force_in_free_space(const StepInputs& inputs) const noexcept;
  std::optional<percept::DoubtEvidence> no_force_inside(const StepInputs& inputs) const noexcept;
  std::size_t first_touched_link(const FeltForce& force) const noexcept;
  std::optional<std::size_t> link_at(const Eigen::Vector3d& point_W_m, double within_m) const noexcept;
  bool is_near_body(const StepInputs& inputs, std::size_t link) const noexcept;
  void locate(const StepInputs& inputs, percept::DoubtEvidence& evidence) const noexcept;
  double tolerance_m(const workspace::Workspace& voxels) const noexcept;

  void forget(StepOutputs& outputs) noexcept;
  void mute(const percept::AllowedContact& allowed) noexcept;
  void set_muted(const percept::AllowedContact& contacts, bool muted) noexcept;

  const PhantomModel& model_;
  PerceptSettings settings_;
  robot::SkinSensing own_sensing_;
  robot::SkinSensing* sensing_ = &own_sensing_;  // or that of the arm with what it carries
  robot::SoftSensing soft_;
  percept::AllowedContact muted_;  // as last set in *sensing_
  percept::ClusterZone zone_;
  percept::ThreatMonitor monitor_;
  percept::ModelDoubtMonitor doubts_;
  double since_doubt_s_ = 0.0;          // since what is felt was last held against the model
  Prospects prospects_;                 // of the link in turn
  std::vector<FastPlace> fast_places_;  // likewise; at most kMaxFastPlaces
  GradientCache gradients_;             // of the workspace's voxels
  double greatest_way_m_ = 0.0;         // of a sensor on the gripper's fingers
  std::vector<InterestPercept> interest_;
  robot::LinkPoses X_WL_;
  robot::LinkSet own_links_;
  robot::LinkSums sums_of_links_;
  robot::DragCoefficients drag_of_links_;
  robot::JointReaction reaction_of_links_;
  std::size_t muted_elsewhere_ = 0;
  const SensedShare* worst_remote_ = nullptr;  // of shares with workspaces of their own, in this step
  SensedShares sensed_elsewhere_{};            // that were taken in this step
  std::vector<LinkBox> boxes_;                 // of the own share, if it has a workspace of its own
  std::array<robot::MovingFluid, kMaxOtherLinks> fluids_;
  std::array<robot::MovingSums, kMaxOtherLinks> flows_;
};

}  // namespace phantom::phantom_sensing
