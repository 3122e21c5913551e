// Bytes of a recording: whatever they are, reading ends, and what is read can be written and read again.

#include <cstdint>
#include <cstdlib>
#include <memory>

#include "common/recording/mcap_check.hpp"
#include "common/recording/mcap_writer.hpp"

namespace {

using namespace phantom::recording;

class Memory : public ByteSink {
 public:
  phantom::core::Status write(ByteView more) override {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return {};
  }
  phantom::core::Status sync() override { return {}; }
  Bytes bytes;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteView bytes{data, size};
  const ReaderLimits limits{.record_bytes = 1 << 16, .chunk_bytes = 1 << 16};
  const auto reader = McapReader::open(std::make_unique<MemorySource>(bytes), limits);
  if (!reader) return 0;
  const auto checked = check(std::make_unique<MemorySource>(bytes), limits);
  const bool honest = checked && checked->ok();  // chunks have the times that they claim
  for (const auto& index : reader->attachment_indexes()) (void)reader->read(index);
  for (const auto& index : reader->metadata_indexes()) (void)reader->metadata(index.name);

  Memory memory;
  McapWriter writer(memory, {.chunk_bytes = 100});
  const auto channel = writer.add_channel({0, 0, "t", "cdr", {}});
  std::size_t count = 0;
  std::uint64_t last_ns = 0;
  MessageCursor cursor(*reader);
  for (Message message; cursor.next(message); ++count) {
    if ((honest && message.log_time_ns < last_ns) || !reader->channels().contains(message.channel_id))
      std::abort();
    last_ns = message.log_time_ns;
    message.channel_id = *channel;
    if (!writer.write(message)) std::abort();
  }
  if (!writer.finish()) std::abort();
  const auto report = check(std::make_unique<MemorySource>(memory.bytes));
  if (!report || !report->ok() || report->messages != count) std::abort();
  return 0;
}
