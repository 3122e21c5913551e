#pragma once

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "common/recording/mcap_check.hpp"
#include "common/recording/tests/memory_file.hpp"
#include "components/dds_recorder/dds_recorder.hpp"

namespace phantom::dds_recorder {

using recording::all_messages;
using recording::MemorySink;

/// A disk in memory and a clock that is set by hand.
class FakeWorld {
 public:
  static constexpr core::Nanoseconds kSecond = core::kNsPerSecond;
  static constexpr core::Nanoseconds kUtc = 1'700'000'000 * kSecond;

  /// Files outlive the recorder's hold of them.
  struct SharedSink : recording::ByteSink {
    explicit SharedSink(std::shared_ptr<MemorySink> to, std::uint64_t& free)
        : sink(std::move(to)), free_bytes(free) {}
    core::Status write(recording::ByteView bytes) override {
      if (bytes.size() > free_bytes)
        return {core::ErrorCode::kResourceExhausted, "no space left on the fake disk"};
      free_bytes -= bytes.size();
      return sink->write(bytes);
    }
    core::Status sync() override { return sink->sync(); }
    std::shared_ptr<MemorySink> sink;
    std::uint64_t& free_bytes;
  };

  RecorderPorts ports() {
    RecorderPorts ports;
    ports.create =
        [this](const std::filesystem::path& path) -> core::Expected<std::unique_ptr<recording::ByteSink>> {
      if (files.contains(path.string())) return core::Status(core::ErrorCode::kFailedPrecondition, "exists");
      auto sink = std::make_shared<MemorySink>();
      files[path.string()] = sink;
      return std::unique_ptr<recording::ByteSink>(std::make_unique<SharedSink>(sink, free_bytes));
    };
    ports.free_bytes = [this] { return free_bytes; };
    ports.describe = [](const Guid& writer) {
      return WriterInfo{"writer_" + std::to_string(writer[0]), "host", "1", "cell"};
    };
    // The first byte of a sample names its instance.
    ports.instance_of = [](TopicNumber, std::span<const std::uint8_t> bytes, InstanceKey& instance) {
      instance = {};
      if (bytes.empty()) return false;
      instance[0] = bytes[0];
      return true;
    };
    return ports;
  }

  std::unique_ptr<Recorder> recorder(RecorderSettings settings) {
    settings.folder = "/disk";
    auto made = std::make_unique<Recorder>(settings, RecordingContext{{{"host", "test"}}, {}}, ports(),
                                           ClockPair{0, kUtc});
    state =
        made->add_topic({"state", "T", false, false, "omgidl", "struct T {};", {{"durability", "volatile"}}});
    brick = made->add_topic(
        {"brick", "B", true, true, "omgidl", "struct B {};", {{"durability", "transient local"}}});
    return made;
  }

  SampleView sample(TopicNumber topic, std::uint64_t number, core::Nanoseconds at_ns,
                    std::vector<std::uint8_t> bytes = {1, 2, 3}, std::uint8_t writer = 1) {
    bytes_ = std::move(bytes);
    SampleHead head;
    head.topic = topic;
    head.writer[0] = writer;
    head.sequence_number = number;
    head.source_utc_ns = kUtc + at_ns - 1000;
    head.received_ns = at_ns;
    return {head, bytes_};
  }

  recording::McapReader open(const std::string& path) {
    auto reader = recording::open(files.at(path)->bytes());
    EXPECT_TRUE(reader) << path;
    return std::move(reader).value();
  }
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& [name, sink] : files) names.push_back(name);
    return names;
  }

  std::uint64_t free_bytes = 1'000'000'000'000;
  std::map<std::string, std::shared_ptr<MemorySink>> files;
  TopicNumber state = 0, brick = 0;

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Sequence numbers of a topic's samples in a file; of those carried over, or of the others.
inline std::vector<std::uint32_t> numbers(const recording::McapReader& reader, const std::string& topic,
                                          bool carried_over = false) {
  std::vector<std::uint32_t> found;
  recording::MessageFilter filter;
  filter.channel = [&](const recording::Channel& c) {
    return c.topic == topic && c.metadata.contains(kCarriedOver) == carried_over;
  };
  for (const auto& message : all_messages(reader, filter)) found.push_back(message.sequence);
  return found;
}

}  // namespace phantom::dds_recorder
