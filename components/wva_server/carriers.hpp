#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/messages/teleoperation.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {

/// A valid slave_state with the time at which it was received.
using ArmSample = messages::Received<messages::SlaveState>;

/// An arm that may carry objects.
struct CarrierArm {
  robot::SerialArm arm;
  std::string tip;  ///< the link that holds objects unless a command names another
};

/// Loads the cell's arms. Throws as runtime::load_kinematics().
std::map<std::string, CarrierArm> load_carriers(const runtime::CellConfig& cell);

/// Completes commands to attach and release by what is known of the arms: which links they have, and where
/// the one is whose slave_state this server receives. Pure: no clock, file or DDS. One thread; not real-time
/// safe.
class Carriers {
 public:
  /// `followed`: name of the arm whose states take() gets; empty: of the only one, if there is no other.
  /// `staleness_s`: a state that is older says nothing any more.
  Carriers(std::map<std::string, CarrierArm> arms, const std::string& followed, double staleness_s);

  /// Returns the arm whose states take() gets; null: none.
  const robot::SerialArm* followed() const;
  const std::string& followed_name() const { return followed_; }
  /// Returns the links' poses in the newest state, unless that is too old.
  std::optional<robot::LinkPoses> link_poses(core::Nanoseconds now_ns) const;
  void take(const ArmSample& newest) { newest_ = newest; }

  /// Returns the command with arm, frame and pose filled in, as LiveCell::apply needs them: the object keeps
  /// the place that it has in W at that moment. Commands of other kinds, and those that LiveCell refuses
  /// anyway, stay as they are. Returns why it cannot be completed: no such arm or link, a base link, no fresh
  /// state of the arm.
  core::Expected<WorkspaceCommand> complete(const WorkspaceCommand& command, const LiveCell& cell,
                                            core::Nanoseconds now_ns) const;

 private:
  core::Expected<WorkspaceCommand> complete_attach(WorkspaceCommand command, const ServedObject& object,
                                                   core::Nanoseconds now_ns) const;
  core::Expected<geometry::Pose> frame_pose(const std::string& arm, const std::string& frame,
                                            const std::string& instead, core::Nanoseconds now_ns) const;

  std::map<std::string, CarrierArm> arms_;
  std::string followed_;
  core::Nanoseconds staleness_ns_;
  ArmSample newest_;
};

}  // namespace phantom::wva_server
