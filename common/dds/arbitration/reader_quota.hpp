#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "common/dds/admission/bans.hpp"
#include "common/dds/arbitration/key_quota.hpp"

namespace phantom::dds {

/// The keys that one reader of a keyed topic was sent. Who brings too many (KeyQuota) is named in the log
/// and banned: nothing more is taken from it, which is told as refused datagrams. Thread-safe; allocates for
/// a new key only. Private to common/dds and common/observation.
class ReaderQuota {
 public:
  /// Returns how many keys a reader takes note of that may have `max_instances`: a quarter is left for what
  /// comes until somebody has gone.
  static std::size_t most_keys(std::size_t max_instances) { return max_instances - max_instances / 4; }

  /// `component`, `topic`: names for the log. `most`: keys above which somebody has to go.
  ReaderQuota(std::string component, std::string topic, std::size_t most, std::shared_ptr<Bans> bans);

  /// Takes note of a sample's key.
  void note(const GuidPrefix& writer, const KeyQuota::Key& key);
  /// Forgets the keys of a participant that the reader hears no more.
  void forget(const GuidPrefix& writer);
  /// Returns whether `writer` is banned, by this reader or another of its participant. Cheap while nobody is.
  bool bans(const GuidPrefix& writer) const { return bans_->holds(writer); }

 private:
  const std::string component_, topic_;
  const std::shared_ptr<Bans> bans_;
  std::mutex mutex_;
  KeyQuota census_;
};

}  // namespace phantom::dds
