#include "components/synthetic_viewer/stream/scene_message_log.hpp"

#include <utility>

namespace phantom::synthetic_viewer {

void SceneMessageLog::put(const std::string& kind, SceneMessage message) {
  replace(kind, std::move(message), false);
}

void SceneMessageLog::put_gone(const std::string& kind, SceneMessage message) {
  replace(kind, std::move(message), true);
}

void SceneMessageLog::replace(const std::string& kind, SceneMessage message, bool gone) {
  const auto known = numbers_.find(kind);
  if (known != numbers_.end()) {
    const auto entry = messages_.find(known->second);
    if (entry->second.content->octets == message.octets) return;
    gone_ -= entry->second.gone ? 1 : 0;
    messages_.erase(entry);
  }
  gone_ += gone ? 1 : 0;
  numbers_[kind] = ++number_;
  messages_.emplace(number_, Entry{kind, std::make_shared<const SceneMessage>(std::move(message)), gone});
}

SceneMessageLog::Content SceneMessageLog::next(std::uint64_t& seen) const {
  const auto entry = messages_.upper_bound(seen);
  if (entry == messages_.end()) return nullptr;
  seen = entry->first;
  return entry->second.content;
}

void SceneMessageLog::forget(std::uint64_t seen) {
  if (gone_ == 0) return;
  for (auto entry = messages_.begin(); entry != messages_.end() && entry->first <= seen;) {
    if (!entry->second.gone) {
      ++entry;
      continue;
    }
    numbers_.erase(entry->second.kind);
    entry = messages_.erase(entry);
    --gone_;
  }
}

}  // namespace phantom::synthetic_viewer
