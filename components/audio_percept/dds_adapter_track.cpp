#include "common/core/errors.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "common/recording/mcap_reader.hpp"
#include "components/audio_percept/dds_adapter_convert.hpp"
#include "components/audio_percept/track.hpp"

namespace phantom::audio_percept {
namespace {

/// A topic of the recording: decodes its messages, checks them as live ones are checked, and puts them into
/// the inputs.
template <class Message, class Converter, class Sample>
class Channel {
 public:
  Channel(const dds::TopicSpec<Message>& topic, Sample Inputs::*place)
      : topic_(topic), codec_(topic), place_(place) {}

  /// Takes the message if it is of this topic. Returns whether it is.
  bool take(const std::string& topic, const recording::Message& message, core::Nanoseconds at_ns,
            Inputs& inputs) {
    if (topic != topic_.name) return false;
    Message sample;
    if (codec_.decode(message.data, &sample) && converter_.accept(sample, at_ns, inputs.*place_)) ++accepted_;
    return true;
  }
  std::size_t accepted() const { return accepted_; }

 private:
  const dds::TopicSpec<Message>& topic_;
  dds::CdrCodec codec_;
  Sample Inputs::*place_;
  Converter converter_;
  std::size_t accepted_ = 0;
};

}  // namespace

Track read_track_recording(const std::filesystem::path& file) {
  const auto reader = recording::McapReader::open(file);
  if (!reader && reader.status().code() == core::ErrorCode::kNotFound)
    throw core::MissingError(reader.status().message());
  if (!reader) throw core::ConfigError(reader.status().message());
  Channel<msg::Percept, PerceptConverter, PerceptSample> percept(dds::kPercept, &Inputs::percept);
  Channel<msg::MasterState, LinkConverter, LinkSample> master(dds::kMasterState, &Inputs::master);
  Channel<msg::SlaveState, LinkConverter, LinkSample> slave(dds::kSlaveState, &Inputs::slave);
  Channel<msg::HitAlert, AlertConverter, AlertSample> alerts(dds::kHitAlert, &Inputs::alerts);
  Channel<msg::OperatorCommand, CommandConverter, CommandSample> command(dds::kOperatorCommand,
                                                                         &Inputs::command);
  Channel<msg::ViewPose, ViewConverter, ViewSample> view(dds::kViewPose, &Inputs::view);
  Track track;
  Inputs now;
  recording::MessageCursor cursor(*reader);
  for (recording::Message message; cursor.next(message);) {
    const std::string& topic = reader->channels().at(message.channel_id).topic;
    const auto at_ns = static_cast<core::Nanoseconds>(message.log_time_ns);
    if (!percept.take(topic, message, at_ns, now) && !master.take(topic, message, at_ns, now) &&
        !slave.take(topic, message, at_ns, now) && !alerts.take(topic, message, at_ns, now) &&
        !command.take(topic, message, at_ns, now) && !view.take(topic, message, at_ns, now)) {
      continue;
    }
    now.now_ns = at_ns;
    // Samples within one millisecond share an entry of the track: the newest ones count.
    constexpr core::Nanoseconds kStep_ns = 1'000'000;
    if (track.empty() || at_ns / kStep_ns != track.back().now_ns / kStep_ns) {
      track.push_back(now);
    } else {
      track.back() = now;
    }
  }
  if (percept.accepted() == 0) throw core::ConfigError(file.string() + ": holds no sample of topic percept");
  return track;
}

}  // namespace phantom::audio_percept
