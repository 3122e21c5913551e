#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/core/status.hpp"
#include "common/dds/endpoint.hpp"
#include "common/messages/arm_bounds.hpp"
#include "components/synthetic_viewer/inbox.hpp"
#include "components/synthetic_viewer/samples.hpp"

namespace phantom::synthetic_viewer {

// From a message to the viewer's own type; nothing if a field is not finite or out of its range.
// `received_ns` is left to the caller. Pure.
std::optional<WorkspaceSample> convert(const msg::WorkspaceVersion& message);
std::optional<MeshChunkSample> convert(const msg::MeshChunk& message);
std::optional<ComponentSample> convert(const msg::ComponentStatus& message);
std::optional<Command> convert(const msg::OperatorCommand& message);
/// The skin as it is painted.
SkinSample skin_of(const messages::SkinPercept& percept, core::Nanoseconds received_ns);

/// The viewer's place in the data space: fills the inbox from the topics (checked, in order), sends what the
/// page commands, and tells how the viewer is. Of each topic that one process sends it keeps to the first,
/// for as long as that one is heard, and tells of a second. Its callbacks never wait for a picture.
class DdsAdapter {
 public:
  /// Joins the domain. `arm`: that samples must be about. Throws dds::DdsError.
  DdsAdapter(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox);
  ~DdsAdapter();

  /// Sends an operator_command, again and again until those who must answer it have, and waits for that: a
  /// third of a second for a stop (which is sent on after it, until it is confirmed), half a second for
  /// others. A reset names the stops that the newest states name. Thread-safe.
  CommandOutcome ask(const Command& command);
  /// The same without waiting: what becomes of a stop shows on the inbox's StopBoard. Thread-safe.
  void send(const Command& command);
  /// Publishes view_pose. One thread.
  void publish(const ViewPoseSample& view);
  /// Publishes component_status. One thread.
  void publish(const core::Health& health);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::synthetic_viewer
