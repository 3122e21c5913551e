#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/core/status.hpp"
#include "common/dds/endpoint.hpp"
#include "components/synthetic_viewer/inbox.hpp"
#include "components/synthetic_viewer/samples.hpp"

namespace phantom::synthetic_viewer {

/// What the messages must fit to.
struct ArmShape {
  std::size_t joint_count = 0;
  std::size_t link_count = 0;  ///< base included
};

// From a message to the viewer's own type; nothing if a field is not finite, out of its range, or does not
// fit the arm. `received_ns` is left to the caller. Pure.
std::optional<ArmSample> convert(const msg::SlaveState& message, const ArmShape& shape);
std::optional<MasterSample> convert(const msg::MasterState& message, const ArmShape& shape);
std::optional<PerceptSample> convert(const msg::Percept& message, const ArmShape& shape);
std::optional<HitSample> convert(const msg::HitAlert& message, const ArmShape& shape);
std::optional<ObjectSample> convert(const msg::WorkspaceObject& message);
std::optional<WorkspaceSample> convert(const msg::WorkspaceVersion& message);
std::optional<SkinSample> convert(const msg::SkinPercept& message, const ArmShape& shape);
std::optional<MeshChunkSample> convert(const msg::MeshChunk& message);
std::optional<ComponentSample> convert(const msg::ComponentStatus& message);
std::optional<Command> convert(const msg::OperatorCommand& message);

/// The viewer's place in the data space: fills the inbox from the topics (checked, in order), sends what the
/// page commands, and tells how the viewer is. Of each topic that one process sends it keeps to the first,
/// for as long as that one is heard, and tells of a second. Its callbacks never wait for a picture.
class DdsAdapter {
 public:
  /// Joins the domain. Throws dds::DdsError.
  DdsAdapter(const core::NetworkOptions& network, const ArmShape& shape, Inbox& inbox);
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
