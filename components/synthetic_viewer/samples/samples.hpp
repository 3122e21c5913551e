#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"
#include "common/geometry/pose.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/percept.hpp"
#include "common/messages/status.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/messages/workspace.hpp"

namespace phantom::synthetic_viewer {

// Checked samples of the topics. `received_ns` is CLOCK_MONOTONIC of this host; 0 means "nothing received
// yet". Vectors are in W, SI units.

using messages::eigen;
using messages::Vector3;
using percept::HitRule;
using percept::MotionClass;
using teleop::LinkState;
using teleop::StopCause;

struct ArmSample : messages::Received<messages::SlaveState> {
  using messages::Received<messages::SlaveState>::Received;
  /// Numbers of samples that arrived since the viewer joined, and of those that were lost, by their sequence
  /// numbers.
  std::uint64_t arrived = 0, lost = 0;
};
/// Another arm of the cell: what it is called, where its slave_state comes from, and what that must fit.
struct OtherArmSource {
  std::string name, partition;
  messages::ArmBounds bounds;
};
using PerceptSample = messages::Received<messages::Percept>;
using MasterSample = messages::Received<messages::MasterState>;
using GripperSample = messages::Received<messages::GripperState>;

struct HitSample : messages::Received<messages::HitAlert> {
  using messages::Received<messages::HitAlert>::Received;
  // Arm and percept when the alert came, for its pictures, which may be drawn much later.
  ArmSample arm;
  PerceptSample percept;
};

using DoubtSample = messages::Received<messages::ModelDoubt>;
using UncertaintySample = messages::ObjectUncertainty;
using FindingSample = messages::PoseFinding;
using LiveObjectSample = messages::LiveObject;
using ObjectSample = messages::WorkspaceObject;

struct WorkspaceSample {  // workspace_version
  std::uint64_t version = 0;
  double voxel_error_m = 0.0;                         ///< half a voxel's diagonal
  std::vector<messages::CarriedObject> carried = {};  ///< what arms carry
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
  double patch_m = 0.0;  ///< edge length of a patch
  std::vector<SkinPatchSample> felt;
};

using MeshChunkSample = messages::MeshChunk;
using ComponentSample = messages::Received<messages::ComponentStatus>;

/// The pose of the view that the operator looks at.
struct ViewPoseSample : messages::ViewPose {
  core::Nanoseconds made_ns = 0;  ///< time of drawing, CLOCK_MONOTONIC; 0: not yet drawn
};

using teleop::CommandKind;
using Command = messages::OperatorCommand;
/// Returns whether a command is for the views alone, which the viewer itself carries out.
inline bool is_for_views(CommandKind kind) noexcept {
  return kind == CommandKind::kViewHold || kind == CommandKind::kViewNode;
}

/// The operator's request that the arm takes an object, or puts it down.
struct CarryRequest {
  std::string object;  ///< its name
  bool attach = true;  ///< false: release
};

/// The operator's request to correct the model: to shift an object so that its surface is where the arm felt
/// it, to put one where a camera has found it, to undo the newest change of an object's pose, or to decide
/// about a thing that cameras see and the model lacks.
struct CorrectionRequest {
  std::uint32_t doubt = 0;  ///< its running number
  std::string found;        ///< name of the object that is put where a camera has found it; empty: none is
  std::string undo;         ///< name of the object whose newest change is undone; empty: none is
  std::string live;         ///< name of the thing that is decided about; empty: none is
  messages::WorkspaceOperation decision = messages::WorkspaceOperation::kFreeze;  ///< about it
  std::string name;                                                               ///< kName: its new one
};

/// What the page may ask of the workspace.
using WorkspaceRequest = std::variant<CarryRequest, CorrectionRequest>;

/// The outcome of a command, for its issuer.
struct CommandOutcome {
  enum class Kind {
    kDone,       ///< confirmed by all that must carry it out; sent, where no reply is expected
    kRefused,    ///< refused by one of them: `message` says why, and what is allowed
    kUnanswered  ///< not confirmed by all within the time
  };
  Kind kind = Kind::kDone;
  std::string message;
};

}  // namespace phantom::synthetic_viewer
