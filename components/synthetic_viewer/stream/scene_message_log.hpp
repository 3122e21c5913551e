#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

namespace phantom::synthetic_viewer {

/// A message of the scene stream.
struct SceneMessage {
  bool binary = false;
  std::string octets;
};

/// The newest message of each kind, in the order in which they came. Each follower keeps the number up to
/// which it has them: what a newer message of its kind has replaced meanwhile it never gets. Not thread-safe.
class SceneMessageLog {
 public:
  using Content = std::shared_ptr<const SceneMessage>;

  /// Replaces the message of a kind, unless it is the same.
  void put(const std::string& kind, SceneMessage message);
  /// Like put(), but the kind is forgotten by forget(): its message tells only those who know the kind that
  /// it is gone.
  void put_gone(const std::string& kind, SceneMessage message);
  /// Returns the oldest message that is newer than number `seen`, and sets `seen` to its number. Null: none.
  Content next(std::uint64_t& seen) const;
  /// Forgets the kinds that are gone, as far as every follower has heard so: each has seen `seen`.
  void forget(std::uint64_t seen);
  /// Returns the number of the newest message.
  std::uint64_t newest() const { return number_; }
  std::size_t size() const { return messages_.size(); }

 private:
  struct Entry {
    std::string kind;
    Content content;
    bool gone = false;
  };
  void replace(const std::string& kind, SceneMessage message, bool gone);

  std::map<std::uint64_t, Entry> messages_;       // by number
  std::map<std::string, std::uint64_t> numbers_;  // by kind
  std::size_t gone_ = 0;
  std::uint64_t number_ = 0;
};

}  // namespace phantom::synthetic_viewer
