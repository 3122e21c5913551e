#include <algorithm>
#include <tuple>

#include "common/recording/mcap_reader.hpp"

namespace phantom::recording {

/// A block's records in memory, and its remaining messages in order.
struct MessageCursor::Loaded {
  struct Entry {
    std::uint64_t time_ns;
    std::size_t offset;
  };
  std::size_t block = 0;
  Bytes raw, decompressed;
  ByteView records;
  std::vector<Entry> entries;
  std::size_t next = 0;
  auto head() const { return std::make_tuple(entries[next].time_ns, block, entries[next].offset); }
};

MessageCursor::MessageCursor(const McapReader& reader, MessageFilter filter)
    : reader_(reader), filter_(std::move(filter)) {
  for (const auto& [id, channel] : reader.channels())
    wanted_[id] = !filter_.channel || filter_.channel(channel);
}
MessageCursor::~MessageCursor() = default;
MessageCursor::MessageCursor(MessageCursor&&) noexcept = default;

void MessageCursor::load(std::size_t number) {
  const MessageBlock& block = reader_.blocks()[number];
  if (block.end_ns < filter_.from_ns || block.start_ns >= filter_.until_ns) return;
  auto loaded = std::make_unique<Loaded>();
  auto records = reader_.load(block, loaded->raw, loaded->decompressed);
  if (!records) {
    problems_.push_back(records.status().message());
    return;
  }
  std::uint64_t held_bytes = loaded->raw.size() + loaded->decompressed.size();
  for (const auto& other : loaded_) held_bytes += other->raw.size() + other->decompressed.size();
  if (held_bytes > reader_.limits().overlap_bytes) {
    problems_.push_back("byte " + std::to_string(block.offset) +
                        ": too many chunks overlap in time; its messages are left out");
    return;
  }
  loaded->block = number;
  loaded->records = *records;
  RecordView view;
  for (ByteView left = loaded->records; next_record(left, view); left = left.subspan(view.size())) {
    Message message;
    if (view.opcode != Opcode::kMessage || !parse(view.content, message)) continue;
    const auto channel = wanted_.find(message.channel_id);
    if (channel == wanted_.end() || !channel->second) continue;
    if (message.log_time_ns < filter_.from_ns || message.log_time_ns >= filter_.until_ns) continue;
    loaded->entries.push_back({message.log_time_ns, loaded->records.size() - left.size()});
  }
  if (loaded->entries.empty()) return;
  std::stable_sort(loaded->entries.begin(), loaded->entries.end(),
                   [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; });
  loaded_.push_back(std::move(loaded));
}

bool MessageCursor::next(Message& message) {
  std::erase_if(loaded_, [](const auto& loaded) { return loaded->next == loaded->entries.size(); });
  const auto first = [this] {
    return std::min_element(loaded_.begin(), loaded_.end(),
                            [](const auto& a, const auto& b) { return a->head() < b->head(); });
  };
  // A block that begins no later than the next message may hold an earlier one.
  auto head = first();
  while (next_block_ < reader_.blocks().size() &&
         (head == loaded_.end() || reader_.blocks()[next_block_].start_ns <= std::get<0>((*head)->head()))) {
    load(next_block_++);
    head = first();
  }
  if (head == loaded_.end()) return false;
  Loaded& from = **head;
  RecordView view;
  next_record(from.records.subspan(from.entries[from.next++].offset), view);
  parse(view.content, message);
  return true;
}

}  // namespace phantom::recording
