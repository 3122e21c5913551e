#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/messages/workspace.hpp"
#include "components/wva_server/carriers.hpp"
#include "components/wva_server/grasp_watch.hpp"
#include "components/wva_server/live/live_matter.hpp"

namespace phantom::wva_server {

/// What is known of the source of live matter.
struct LiveInput {
  bool waiting = false;               ///< something has come that take_occupancy() returns
  core::Nanoseconds received_ns = 0;  ///< when the newest sample came; 0: none did
  std::vector<messages::DepthCameraHealth> cameras = {};
  bool has_rival = false;  ///< a second source sends, and is refused
};

/// The component's topics. It publishes workspace_brick, workspace_version, workspace_object, mesh_chunk,
/// workspace_reply and component_status. It reads workspace_command, occupancy_change, slave_state,
/// gripper_state, and workspace_version to notice another server. Published samples stay with the writers, so
/// that late joiners get all of them. One thread.
class DdsAdapter {
 public:
  /// `refusal`: why every command is refused; empty: none is for that. Throws dds::DdsError.
  DdsAdapter(const core::NetworkOptions& network, const std::string& refusal);
  ~DdsAdapter();

  /// Begins to receive the states of the arm that objects may be attached to. Call it at most once. Throws
  /// dds::DdsError.
  void follow(const robot::SerialArm& arm);
  /// Likewise of its gripper.
  void follow_gripper();
  /// Begins to receive what depth cameras see: occupancy_change of the process `source`, of this cell and
  /// grid; others' are refused. Call it at most once. Throws dds::DdsError.
  void follow_occupancy(const std::string& source, const std::string& cell, const workspace::GridSpec& grid);
  LiveInput occupancy() const;
  /// Returns what came since the last call (LiveIntake).
  std::optional<LiveIntake::Taken> take_occupancy();
  /// Waits for a whole occupancy.
  void restart_occupancy();
  /// Reads the newest valid state. Returns false if none came since the last call. One thread.
  bool newest_arm(ArmSample& sample);
  bool newest_gripper(GripperSample& sample);
  /// Publishes an object that is new or has moved, and its mesh unless that is already published.
  void publish_object(const ServedObject& object, std::size_t chunk_bytes);
  /// Publishes that an object is gone. Its mesh stays published, for objects added later with the same mesh.
  void withdraw_object(std::uint16_t id);
  /// Publishes what became of a thing that depth cameras see.
  void publish_live(const messages::LiveObject& object);
  /// Publishes a change of the workspace: changed bricks, removed bricks, then the version that commits them
  /// and what arms carry. Compresses bricks on `threads` threads. `go_on`, if not empty, is called after some
  /// bricks, again and again: publishing a whole workspace takes seconds. Once it returns false, publishing
  /// ends without a version, and so does this, with false.
  bool publish_change(const LiveCell& cell, const layers::WorkspaceChange& change, int threads,
                      const std::function<bool()>& go_on = {});
  /// Returns whether another process publishes a workspace in this domain, too. Consumers keep to the first
  /// server. Thread-safe.
  bool has_rival() const;
  /// Publishes component_status; its state is degraded while there is another server.
  void report(const core::Health& health);

  /// Returns the next command; waits for one for at most `wait_s`. Its requester has been sent "accepted" and
  /// expects reply().
  std::optional<messages::WorkspaceCommand> next_command(double wait_s);
  /// Tells the requester of a command that is being carried out how far it is.
  void notify(const messages::WorkspaceCommand& command, const std::string& message);
  /// Sends the final reply to a command; sets what names the command.
  void reply(const messages::WorkspaceCommand& command, messages::WorkspaceReply reply);
  /// Returns whether a command with that outcome is logged: at a rate, refusals by themselves. Call it from
  /// one thread.
  bool is_logged(messages::WorkspaceOutcome outcome);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::wva_server
