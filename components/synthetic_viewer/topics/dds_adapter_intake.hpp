#pragma once

#include <optional>
#include <vector>

#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/object_sources.hpp"
#include "common/messages/topic_receiver.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"
#include "components/synthetic_viewer/state/stop_status.hpp"
#include "components/synthetic_viewer/topics/dds_adapter_names.hpp"
#include "components/synthetic_viewer/video/video_source.hpp"

namespace phantom::synthetic_viewer {

/// Decides which samples of the topics the viewer heeds, live and of a recording alike: those that their
/// codecs accept, that are newer than the last, and that come from the process that it follows. Times are of
/// one clock; it reads none itself.
///
/// A plain value: a copy goes on by itself. Samples of one topic come on one thread, those of
/// workspace_object and workspace_version on one thread, too; different topics may come on different ones. To
/// be copied while none comes.
class SampleFilter {
 public:
  explicit SampleFilter(messages::ArmBounds arm)
      : SampleFilter(std::make_shared<const messages::ArmBounds>(std::move(arm))) {}

  /// Each returns the sample, or nothing if it is refused, and tells `board` which side is stopped and which
  /// topics a second process sends. A HitSample comes without arm and percept.
  std::optional<ArmSample> take(const msg::SlaveState& message, core::Nanoseconds at_ns, StopStatus& board);
  std::optional<MasterSample> take(const msg::MasterState& message, core::Nanoseconds at_ns,
                                   StopStatus& board);
  std::optional<GripperSample> take(const msg::GripperState& message, core::Nanoseconds at_ns,
                                    StopStatus& board);
  std::optional<PerceptSample> take(const msg::Percept& message, core::Nanoseconds at_ns, StopStatus& board);
  std::optional<SkinSample> take(const msg::SkinPercept& message, core::Nanoseconds at_ns, StopStatus& board);
  std::optional<ComponentSample> take(const msg::ComponentStatus& message, core::Nanoseconds at_ns,
                                      StopStatus& board);
  std::optional<HitSample> take(const msg::HitAlert& message, core::Nanoseconds at_ns, StopStatus& board);

  /// The newest of each place comes to who joins late, in any order.
  static std::optional<DoubtSample> take(const msg::ModelDoubt& message, core::Nanoseconds at_ns);

  /// Returns the picture of the camera called `camera`, with the time of its exposure by this host's clocks;
  /// `utc_ns`: the same moment as `at_ns`, since 1970. Returns nothing if it is of another camera; an error
  /// that says why it is refused.
  core::Expected<std::optional<SentPicture>> take(const msg::CameraPicture& message,
                                                  const std::string& camera, core::Nanoseconds at_ns,
                                                  core::Nanoseconds utc_ns, StopStatus& board);

  /// Takes an object that a server announces.
  messages::ObjectSources::Taken take(const msg::WorkspaceObject& message, const dds::GuidPrefix& server);
  struct Version {
    std::vector<ObjectSample> changes;         ///< of the objects in force
    std::optional<WorkspaceSample> workspace;  ///< in force, if that is another one now
  };
  /// Takes a version that a server commits.
  Version take(const msg::WorkspaceVersion& message, const dds::GuidPrefix& server);
  /// Takes leave of a server.
  Version gone(const dds::GuidPrefix& server);

  /// Returns the command if it is one for the views; any other command is accepted, but nothing to heed.
  static core::Expected<std::optional<Command>> view_command(const msg::OperatorCommand& message);

 private:
  // skin_percept comes at 20 Hz, pictures of a camera as often or less
  static constexpr core::Nanoseconds kSkinHold_ns = core::kNsPerSecond;
  explicit SampleFilter(const std::shared_ptr<const messages::ArmBounds>& arm)
      : arm_(arm),
        master_(arm),
        gripper_(arm),
        percept_(arm),
        skin_(arm, {.hold_ns = kSkinHold_ns}),
        hits_(arm) {}

  messages::TopicReceiver<msg::SlaveState> arm_;
  messages::TopicReceiver<msg::MasterState> master_;
  messages::TopicReceiver<msg::GripperState> gripper_;
  messages::TopicReceiver<msg::Percept> percept_;
  messages::TopicReceiver<msg::SkinPercept> skin_;
  messages::TopicReceiver<msg::HitAlert> hits_;  // of the process that percept is taken from
  dds::SourceGuard camera_source_{kSkinHold_ns};
  std::uint64_t arm_arrived_ = 0;
  ComponentNames names_{kMaxComponentNames};
  messages::ObjectSources servers_;

  static const std::size_t kMaxComponentNames;
};

/// Returns the skin's percept in the form used for painting.
SkinSample skin_of(const messages::SkinPercept& percept, core::Nanoseconds received_ns);

}  // namespace phantom::synthetic_viewer
