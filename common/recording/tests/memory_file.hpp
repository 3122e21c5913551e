#pragma once

#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "common/recording/mcap_reader.hpp"
#include "common/recording/mcap_writer.hpp"

namespace phantom::recording {

/// A file in memory that has room for so many bytes.
class MemorySink : public ByteSink {
 public:
  explicit MemorySink(std::size_t room = std::numeric_limits<std::size_t>::max()) : room_(room) {}
  core::Status write(ByteView bytes) override {
    if (bytes_.size() + bytes.size() > room_) return {core::ErrorCode::kResourceExhausted, "no space left"};
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    ends_.push_back(bytes_.size());
    return {};
  }
  core::Status sync() override {
    ++syncs_;
    return {};
  }
  const Bytes& bytes() const { return bytes_; }
  /// Where each write ended.
  const std::vector<std::size_t>& ends() const { return ends_; }
  std::size_t syncs() const { return syncs_; }

 private:
  std::size_t room_;
  Bytes bytes_;
  std::vector<std::size_t> ends_;
  std::size_t syncs_ = 0;
};

inline core::Expected<McapReader> open(ByteView bytes, ReaderLimits limits = {}) {
  return McapReader::open(std::make_unique<MemorySource>(bytes), limits);
}

/// A message that owns its data.
struct Sample {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  Bytes data;
  bool operator==(const Sample&) const = default;
  Message message() const { return {channel, sequence, log_time_ns, publish_time_ns, data}; }
};

inline Sample sample_of(const Message& m) {
  return {m.channel_id, m.sequence, m.log_time_ns, m.publish_time_ns, Bytes(m.data.begin(), m.data.end())};
}

inline std::vector<Sample> all_messages(const McapReader& reader, MessageFilter filter = {}) {
  std::vector<Sample> samples;
  MessageCursor cursor(reader, std::move(filter));
  for (Message message; cursor.next(message);) samples.push_back(sample_of(message));
  return samples;
}

/// A file with everything in it: some schemas and channels, messages whose times are a little out of order,
/// metadata and an attachment.
struct Example {
  std::vector<Sample> samples;  ///< in the order of writing
  Bytes bytes;
  std::vector<std::size_t> ends;
};

inline Example example(std::size_t count, WriterOptions options, unsigned seed = 1, bool finish = true) {
  std::mt19937 random(seed);
  const auto draw = [&](std::size_t from, std::size_t to) {
    return std::uniform_int_distribution<std::size_t>(from, to)(random);
  };
  Example made;
  MemorySink sink;
  McapWriter writer(sink, options);
  std::vector<std::uint16_t> channels;
  for (int i = 0; i < 3; ++i) {
    const std::string name = std::string("S").append(std::to_string(i));
    const std::string text = std::string("struct ").append(name).append(" { double x; };");
    const auto schema = writer.add_schema({0, name, "omgidl", Bytes(text.begin(), text.end())});
    channels.push_back(*writer.add_channel(
        {0, *schema, std::string("topic_").append(name), "cdr", {{"writer", "w"}, {"qos", ""}}}));
  }
  channels.push_back(*writer.add_channel({0, 0, "foreign", "cdr", {}}));
  (void)writer.write(Attachment{5, 6, "cell.yaml", "application/yaml", Bytes{'a', ':', '1'}});
  for (std::size_t i = 0; i < count; ++i) {
    Sample sample;
    sample.channel = channels[draw(0, channels.size() - 1)];
    sample.sequence = static_cast<std::uint32_t>(i);
    sample.log_time_ns = 1'700'000'000'000'000'000ULL + 1'000'000 * i + draw(0, 3'000'000);
    sample.publish_time_ns = sample.log_time_ns - draw(0, 1000);
    sample.data.resize(draw(0, 200));
    for (auto& byte : sample.data) byte = static_cast<std::uint8_t>(draw(0, 7));
    (void)writer.write(sample.message());
    if (i % 50 == 49) (void)writer.write(Metadata{"losses", {{"total", std::to_string(i)}}});
    made.samples.push_back(std::move(sample));
  }
  if (finish) (void)writer.finish();
  made.bytes = sink.bytes();
  made.ends = sink.ends();
  return made;
}

}  // namespace phantom::recording
