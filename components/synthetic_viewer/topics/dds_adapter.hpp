#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/workspace/workspace.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"
#include "components/synthetic_viewer/state/inbox.hpp"
#include "components/synthetic_viewer/stream/headset_hand.hpp"
#include "components/synthetic_viewer/stream/page_content.hpp"

namespace phantom::synthetic_viewer {

/// The viewer's DDS readers and writers. It fills the inbox from the topics (checked, in order), sends the
/// page's commands, and publishes the viewer's status and view pose. Of each topic that only one process may
/// send, it follows the first sender for as long as that one is heard, and reports a second. Its callbacks
/// never wait for a picture.
class DdsAdapter {
 public:
  /// Joins the DDS domain. `arm`: the arm that the samples must fit. `camera`: whose pictures are taken from
  /// camera_picture; empty: none are. `others`: arms that are drawn, too. Throws dds::DdsError.
  DdsAdapter(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox,
             const std::string& camera = {}, const std::vector<OtherArmSource>& others = {});
  ~DdsAdapter();

  /// Sends an operator_command repeatedly until all components that must answer have done so, and waits for
  /// that: a third of a second for a stop (which is sent on after that, until it is confirmed), half a second
  /// for other commands. A reset names the stops that the newest states name. Thread-safe.
  CommandOutcome ask(const Command& command);
  /// Asks wva_server that the arm takes or puts down an object, or that an object is moved so that it
  /// explains what the arm felt, or moved back, and waits half a second for its reply. Thread-safe.
  CommandOutcome change(const WorkspaceRequest& request);
  /// Sends a command in the same way without waiting. The inbox's StopStatus shows what becomes of a stop.
  /// Thread-safe.
  void send(const Command& command);
  /// Returns the newest whole workspace; null: none has come yet. Its bricks are read from the first call on,
  /// as long as there are calls: see release_workspace(). Takes as long as building it takes. Thread-safe.
  std::shared_ptr<const workspace::Workspace> workspace();
  /// Reads no bricks any more, and keeps none, if nobody has asked for the workspace for kWorkspaceKept_s.
  /// Does not wait.
  void release_workspace();
  static constexpr double kWorkspaceKept_s = 30.0;
  /// Publishes view_pose. One thread.
  void publish(const ViewPoseSample& view);
  /// Publishes the newest picture of each view that has a new one, as view_picture, at most `rate_Hz` times a
  /// second each, and follows the views while somebody reads the topic. Calls no more often than that
  /// suffice. One thread. `page` must outlive the adapter.
  void publish_pictures(PageContent& page, double rate_Hz);
  /// Serves a headset's controller to master_io as the haptic device, from now on. `hand` must outlive the
  /// adapter.
  void serve(HeadsetHand& hand);
  /// Publishes component_status. One thread.
  void publish(const core::Health& health);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::synthetic_viewer
