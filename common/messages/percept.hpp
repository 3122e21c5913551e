#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/bounded_list.hpp"
#include "common/core/joints.hpp"
#include "common/core/sample_id.hpp"
#include "common/messages/received.hpp"
#include "common/percept/hit_susceptibility.hpp"
#include "common/percept/model_doubt.hpp"
#include "common/percept/motion_class.hpp"
#include "common/robot/drag/reaction.hpp"
#include "common/teleop/rendering/percept_rendering.hpp"
#include "phantom_contract/percept_samples.hpp"

// The samples of the topics of idl/percept.idl as components use them. Units and frames are in the IDL where
// a name does not say them.

namespace phantom::messages {

/// Topic drag_field: the damping coefficients at the pose that slave_echo names. Trivially copyable.
struct DragField {
  core::SampleId stamp;
  core::SampleId slave_echo, master_echo;
  core::SampleId gripper_echo;          ///< 0: the fingers, if there are some, count as at their widest
  std::uint64_t workspace_version = 0;  ///< 0: none yet
  teleop::DragMode mode = teleop::DragMode::kSeparable;
  std::uint32_t joint_count = 0;
  teleop::DragCoefficients drag;  ///< `coupled` is used in that mode only
  robot::JointReaction reaction;  ///< of soft bodies
  double model_age_s = 0.0;

  friend bool operator==(const DragField&, const DragField&) = default;
};

/// A link that may hit an object: the percept at the most urgent of its places there. Trivially copyable.
struct Threat {
  percept::HitRule rule = percept::HitRule::kNone;
  bool raises = false;  ///< false: the rule holds only at the share of the speed limit that keeps an alert up
  std::uint32_t link = 0, sensor = 0;
  std::uint16_t object = 0;
  double mu_Pa_s_per_m = 0.0;
  double closeness = 0.0;  ///< 0…1
  double speed_m_s = 0.0;
  Vector3 position_m{}, velocity_m_s{};  ///< in W
  Vector3 pgv{};                         ///< in W, towards the object; 0: none
  double pgs = 0.0;
  percept::MotionClass motion = percept::MotionClass::kNone;
  percept::TimeToContact contact;

  friend bool operator==(const Threat&, const Threat&) = default;
};
inline constexpr std::size_t kMaxThreats = 16;  ///< as in the IDL

/// Topic percept: the percept of the most urgent threat or, where none threatens, of the worst sensor.
/// Trivially copyable.
struct Percept {
  core::SampleId stamp;
  core::SampleId slave_echo;
  std::uint64_t workspace_version = 0;
  bool valid = false;  ///< false: the values are those of free space
  PerceptCondition condition = PerceptCondition::kFresh;
  double mu_Pa_s_per_m = 0.0;
  double closeness = 0.0;  ///< 0…1
  double speed_m_s = 0.0;
  Vector3 position_m{}, velocity_m_s{};  ///< in W
  Vector3 pgv{};                         ///< in W, towards the object; 0: none
  double pgs = 0.0;
  percept::MotionClass motion = percept::MotionClass::kNone;
  std::uint32_t link = 0, sensor = 0;
  std::uint16_t object = 0;  ///< 0: free space
  std::uint32_t joint_count = 0;
  core::JointArray drag_torque_Nm{};
  double tick_s = 0.0;
  std::uint32_t muted_sensors = 0;
  std::uint16_t allowed_contacts = 0;
  double greatest_mu_Pa_s_per_m = 0.0;             ///< at the worst sensor
  double greatest_closeness = 0.0;                 ///< 0…1, there
  core::BoundedList<Threat, kMaxThreats> threats;  ///< most urgent first

  friend bool operator==(const Percept&, const Percept&) = default;
};

/// The percept of one interest point of the arm.
struct InterestPoint {
  std::string name;
  std::uint32_t link = 0;
  double mu_Pa_s_per_m = 0.0;  ///< 0: free space, or muted
  double closeness = 0.0;      ///< 0…1
  double speed_m_s = 0.0;
  Vector3 position_m{}, velocity_m_s{}, pgv{};  ///< in W
  double pgs = 0.0;
  percept::MotionClass motion = percept::MotionClass::kNone;
  percept::HitRule rule = percept::HitRule::kNone;  ///< the rule that holds now
  std::uint16_t object = 0;
  bool muted = false;

  friend bool operator==(const InterestPoint&, const InterestPoint&) = default;
};

/// Topic interest_points: all interest points of the arm, in the order of the cell file.
struct InterestPoints {
  core::SampleId stamp;
  core::SampleId slave_echo;
  std::uint64_t workspace_version = 0;
  bool valid = false;
  PerceptCondition condition = PerceptCondition::kFresh;
  std::vector<InterestPoint> points;

  friend bool operator==(const InterestPoints&, const InterestPoints&) = default;
};

/// A patch of the skin that is in fluid.
struct SkinPatch {
  std::uint32_t link = 0;
  std::array<float, 3> middle_m{};  ///< centre of its sensors, in the link's frame
  float mu_Pa_s_per_m = 0.0F;

  friend bool operator==(const SkinPatch&, const SkinPatch&) = default;
};

/// Topic skin_percept: where on the arm the skin is in fluid, for display.
struct SkinPercept {
  core::SampleId stamp;
  core::SampleId slave_echo;
  std::uint64_t workspace_version = 0;
  bool valid = false;  ///< false: the skin's state is unknown
  double patch_m = 0.0;
  double greatest_mu_Pa_s_per_m = 0.0;  ///< of all neighbour layers; a patch at this value has closeness 1
  std::uint32_t patch_count = 0;        ///< number of patches of the whole skin
  std::vector<SkinPatch> felt;          ///< patches in fluid

  friend bool operator==(const SkinPercept&, const SkinPercept&) = default;
};

/// Topic hit_alert: a hit threatens. The look-at point is latched in the alert.
struct HitAlert {
  core::SampleId stamp;
  std::int64_t utc_ns = 0;
  std::uint32_t alert = 0;  ///< running number from 1
  percept::HitRule rule = percept::HitRule::kNone;
  std::uint32_t link = 0;
  std::string link_name;
  std::uint32_t sensor = 0;
  std::uint16_t object = 0;
  Vector3 look_at_m{}, pgv{};  ///< in W
  double speed_m_s = 0.0;
  double mu_Pa_s_per_m = 0.0;
  bool cleared = false;
  std::string interest_point;      ///< empty: a place of the skin
  percept::TimeToContact contact;  ///< when it was raised

  friend bool operator==(const HitAlert&, const HitAlert&) = default;
};

inline constexpr std::size_t kMaxDoubts = percept::ModelDoubtMonitor::kPlaces;  ///< as in the IDL

}  // namespace phantom::messages
