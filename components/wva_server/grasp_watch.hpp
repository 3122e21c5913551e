#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/messages/teleoperation.hpp"
#include "common/robot/skin/finger_points.hpp"
#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {

/// A valid gripper_state with the time at which it was received.
using GripperSample = messages::Received<messages::GripperState>;

/// Returns the object of the workspace that is between the fingers of a gripper `width_share` (0 closed … 1
/// widest) open: the one with the most of its body where the fingers would come if they closed. None: hardly
/// anything is.
std::optional<std::uint16_t> object_between(const std::vector<robot::FingerPoint>& fingers,
                                            double width_share, const robot::LinkPoses& X_WL,
                                            const workspace::Workspace& workspace);

/// Notices that the gripper of an arm closes on an object of the model, and that it lets go, and says what
/// command follows from that. Pure: no clock, file or DDS. One thread; not real-time safe.
class GraspWatch {
 public:
  /// `arm`, `tip`: the arm's name, and its link that holds what the gripper takes. Without `fingers` there is
  /// no gripper, and nothing is ever noticed.
  GraspWatch(std::vector<robot::FingerPoint> fingers, std::string arm, std::string tip)
      : fingers_(std::move(fingers)), arm_(std::move(arm)), tip_(std::move(tip)) {}

  bool has_gripper() const { return !fingers_.empty(); }
  /// Takes the gripper's newest state, with the links where they are then. Returns a command to attach when
  /// it has begun to hold (it reports so, narrower than it opens) and an object is between its fingers; to
  /// release what it took, or what was attached to that link by command, when it holds no more: it opens, or
  /// closes further because that slipped out. What has a `hold` of its own is not held by fingers. A gripper
  /// whose drive does not follow changes nothing: it holds as it did.
  std::optional<WorkspaceCommand> step(const messages::GripperState& gripper, const robot::LinkPoses& X_WL,
                                       const LiveCell& cell);

 private:
  std::optional<std::uint16_t> carried_by_gripper(const LiveCell& cell) const;
  WorkspaceCommand command(WorkspaceOperation operation, std::uint16_t id, const LiveCell& cell) const;

  std::vector<robot::FingerPoint> fingers_;
  std::string arm_, tip_;
  bool held_ = false;
  double held_width_m_ = 0.0;
};

}  // namespace phantom::wva_server
