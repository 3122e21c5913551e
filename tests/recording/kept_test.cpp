// Recordings that an earlier state of the project made (kept/): what they hold is still understood, and what
// is made of it today is the same, byte for byte.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "common/dds/endpoints/cdr.hpp"
#include "common/messages/codecs/haptic_device_codec.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/recording/mcap_check.hpp"
#include "common/recording/mcap_reader.hpp"

namespace phantom::kept_recording {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <class Message>
Bytes encoded(const dds::TopicSpec<Message>& topic, const Message& message) {
  Bytes bytes;
  EXPECT_TRUE(dds::CdrCodec(topic).encode(&message, bytes)) << topic.name;
  return bytes;
}

template <class Message>
Message decoded(const dds::TopicSpec<Message>& topic, const Bytes& bytes) {
  Message message;
  EXPECT_TRUE(dds::decode(topic, bytes, message)) << topic.name;
  return message;
}

template <class Message>
void expect_same(const dds::TopicSpec<Message>& topic, const Bytes& bytes) {
  EXPECT_EQ(encoded(topic, decoded(topic, bytes)), bytes) << topic.name;
}

/// kept/samples.txt: a line for each topic, its name and a sample as hexadecimal digits.
std::map<std::string, Bytes> kept_samples() {
  std::map<std::string, Bytes> samples;
  std::ifstream file(PHANTOM_SOURCE_DIR "/tests/recording/kept/samples.txt");
  for (std::string name, digits; file >> name >> digits;)
    for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
      samples[name].push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  return samples;
}

TEST(KeptSamples, OfEveryTopicAreSerialisedAsBefore) {
  const auto samples = kept_samples();
  EXPECT_EQ(samples.size(), 20U) << "all topics but those of large samples";
  for (const auto& [name, bytes] : samples) {
#define TOPIC(constant, message) \
  if (name == dds::constant.name) expect_same(dds::constant, bytes);
#include "phantom_contract/topics.def"
#undef TOPIC
  }
}

/// A turn becomes a matrix and a quaternion again, which is not exact.
template <class Message>
constexpr bool kHasTurn =
    std::is_same_v<Message, msg::ViewPose> || std::is_same_v<Message, msg::WorkspaceObject> ||
    std::is_same_v<Message, msg::WorkspaceVersion> || std::is_same_v<Message, msg::HapticDevice> ||
    std::is_same_v<Message, msg::WorkspaceCommand>;

template <class Message>
void expect_same_through_codec(const dds::TopicSpec<Message>& topic, const Bytes& bytes) {
  const Message message = decoded(topic, bytes);
  const auto sample = messages::from_idl(message);
  ASSERT_TRUE(sample) << topic.name << ": " << sample.status().message();
  Message again = messages::to_idl(*sample);
  if constexpr (requires { again.stamp(); }) again.stamp(message.stamp());  // the writer completes it
  if constexpr (!kHasTurn<Message>) {
    EXPECT_EQ(again, message) << topic.name;
  }
}

TEST(KeptRecording, ASessionsSamplesAreAcceptedAndWouldBeSentTheSame) {
  const std::filesystem::path file = PHANTOM_SOURCE_DIR "/tests/recording/kept/session.mcap";
  EXPECT_TRUE(recording::check(file)->ok());
  const auto reader = recording::McapReader::open(file);
  ASSERT_TRUE(reader) << reader.status().message();
  std::map<std::string, int> samples;
  recording::MessageCursor cursor(*reader);
  for (recording::Message message; cursor.next(message);) {
    const std::string& name = reader->channels().at(message.channel_id).topic;
    const Bytes bytes(message.data.begin(), message.data.end());
#define TOPIC(constant, message) \
  if (name == dds::constant.name) expect_same_through_codec(dds::constant, bytes);
#include "phantom_contract/topics.def"
#undef TOPIC
    ++samples[name];
  }
  EXPECT_TRUE(cursor.problems().empty());
  EXPECT_EQ(samples, (std::map<std::string, int>{{"component_status", 125},
                                                 {"drag_field", 12},
                                                 {"master_state", 12},
                                                 {"percept", 1},
                                                 {"slave_state", 12}}));
}

}  // namespace
}  // namespace phantom::kept_recording
