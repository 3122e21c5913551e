#include "components/synthetic_viewer/topics/dds_adapter_recorded.hpp"

#include <array>
#include <limits>

#include "common/dds/endpoints/cdr.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/recording/recordings.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr std::size_t kMaxServers = 64;

/// Returns the participant that the text of a writer's GUID names ("01.0f.….3c|00.00.07.03"); other texts
/// stand for themselves.
dds::GuidPrefix prefix_in(const std::string& text) {
  dds::GuidPrefix prefix{};
  bool sound = text.size() > 3 * prefix.size() - 1;
  for (std::size_t i = 0; sound && i < prefix.size(); ++i) {
    const std::string digits = text.substr(3 * i, 2);
    sound = digits.find_first_not_of("0123456789abcdef") == std::string::npos &&
            text[3 * i + 2] == (i + 1 < prefix.size() ? '.' : '|');
    if (sound) prefix[i] = static_cast<std::uint8_t>(std::stoi(digits, nullptr, 16));
  }
  if (!sound)
    for (std::size_t i = 0; i < text.size(); ++i)
      prefix[i % prefix.size()] = static_cast<std::uint8_t>(prefix[i % prefix.size()] * 31 + text[i]);
  return prefix;
}

struct NamedTopic {
  const dds::TopicDescription& spec;
  RecordedTopics::Topic topic;
};

const std::array<NamedTopic, 15>& named_topics() {
  using enum RecordedTopics::Topic;
  static const std::array<NamedTopic, 15> topics{{{dds::kSlaveState, kSlaveState},
                                                  {dds::kMasterState, kMasterState},
                                                  {dds::kGripperState, kGripperState},
                                                  {dds::kPercept, kPercept},
                                                  {dds::kSkinPercept, kSkinPercept},
                                                  {dds::kHitAlert, kHitAlert},
                                                  {dds::kModelDoubt, kModelDoubt},
                                                  {dds::kObjectUncertainty, kObjectUncertainty},
                                                  {dds::kPoseFinding, kPoseFinding},
                                                  {dds::kLiveObject, kLiveObject},
                                                  {dds::kComponentStatus, kComponentStatus},
                                                  {dds::kWorkspaceObject, kWorkspaceObject},
                                                  {dds::kWorkspaceVersion, kWorkspaceVersion},
                                                  {dds::kMeshChunk, kMeshChunk},
                                                  {dds::kOperatorCommand, kOperatorCommand}}};
  return topics;
}

std::size_t bytes_of(const ComponentSample& component) {
  constexpr std::size_t kText = 64;  // a text with what a list needs for it
  std::size_t bytes = sizeof component + component.message.size();
  bytes += component.loops.size() * (sizeof(core::LoopStatistics) + kText);
  bytes += component.topics.size() * (sizeof(core::EndpointStatistics) + kText);
  return bytes + component.figures.size() * (sizeof(core::HealthFigure) + kText);
}

}  // namespace

RecordedMoment::RecordedMoment(messages::ArmBounds arm, const std::vector<OtherArmSource>& other_arms)
    : intake(std::move(arm)) {
  for (const OtherArmSource& other : other_arms) {
    others.push_back({SampleFilter(other.bounds), {}});
    state.others.push_back({other.name, {}});
  }
}

std::size_t RecordedMoment::bytes() const {
  constexpr std::size_t kObject = 2 * (sizeof(ObjectSample) + 128);  // in the state and in the intake
  std::size_t bytes = sizeof *this + state.hits.size() * (sizeof(HitRecord) + 128) +
                      state.objects.size() * kObject +
                      state.uncertainties.size() * sizeof(UncertaintySample) +
                      state.findings.all().size() * (sizeof(FindingSample) + 256) +
                      state.live.size() * (sizeof(LiveObjectSample) + 128) +
                      state.skin.felt.size() * sizeof(SkinPatchSample) +
                      state.workspace.carried.size() * (sizeof(messages::CarriedObject) + 64) +
                      servers.size() * 64 + state.doubts.size() * (sizeof(DoubtSample) + 128) +
                      others.size() * (sizeof(Other) + sizeof(OtherArmSample));
  for (const auto& [name, component] : state.components) bytes += 2 * name.size() + 256 + bytes_of(component);
  return bytes;
}

