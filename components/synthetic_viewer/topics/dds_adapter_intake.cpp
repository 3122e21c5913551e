#include "components/synthetic_viewer/topics/dds_adapter_intake.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "components/synthetic_viewer/state/state.hpp"

namespace phantom::synthetic_viewer {
namespace {

// Samples are kept for so long that older pictures cannot be drawn over; so much may clocks differ that are
// kept in step.
constexpr double kOldestPicture_s = 5.0, kClocksDiffer_s = 0.1;

/// Returns whether only one such component may run; viewers, recorders and audio components may be several.
bool may_run_once(const std::string& component) {
  return component == "master_io" || component == "slave_io" || component == "phantom_sensing" ||
         component == "wva_server";
}

/// Returns what a receiver makes of a message. Reports a second process.
template <class Message>
auto newest(messages::TopicReceiver<Message>& receiver, const dds::TopicSpec<Message>& topic,
            const Message& message, core::Nanoseconds at_ns, StopStatus& board) {
  auto sample = receiver.take(message, at_ns);
  if (receiver.source().has_second(at_ns)) board.take_second(topic.name, at_ns);
  return sample;
}

/// Takes down whether a side is stopped.
void show_side(teleop::Side side, const auto& sample, StopStatus& board) {
  board.take_state(side, sample.state, sample.stop.cause, sample.stop.id, sample.received_ns);
}

}  // namespace

// ViewerState forgets the same ones, and counts them.
const std::size_t SampleFilter::kMaxComponentNames = ViewerState::kMaxComponents;

SkinSample skin_of(const messages::SkinPercept& percept, core::Nanoseconds received_ns) {
  SkinSample sample;
  sample.received_ns = received_ns;
  sample.valid = percept.valid && percept.greatest_mu_Pa_s_per_m > 0;
  sample.patch_m = percept.patch_m;
  if (!sample.valid) return sample;
  for (const messages::SkinPatch& patch : percept.felt) {
    const double share = static_cast<double>(patch.mu_Pa_s_per_m) / percept.greatest_mu_Pa_s_per_m;
    sample.felt.push_back({patch.link, patch.middle_m, static_cast<float>(std::min(1.0, share))});
  }
  return sample;
}

std::optional<ArmSample> SampleFilter::take(const msg::SlaveState& message, core::Nanoseconds at_ns,
                                            StopStatus& board) {
  const auto state = newest(arm_, dds::kSlaveState, message, at_ns, board);
  if (!state) return {};
  ArmSample sample(*state, at_ns);
  sample.arrived = ++arm_arrived_;
  sample.lost = arm_.source().lost();
  show_side(teleop::Side::kSlave, sample, board);
  return sample;
}

std::optional<MasterSample> SampleFilter::take(const msg::MasterState& message, core::Nanoseconds at_ns,
                                               StopStatus& board) {
  const auto state = newest(master_, dds::kMasterState, message, at_ns, board);
  if (!state) return {};
  show_side(teleop::Side::kMaster, *state, board);
  return *state;
}

std::optional<GripperSample> SampleFilter::take(const msg::GripperState& message, core::Nanoseconds at_ns,
                                                StopStatus& board) {
  const auto state = newest(gripper_, dds::kGripperState, message, at_ns, board);
  return state ? std::optional(*state) : std::nullopt;
}

std::optional<PerceptSample> SampleFilter::take(const msg::Percept& message, core::Nanoseconds at_ns,
                                                StopStatus& board) {
  const auto percept = newest(percept_, dds::kPercept, message, at_ns, board);
  return percept ? std::optional(*percept) : std::nullopt;
}

std::optional<SkinSample> SampleFilter::take(const msg::SkinPercept& message, core::Nanoseconds at_ns,
                                             StopStatus& board) {
  const auto percept = newest(skin_, dds::kSkinPercept, message, at_ns, board);
  return percept ? std::optional(skin_of(*percept, at_ns)) : std::nullopt;
}

std::optional<ComponentSample> SampleFilter::take(const msg::ComponentStatus& message,
                                                  core::Nanoseconds at_ns, StopStatus& board) {
  const auto component = messages::from_idl(message);
  if (!component) return {};
  const std::string key = component->component + "@" + component->host;
  if (!names_.accept(key, message.stamp(), at_ns)) return {};
  if (names_.has_second(key, at_ns) && may_run_once(component->component))
    board.take_second("component_status as " + key, at_ns);
  return ComponentSample(*component, at_ns);
}

std::optional<HitSample> SampleFilter::take(const msg::HitAlert& message, core::Nanoseconds at_ns,
                                            StopStatus& /*board*/) {
  const auto alert = hits_.take(message, at_ns, percept_.source());
  return alert ? std::optional(HitSample(*alert, at_ns)) : std::nullopt;
}

std::optional<DoubtSample> SampleFilter::take(const msg::ModelDoubt& message, core::Nanoseconds at_ns) {
  auto doubt = messages::from_idl(message);
  return doubt ? std::optional(DoubtSample(*std::move(doubt), at_ns)) : std::nullopt;
}

core::Expected<std::optional<SentPicture>> SampleFilter::take(const msg::CameraPicture& message,
                                                              const std::string& camera,
                                                              core::Nanoseconds at_ns,
                                                              core::Nanoseconds utc_ns, StopStatus& board) {
  const auto refused = [](const std::string& why) {
    return core::Status::invalid_argument("a camera_picture: " + why);
  };
  auto picture = messages::from_idl(message);
  if (!picture) return refused(picture.status().message());
  if (picture->camera != camera) return std::optional<SentPicture>();
  const bool accepted = camera_source_.assess(message.stamp(), at_ns) == dds::SourceGuard::Verdict::kAccepted;
  if (camera_source_.has_second(at_ns)) board.take_second("camera_picture of " + camera, at_ns);
  if (!accepted) return refused("not newer than the last, or of a second process");
  SentPicture sent{std::move(picture->jpeg), {}, at_ns};
  if (picture->exposed_utc_ns == 0) return std::optional(std::move(sent));
  const double age_s = core::seconds(utc_ns - picture->exposed_utc_ns);
  if (!(age_s >= -kClocksDiffer_s && age_s <= kOldestPicture_s))
    return refused(fmt::format(
        "exposed {:.1f} s {}; allowed: at most {:.0f} s ago, by this host's clock. Are both hosts' clocks set?",
        std::abs(age_s), age_s > 0 ? "ago" : "ahead", kOldestPicture_s));
  sent.exposed_ns = at_ns - std::max<core::Nanoseconds>(0, utc_ns - picture->exposed_utc_ns);
  return std::optional(std::move(sent));
}

namespace {

std::optional<WorkspaceSample> sample_of(const std::optional<messages::WorkspaceVersion>& version) {
  if (!version) return std::nullopt;
  return WorkspaceSample{version->description.version,
                         version->description.grid.voxel_size_m.half_diagonal_m(), version->carried};
}

}  // namespace

messages::ObjectSources::Taken SampleFilter::take(const msg::WorkspaceObject& message,
                                                  const dds::GuidPrefix& server) {
  const auto object = messages::from_idl(message);
  return object ? servers_.take(server, *object) : messages::ObjectSources::Taken();
}

SampleFilter::Version SampleFilter::take(const msg::WorkspaceVersion& message,
                                         const dds::GuidPrefix& server) {
  auto version = messages::from_idl(message);
  if (!version) return {};
  auto taken = servers_.commit(server, *std::move(version));
  return {std::move(taken.changes), taken.accepted ? sample_of(servers_.version()) : std::nullopt};
}

SampleFilter::Version SampleFilter::gone(const dds::GuidPrefix& server) {
  const auto before = servers_.server();
  auto changes = servers_.gone(server);
  return {std::move(changes), before != servers_.server() ? sample_of(servers_.version()) : std::nullopt};
}

core::Expected<std::optional<Command>> SampleFilter::view_command(const msg::OperatorCommand& message) {
  // Several processes may write commands, so their sequence numbers do not order them.
  const auto command = messages::from_idl(message);
  if (!command) return command.status();
  return is_for_views(command->kind) ? std::optional(*command) : std::nullopt;
}

}  // namespace phantom::synthetic_viewer
