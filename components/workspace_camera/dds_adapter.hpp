#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/messages/living.hpp"
#include "common/messages/received.hpp"
#include "common/messages/workspace.hpp"
#include "components/workspace_camera/arm_view.hpp"

namespace phantom::workspace_camera {

/// The component's topics. In: depth_image, slave_state, gripper_state, workspace_version, workspace_object.
/// Out: occupancy_change, pose_finding, component_status. Of each camera, and of each other topic, only the
/// first sender is followed. Of each camera the newest image waits; older ones that nobody took are dropped.
class DdsAdapter {
 public:
  /// `cameras`: names of those whose images come by depth_image. `arm`: null: no arm is heard. `history` must
  /// outlive this. Throws dds::DdsError.
  DdsAdapter(const core::NetworkOptions& network, const std::string& name,
             const std::vector<std::string>& cameras, const robot::SerialArm* arm, ArmHistory& history);
  ~DdsAdapter();

  struct Image : messages::Received<messages::DepthImage> {
    std::size_t camera = 0;  ///< place in `cameras`
  };
  /// Returns an image that waits; the cameras take turns. Waits for one, or for wake(), at most `wait_s`.
  std::optional<Image> next_image(double wait_s);
  /// Ends a wait for an image, or the next one. Any thread.
  void wake();
  /// Returns what arms carry, if that has changed since the last call.
  std::optional<std::vector<messages::CarriedObject>> carried();
  /// Returns the objects that were placed, moved or removed since the last call, in this order.
  std::vector<messages::WorkspaceObject> objects();

  /// Publishes a change. Returns false if the next one must be whole: this could not be sent, or somebody has
  /// joined.
  bool publish(const messages::OccupancyChange& change);
  /// Returns whether somebody has joined who has not got a whole occupancy yet.
  bool has_newcomer() const;
  /// Publishes how long ago each part of the workspace was seen.
  void publish(const messages::SpaceView& view);
  /// Publishes what cameras have found of an object.
  void publish(const messages::PoseFinding& finding);
  /// Publishes component_status; degraded while a second process sends what only one may send.
  void report(const core::Health& health);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::workspace_camera