struct RecordedTopics::Impl {
  dds::TopicDecoder<msg::SlaveState> arm{dds::kSlaveState};
  dds::TopicDecoder<msg::MasterState> master{dds::kMasterState};
  dds::TopicDecoder<msg::GripperState> gripper{dds::kGripperState};
  dds::TopicDecoder<msg::Percept> percept{dds::kPercept};
  dds::TopicDecoder<msg::SkinPercept> skin{dds::kSkinPercept};
  dds::TopicDecoder<msg::HitAlert> hit{dds::kHitAlert};
  dds::TopicDecoder<msg::ModelDoubt> doubt{dds::kModelDoubt};
  dds::TopicDecoder<msg::ComponentStatus> component{dds::kComponentStatus};
  dds::TopicDecoder<msg::ObjectUncertainty> uncertainty{dds::kObjectUncertainty};
  dds::TopicDecoder<msg::PoseFinding> finding{dds::kPoseFinding};
  dds::TopicDecoder<msg::LiveObject> live_object{dds::kLiveObject};
  dds::TopicDecoder<msg::WorkspaceObject> object{dds::kWorkspaceObject};
  dds::TopicDecoder<msg::WorkspaceVersion> version{dds::kWorkspaceVersion};
  dds::TopicDecoder<msg::MeshChunk> mesh{dds::kMeshChunk};
  dds::TopicDecoder<msg::OperatorCommand> command{dds::kOperatorCommand};

  /// Takes a state into its place.
  template <class T, class Sample>
  static bool state(dds::TopicDecoder<T>& decoder, recording::ByteView bytes, core::Nanoseconds at_ns,
                    RecordedMoment& moment, Sample& place, const std::function<void(const Sample&)>& hear) {
    const T* message = decoder.decode(bytes);
    if (message == nullptr) return false;
    auto sample = moment.intake.take(*message, at_ns, moment.stops);
    if (!sample) return false;
    place = std::move(*sample);
    if (hear) hear(place);
    return true;
  }

  static void put(std::vector<ObjectSample> changes, core::Nanoseconds at_ns, RecordedMoment& moment) {
    for (ObjectSample& object : changes) moment.state.take(std::move(object), at_ns);
  }
  /// Returns whether the version in force is another one now.
  static bool put(SampleFilter::Version taken, core::Nanoseconds at_ns, RecordedMoment& moment) {
    put(std::move(taken.changes), at_ns, moment);
    if (taken.workspace) moment.state.workspace = *std::move(taken.workspace);
    return taken.workspace.has_value();
  }

  bool take_hit(recording::ByteView bytes, core::Nanoseconds at_ns, RecordedMoment& moment,
                const RecordedListener& listener) {
    const msg::HitAlert* message = hit.decode(bytes);
    if (message == nullptr) return false;
    auto sample = moment.intake.take(*message, at_ns, moment.stops);
    if (!sample) return false;
    sample->arm = moment.state.arm;
    sample->percept = moment.state.percept;
    moment.state.take(*sample);
    if (listener.hit) listener.hit(*sample);
    return true;
  }

  bool take_doubt(recording::ByteView bytes, core::Nanoseconds at_ns, RecordedMoment& moment) {
    const msg::ModelDoubt* message = doubt.decode(bytes);
    if (message == nullptr) return false;
    auto sample = SampleFilter::take(*message, at_ns);
    if (sample) moment.state.take(*std::move(sample));
    return sample.has_value();
  }

  bool take_uncertainty(recording::ByteView bytes, RecordedMoment& moment) {
    const msg::ObjectUncertainty* message = uncertainty.decode(bytes);
    if (message == nullptr) return false;
    const auto sample = messages::from_idl(*message);
    if (sample) moment.state.uncertainties[sample->id] = *sample;
    return sample.has_value();
  }

  /// Takes what the state itself puts into its place.
  template <class Decoder>
  static bool take_into_state(Decoder& decoder, recording::ByteView bytes, RecordedMoment& moment) {
    const auto* message = decoder.decode(bytes);
    if (message == nullptr) return false;
    auto sample = messages::from_idl(*message);
    if (sample) moment.state.take(*std::move(sample));
    return sample.has_value();
  }

  bool take_component(const Source& source, recording::ByteView bytes, core::Nanoseconds at_ns,
                      RecordedMoment& moment) {
    const msg::ComponentStatus* message = component.decode(bytes);
    if (message == nullptr) return false;
    if (const auto server = moment.servers.find(source.writer); server != moment.servers.end())
      server->second = at_ns;
    for (auto server = moment.servers.begin(); server != moment.servers.end();) {
      const bool gone = server->second != 0 && at_ns - server->second > kGone_ns;
      if (gone) put(moment.intake.gone(server->first), at_ns, moment);
      server = gone ? moment.servers.erase(server) : std::next(server);
    }
    auto sample = moment.intake.take(*message, at_ns, moment.stops);
    if (sample) moment.state.take(std::move(*sample));
    return sample.has_value();
  }

  static void remember(const Source& source, RecordedMoment& moment) {
    if (moment.servers.size() < kMaxServers) moment.servers.try_emplace(source.writer, 0);
  }

  bool take_object(const Source& source, recording::ByteView bytes, core::Nanoseconds at_ns,
                   RecordedMoment& moment) {
    const msg::WorkspaceObject* message = object.decode(bytes);
    if (message == nullptr) return false;
    auto taken = moment.intake.take(*message, source.writer);
    if (taken.accepted) remember(source, moment);
    put(std::move(taken.changes), at_ns, moment);
    return taken.accepted;
  }

