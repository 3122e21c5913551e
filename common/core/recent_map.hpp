#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <tuple>
#include <utility>

namespace phantom::core {

/// A map of at most `most` entries, for keys that come from the network: nobody can make it grow. When a new
/// key comes and the map is full, the entry that was used longest ago is dropped and counted. Not
/// thread-safe; not real-time safe.
template <class Key, class Value>
class RecentMap {
 public:
  explicit RecentMap(std::size_t most) : most_(most) {}

  /// Returns the key's value, which becomes the one used last. A new one is made of `arguments`; `added`
  /// tells whether that was so. Valid until the next call.
  template <class... Arguments>
  std::pair<Value&, bool> find_or_add(const Key& key, Arguments&&... arguments) {
    auto place = entries_.find(key);
    const bool added = place == entries_.end();
    if (added) {
      while (entries_.size() >= most_ && !by_age_.empty()) drop_oldest();
      place = entries_
                  .emplace(std::piecewise_construct, std::forward_as_tuple(key),
                           std::forward_as_tuple(std::forward<Arguments>(arguments)...))
                  .first;
    } else {
      by_age_.erase(place->second.age);
    }
    place->second.age = ++age_;
    by_age_.emplace(age_, key);
    return {place->second.value, added};
  }
  bool contains(const Key& key) const { return entries_.contains(key); }
  /// Returns the key's value, whose age stays as it is; null: there is none. Valid until the next call of
  /// find_or_add().
  const Value* find(const Key& key) const {
    const auto place = entries_.find(key);
    return place == entries_.end() ? nullptr : &place->second.value;
  }
  /// Takes an entry out, if it is there; it does not count as dropped.
  void erase(const Key& key) {
    const auto place = entries_.find(key);
    if (place == entries_.end()) return;
    by_age_.erase(place->second.age);
    entries_.erase(place);
  }
  /// Calls `visit(key, value)` for each, by key.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [key, entry] : entries_) visit(key, entry.value);
  }
  bool full() const { return entries_.size() >= most_; }
  /// Returns the value that was used longest ago. The map must not be empty.
  const Value& oldest() const { return entries_.at(by_age_.begin()->second).value; }
  std::size_t size() const { return entries_.size(); }
  /// Returns how many entries were dropped for others.
  std::uint64_t dropped() const { return dropped_; }

 private:
  struct Entry {
    template <class... Arguments>
    explicit Entry(Arguments&&... arguments) : value(std::forward<Arguments>(arguments)...) {}
    Value value;
    std::uint64_t age = 0;
  };
  void drop_oldest() {
    entries_.erase(by_age_.begin()->second);
    by_age_.erase(by_age_.begin());
    ++dropped_;
  }

  std::size_t most_;
  std::map<Key, Entry> entries_;
  std::map<std::uint64_t, Key> by_age_;  // the one used longest ago first
  std::uint64_t age_ = 0, dropped_ = 0;
};

}  // namespace phantom::core
