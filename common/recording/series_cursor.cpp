#include "common/recording/series_cursor.hpp"

#include <algorithm>
#include <optional>

namespace phantom::recording {

/// One recording, with its next message. It is opened only once its turn may have come.
struct SeriesCursor::Source {
  const OpenedRecording& recording;
  std::size_t number;
  MessageFilter filter;
  std::uint64_t start_ns = 0;  // no message is older
  std::optional<MessageCursor> cursor = {};
  Message head = {};
  bool ended = false;

  std::uint64_t time_ns() const { return cursor ? head.log_time_ns : start_ns; }
  void advance() {
    if (!cursor) cursor.emplace(recording.reader, filter);
    ended = !cursor->next(head);
  }
};

SeriesCursor::SeriesCursor(const std::vector<OpenedRecording>& recordings, const MessageFilter& filter) {
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const auto& blocks = recordings[i].reader.blocks();
    const auto overlaps = [&filter](const MessageBlock& block) {
      return block.end_ns >= filter.from_ns && block.start_ns < filter.until_ns;
    };
    const auto first = std::ranges::find_if(blocks, overlaps);
    if (first == blocks.end()) continue;
    MessageFilter own = filter;
    if (i > 0)
      own.channel = [wanted = filter.channel](const Channel& channel) {
        return !is_carried_over(channel) && (!wanted || wanted(channel));
      };
    sources_.push_back(std::make_unique<Source>(
        Source{recordings[i], i, std::move(own), std::max(first->start_ns, filter.from_ns)}));
  }
}

SeriesCursor::~SeriesCursor() = default;
SeriesCursor::SeriesCursor(SeriesCursor&&) noexcept = default;
SeriesCursor& SeriesCursor::operator=(SeriesCursor&&) noexcept = default;

/// Returns the recording that has the next message; null: none has any.
SeriesCursor::Source* SeriesCursor::first() {
  for (;;) {
    Source* best = nullptr;
    for (const auto& source : sources_) {
      if (!source->ended && (best == nullptr || source->time_ns() < best->time_ns())) best = source.get();
    }
    if (best == nullptr || best->cursor) return best;
    best->advance();
  }
}

SeriesCursor::Next SeriesCursor::peek() {
  const Source* source = first();
  return source == nullptr ? Next() : Next{source->number, &source->head};
}

void SeriesCursor::pop() {
  if (Source* source = first()) source->advance();
}

std::vector<std::string> SeriesCursor::problems() const {
  std::vector<std::string> all;
  for (const auto& source : sources_) {
    if (!source->cursor) continue;
    for (const std::string& problem : source->cursor->problems())
      all.push_back(source->recording.path.string() + ": " + problem);
  }
  return all;
}

}  // namespace phantom::recording