  bool take_version(const Source& source, recording::ByteView bytes, core::Nanoseconds at_ns,
                    RecordedMoment& moment) {
    const msg::WorkspaceVersion* message = version.decode(bytes);
    if (message == nullptr) return false;
    remember(source, moment);
    return put(moment.intake.take(*message, source.writer), at_ns, moment);
  }

  bool take_mesh(recording::ByteView bytes, const RecordedListener& listener) {
    if (!listener.mesh) return true;
    const msg::MeshChunk* message = mesh.decode(bytes);
    if (message == nullptr) return false;
    auto chunk = messages::from_idl(*message);
    if (chunk) listener.mesh(std::move(*chunk));
    return chunk.has_value();
  }

  bool take_other(std::size_t other, recording::ByteView bytes, core::Nanoseconds at_ns,
                  RecordedMoment& moment) {
    const msg::SlaveState* message = arm.decode(bytes);
    if (message == nullptr) return false;
    RecordedMoment::Other& from = moment.others[other];
    auto sample = from.intake.take(*message, at_ns, from.stops);
    if (sample) moment.state.others[other].arm = std::move(*sample);
    return sample.has_value();
  }

  bool take_command(recording::ByteView bytes, RecordedMoment& moment) {
    const msg::OperatorCommand* message = command.decode(bytes);
    if (message == nullptr) return false;
    const auto for_views = SampleFilter::view_command(*message);
    if (for_views && for_views->has_value()) moment.state.take(**for_views);
    return for_views.has_value();
  }
};

RecordedTopics::RecordedTopics(std::vector<OtherArmSource> others)
    : others_(std::move(others)), impl_(std::make_unique<Impl>()) {}
RecordedTopics::~RecordedTopics() = default;
RecordedTopics::RecordedTopics(RecordedTopics&&) noexcept = default;

RecordedTopics::Source RecordedTopics::source_of(const recording::Channel& channel) const {
  if (channel.message_encoding != "cdr") return {};
  const auto partition = channel.metadata.find(recording::kPartition);
  for (std::size_t i = 0; i < others_.size() && partition != channel.metadata.end(); ++i) {
    if (partition->second != others_[i].partition) continue;
    if (channel.topic != dds::kSlaveState.name) return {};
    return {Topic::kOtherSlaveState, prefix_in(recording::metadata_of(channel, "writer")), i};
  }
  for (const NamedTopic& named : named_topics()) {
    if (channel.topic == named.spec.name)
      return {named.topic, prefix_in(recording::metadata_of(channel, "writer"))};
  }
  return {};
}

bool RecordedTopics::take(const Source& source, const recording::Message& message, RecordedMoment& moment,
                          const RecordedListener& listener) {
  constexpr auto kLatest_ns = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max() / 2);
  if (message.log_time_ns == 0 || message.log_time_ns > kLatest_ns) return false;
  const auto at_ns = static_cast<core::Nanoseconds>(message.log_time_ns);
  const recording::ByteView bytes = message.data;
  ViewerState& state = moment.state;
  switch (source.topic) {
    case Topic::kSlaveState:
      if (!Impl::state(impl_->arm, bytes, at_ns, moment, state.arm, listener.arm)) return false;
      state.link_quality.take(state.arm, at_ns);
      return true;
    case Topic::kMasterState:
      return Impl::state(impl_->master, bytes, at_ns, moment, state.master, listener.master);
    case Topic::kGripperState:
      return Impl::state(impl_->gripper, bytes, at_ns, moment, state.gripper, {});
    case Topic::kPercept:
      return Impl::state(impl_->percept, bytes, at_ns, moment, state.percept, listener.percept);
    case Topic::kSkinPercept:
      return Impl::state(impl_->skin, bytes, at_ns, moment, state.skin, {});
    case Topic::kHitAlert:
      return impl_->take_hit(bytes, at_ns, moment, listener);
    case Topic::kModelDoubt:
      return impl_->take_doubt(bytes, at_ns, moment);
    case Topic::kObjectUncertainty:
      return impl_->take_uncertainty(bytes, moment);
    case Topic::kPoseFinding:
      return Impl::take_into_state(impl_->finding, bytes, moment);
    case Topic::kLiveObject:
      return Impl::take_into_state(impl_->live_object, bytes, moment);
    case Topic::kComponentStatus:
      return impl_->take_component(source, bytes, at_ns, moment);
    case Topic::kWorkspaceObject:
      return impl_->take_object(source, bytes, at_ns, moment);
    case Topic::kWorkspaceVersion:
      return impl_->take_version(source, bytes, at_ns, moment);
    case Topic::kMeshChunk:
      return impl_->take_mesh(bytes, listener);
    case Topic::kOperatorCommand:
      return impl_->take_command(bytes, moment);
    case Topic::kOtherSlaveState:
      return impl_->take_other(source.other, bytes, at_ns, moment);
    case Topic::kNone:
      break;
  }
  return false;
}

}  // namespace phantom::synthetic_viewer
