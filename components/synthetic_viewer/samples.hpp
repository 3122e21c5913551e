#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"
#include "common/core/joints.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::synthetic_viewer {

// What the topics bring, checked, in the viewer's own types. `received_ns` is CLOCK_MONOTONIC of this host; 0
// stands for "nothing received yet". Vectors are in W, SI units.

using Vector3 = std::array<double, 3>;
inline Eigen::Vector3d eigen(const Vector3& v) { return {v[0], v[1], v[2]}; }

enum class LinkState { kInit, kReady, kAligned, kCoupled, kDegraded, kStopped };
/// Why a side is stopped; of several causes the first.
enum class StopCause { kNone, kEmergency, kDriveFault, kPartner };
enum class MotionClass { kNone, kSafe, kNeutral, kDangerous };
enum class HitRule { kNone, kVeryClose, kModerateMoving, kFarNearing };

struct ArmSample {  // slave_state
  core::Nanoseconds received_ns = 0;
  LinkState state = LinkState::kInit;
  StopCause stop_cause = StopCause::kNone;
  std::uint64_t stop = 0;       ///< names the stop in force; 0: none
  core::JointArray position{};  ///< rad or m
  core::JointArray velocity{};  ///< rad/s or m/s
  bool contact = false;
  double contact_force_N = -1.0;  ///< −1: not measured
  std::uint16_t contact_object = 0;
  Vector3 contact_point_m{};
  double tool_speed_m_s = 0.0;
  std::uint64_t arrived = 0,
                lost = 0;  ///< samples since the viewer joined: that came, and whose numbers never did
};

struct PerceptSample {
  core::Nanoseconds received_ns = 0;
  bool valid = false;
  double mu_Pa_s_per_m = 0.0;
  double closeness = 0.0;  ///< 0…1
  double speed_m_s = 0.0;
  Vector3 position_m{}, velocity_m_s{}, pgv{};
  MotionClass motion = MotionClass::kNone;
  std::uint32_t link = 0;
  std::uint16_t object = 0;  ///< 0: free space
  core::JointArray drag_torque_Nm{};
};

struct MasterSample {
  core::Nanoseconds received_ns = 0;
  LinkState state = LinkState::kInit;
  StopCause stop_cause = StopCause::kNone;
  std::uint64_t stop = 0;  ///< names the stop in force; 0: none
  core::JointArray percept_torque_Nm{}, feedback_torque_Nm{};
  double percept_gain = 0.0, feedback_gain = 0.0;
  std::uint32_t law = 0;  ///< case a…e of Table 5.1 as 0…4
  bool percept_enabled = false, percept_limited = false, feedback_damped = false, force_missing = false;
  std::int32_t reach = -1;
  double round_trip_s = -1.0;  ///< −1: none
};

struct HitSample {
  core::Nanoseconds received_ns = 0;
  std::int64_t utc_ns = 0;
  std::uint32_t alert = 0;
  HitRule rule = HitRule::kNone;
  std::uint32_t link = 0;
  std::string link_name;
  std::uint16_t object = 0;
  Vector3 look_at_m{}, pgv{};
  double speed_m_s = 0.0;
  double mu_Pa_s_per_m = 0.0;
  bool cleared = false;
  // Arm and percept as they were when the alert came, for its pictures: these may be drawn much later.
  ArmSample arm;
  PerceptSample percept;
};

struct ObjectSample {  // workspace_object
  std::uint16_t id = 0;
  std::string name;
  std::uint64_t mesh_hash = 0;
  geometry::Pose X_WO;
  std::array<float, 3> colour{};
};
struct ObjectGone {
  std::uint16_t id = 0;
};

struct WorkspaceSample {  // workspace_version
  std::uint64_t version = 0;
  double voxel_size_m = 0.0;
};

struct SkinPatchSample {
  std::size_t link = 0;
  std::array<float, 3> middle_m{};  ///< in the link's frame
  float closeness = 0.0F;           ///< 0…1

  friend bool operator==(const SkinPatchSample&, const SkinPatchSample&) = default;
};
struct SkinSample {  // skin_percept
  core::Nanoseconds received_ns = 0;
  bool valid = false;
  double patch_m = 0.0;  ///< edge of a patch
  std::vector<SkinPatchSample> felt;
};

struct MeshChunkSample {
  std::uint64_t mesh_hash = 0;
  std::uint32_t chunk = 0, chunk_count = 0, vertex_count = 0, triangle_count = 0;
  std::vector<std::uint8_t> data;
};

struct ComponentSample {  // component_status
  core::Nanoseconds received_ns = 0;
  std::string name, host, message;
  core::ComponentState state = core::ComponentState::kStarting;
  std::vector<core::LoopStatistics> loops;
  std::vector<core::HealthFigure> figures;
  std::uint64_t refused = 0, deadline_missed = 0, incompatible_qos = 0;  ///< added up over its endpoints
};

/// The view that the operator looks at, for view_pose.
struct ViewPoseSample {
  core::Nanoseconds made_ns = 0;  ///< CLOCK_MONOTONIC; 0: not yet
  bool hit_zone = false;          ///< else the main view
  int node = 0;                   ///< numbered as operator_command's; 0: at none
  bool automatic = false;         ///< the viewer chose the node
  geometry::Pose X_WC;            ///< camera: x right, y up, z backward
  Vector3 look_at_m{};            ///< in W
};

enum class CommandKind {
  kEmergencyStop,
  kReset,
  kSetPerceptGain,
  kSetFeedbackGain,
  kEnablePercept,
  kViewHold,
  kViewNode,
  kSetLaw,
  kMark,
};
struct Command {
  CommandKind kind = CommandKind::kEmergencyStop;
  double value = 0.0;
};

/// What became of a command, for the one who gave it.
struct CommandOutcome {
  enum class Kind {
    kDone,       ///< by the word of everyone who must carry it out; sent, where nobody has to answer
    kRefused,    ///< by one of them: `message` says why, and what is allowed
    kUnanswered  ///< not by everyone within the time
  };
  Kind kind = Kind::kDone;
  std::string message;
};

}  // namespace phantom::synthetic_viewer
