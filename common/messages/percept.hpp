#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/core/sample_id.hpp"
#include "common/messages/received.hpp"
#include "common/percept/hit_susceptibility.hpp"
#include "common/percept/motion_class.hpp"
#include "common/teleop/percept_rendering.hpp"

// What the topics of idl/percept.idl tell, as components work with it; units and frames are in the IDL where
// a name does not say them.

namespace phantom::messages {

/// Topic drag_field: damping coefficients of the pose that slave_echo names. Trivially copyable.
struct DragField {
  core::SampleId stamp;
  core::SampleId slave_echo, master_echo;
  std::uint64_t workspace_version = 0;  ///< 0: none yet
  teleop::DragMode mode = teleop::DragMode::kSeparable;
  std::uint32_t joint_count = 0;
  teleop::DragCoefficients drag;  ///< `coupled` counts in that mode alone
  double model_age_s = 0.0;

  friend bool operator==(const DragField&, const DragField&) = default;
};

/// What a percept rests on, and so whether it counts.
enum class PerceptCondition {
  kFresh,                ///< valid
  kWorkspaceUnattended,  ///< valid, marked: nobody is there who would tell of changes
  kWorkspaceBehind,      ///< valid, marked: a newer version was announced and is not whole yet
  kWorkspaceStale,       ///< invalid: one of these two has lasted too long
  kNoWorkspace,          ///< invalid: none came yet
  kNoState,              ///< invalid: no slave_state came yet
  kStateStale,           ///< invalid: the last slave_state is too old
  kSelfTestFailed        ///< invalid: a virtual probe did not perceive what it must
};

/// Topic percept: for the whole skin, by its worst sensor. Trivially copyable.
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

  friend bool operator==(const Percept&, const Percept&) = default;
};

/// What one interest point of the arm perceives.
struct InterestPoint {
  std::string name;
  std::uint32_t link = 0;
  double mu_Pa_s_per_m = 0.0;  ///< 0: free space, or muted
  double closeness = 0.0;      ///< 0…1
  double speed_m_s = 0.0;
  Vector3 position_m{}, velocity_m_s{}, pgv{};  ///< in W
  double pgs = 0.0;
  percept::MotionClass motion = percept::MotionClass::kNone;
  percept::HitRule rule = percept::HitRule::kNone;  ///< that holds now
  std::uint16_t object = 0;
  bool muted = false;

  friend bool operator==(const InterestPoint&, const InterestPoint&) = default;
};

/// Topic interest_points: every one of the arm, in the order of the cell file.
struct InterestPoints {
  core::SampleId stamp;
  core::SampleId slave_echo;
  std::uint64_t workspace_version = 0;
  bool valid = false;
  PerceptCondition condition = PerceptCondition::kFresh;
  std::vector<InterestPoint> points;

  friend bool operator==(const InterestPoints&, const InterestPoints&) = default;
};

/// A patch of the skin that meets fluid.
struct SkinPatch {
  std::uint32_t link = 0;
  std::array<float, 3> middle_m{};  ///< of its sensors, in the link's frame
  float mu_Pa_s_per_m = 0.0F;

  friend bool operator==(const SkinPatch&, const SkinPatch&) = default;
};

/// Topic skin_percept: where on the arm the skin feels something, to paint it.
struct SkinPercept {
  core::SampleId stamp;
  core::SampleId slave_echo;
  std::uint64_t workspace_version = 0;
  bool valid = false;  ///< false: nothing is known of the skin
  double patch_m = 0.0;
  double greatest_mu_Pa_s_per_m = 0.0;  ///< of any neighbour layer: that patch's closeness is 1
  std::uint32_t patch_count = 0;        ///< patches that the skin has
  std::vector<SkinPatch> felt;          ///< those that meet fluid

  friend bool operator==(const SkinPercept&, const SkinPercept&) = default;
};

/// Topic hit_alert: a hit threatens; the look-at point is latched here.
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
  std::string interest_point;  ///< empty: the whole skin's

  friend bool operator==(const HitAlert&, const HitAlert&) = default;
};

}  // namespace phantom::messages
