#include <memory>

#include "common/core/errors.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/topic_receiver.hpp"
#include "common/recording/mcap_reader.hpp"
#include "components/audio_percept/topic_inputs.hpp"
#include "components/audio_percept/track.hpp"

namespace phantom::audio_percept {
namespace {

// Samples within one millisecond share an entry of the track: the newest ones count.
constexpr core::Nanoseconds kStep_ns = 1'000'000;

recording::McapReader opened(const std::filesystem::path& file) {
  auto reader = recording::McapReader::open(file);
  if (!reader && reader.status().code() == core::ErrorCode::kNotFound)
    throw core::MissingError(reader.status().message());
  if (!reader) throw core::ConfigError(reader.status().message());
  return std::move(reader).value();
}

/// The inputs of a recording: its samples are checked as live ones are.
class RecordedTrack {
 public:
  explicit RecordedTrack(const std::filesystem::path& file)
      : file_(file.string()), reader_(opened(file)), cursor_(reader_) {}

  bool next(Inputs& inputs) {
    for (recording::Message message; cursor_.next(message);) {
      const auto at_ns = static_cast<core::Nanoseconds>(message.log_time_ns);
      const Inputs before = now_;
      if (!take(reader_.channels().at(message.channel_id).topic, message.data, at_ns)) continue;
      now_.now_ns = at_ns;
      const bool complete = begun_ && at_ns / kStep_ns != before.now_ns / kStep_ns;
      begun_ = true;
      if (!complete) continue;
      inputs = before;
      return true;
    }
    if (!heard_percept_) throw core::ConfigError(file_ + ": holds no sample of topic percept");
    inputs = now_;
    return std::exchange(begun_, false);
  }

 private:
  /// Decodes and checks the messages of a topic.
  template <class Message>
  struct Channel {
    explicit Channel(const dds::TopicSpec<Message>& spec,
                     core::Nanoseconds hold_ns = dds::SourceGuard::kHold_ns)
        : decoder(spec), receiver(messages::ArmBounds(), {.hold_ns = hold_ns}) {}
    dds::TopicDecoder<Message> decoder;
    messages::TopicReceiver<Message> receiver;

    /// Hands a message of this topic to `use` if it is accepted. Returns whether it is of this topic.
    template <class... Periodic>
    bool take(const std::string& topic, recording::ByteView bytes, core::Nanoseconds at_ns, const auto& use,
              const Periodic&... periodic) {
      if (topic != decoder.topic().name) return false;
      if (const Message* message = decoder.decode(bytes))
        if (const auto sample = receiver.take(*message, at_ns, periodic...)) use(*sample);
      return true;
    }
  };

  /// Takes a message into now_. Returns whether it is of a topic of this component.
  bool take(const std::string& topic, recording::ByteView bytes, core::Nanoseconds at_ns) {
    const auto into = [](auto& place) { return [&place](const auto& sample) { place = sample; }; };
    const auto felt = [this](const auto& sample) { now_.percept = sample, heard_percept_ = true; };
    const auto alert = [this](const auto& sample) { now_.alerts = alert_count_.take(sample); };
    const auto view = [this](const auto& sample) { now_.view = view_of(sample); };
    return percept_.take(topic, bytes, at_ns, felt) || master_.take(topic, bytes, at_ns, into(now_.master)) ||
           slave_.take(topic, bytes, at_ns, into(now_.slave)) ||
           alerts_.take(topic, bytes, at_ns, alert, percept_.receiver.source()) ||
           view_.take(topic, bytes, at_ns, view) || take_command(topic, bytes, at_ns);
  }
  bool take_command(const std::string& topic, recording::ByteView bytes, core::Nanoseconds at_ns) {
    if (topic != command_.topic().name) return false;
    if (const msg::OperatorCommand* message = command_.decode(bytes))
      if (const auto command = messages::from_idl(*message))
        audio_percept::take(*command, at_ns, now_.command);
    return true;
  }

  std::string file_;
  recording::McapReader reader_;
  recording::MessageCursor cursor_;
  Channel<msg::Percept> percept_{dds::kPercept};
  Channel<msg::MasterState> master_{dds::kMasterState};
  Channel<msg::SlaveState> slave_{dds::kSlaveState};
  Channel<msg::HitAlert> alerts_{dds::kHitAlert};
  Channel<msg::ViewPose> view_{dds::kViewPose, kViewHold_ns};
  dds::TopicDecoder<msg::OperatorCommand> command_{dds::kOperatorCommand};
  AlertCount alert_count_;
  Inputs now_;
  bool begun_ = false, heard_percept_ = false;
};

}  // namespace

Track read_track_recording(const std::filesystem::path& file) {
  return [track = std::make_shared<RecordedTrack>(file)](Inputs& inputs) { return track->next(inputs); };
}

}  // namespace phantom::audio_percept
