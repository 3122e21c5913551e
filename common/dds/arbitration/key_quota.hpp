#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>

#include "common/dds/admission/guid_prefix.hpp"

namespace phantom::dds {

/// Counts the keys that a reader of a keyed topic knows, by the participant that sent each first, and says
/// who has to go before there are too many. Fast DDS 2.9.1 keeps a record of every key whose writer lives; a
/// reader that has as many as it may walks through all of them for each new one, and refuses it, whoever
/// sends it. Not thread-safe; allocates for a new key only.
class KeyQuota {
 public:
  using Key = std::array<std::uint8_t, 16>;

  /// `most`: keys above which somebody has to go.
  explicit KeyQuota(std::size_t most) : most_(most) {}

  /// Takes note of a key. Returns the participant that has to go, if there are too many now: of those that
  /// brought an eighth of all keys the one that came last, so that nobody displaces who was there before; if
  /// nobody brought so many, the one that brought most. Its keys are forgotten.
  std::optional<GuidPrefix> note(const GuidPrefix& writer, const Key& key);
  /// Forgets the keys of a participant that has gone.
  void forget(const GuidPrefix& writer);
  std::size_t size() const { return keys_.size(); }

 private:
  struct Hash {
    std::size_t operator()(const Key& key) const noexcept;
  };
  struct KeyOwner {
    std::size_t keys = 0;
    std::uint64_t order = 0;  // rises with each that comes
  };
  GuidPrefix select_eviction() const;

  std::size_t most_;
  std::unordered_map<Key, GuidPrefix, Hash> keys_;
  std::map<GuidPrefix, KeyOwner> bringers_;
  std::uint64_t next_order_ = 0;
};

}  // namespace phantom::dds
