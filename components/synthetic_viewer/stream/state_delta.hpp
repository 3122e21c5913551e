#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace phantom::synthetic_viewer {

/// The newest page_state(), piece by piece, for followers at paces of their own: each is told what has
/// changed since it was told last, by the newest values alone. A piece is an entry of one of the state's
/// objects, or another value as a whole. Bounded by the state, as what is gone is forgotten. Not thread-safe.
class StateDelta {
 public:
  /// Replaces what differs.
  void put(const nlohmann::json& state);
  /// Returns the message `state` of the scene stream (README.md) with what is newer than number `seen`, and
  /// sets `seen` to the newest number. Empty: nothing is newer.
  std::string since(std::uint64_t& seen) const;
  /// Forgets the entries that are gone, as far as every follower has heard so: each has seen `seen`.
  void forget(std::uint64_t seen);

 private:
  struct Piece {
    std::string text;  ///< JSON; "null" once it is gone
    std::uint64_t number = 0;
    bool gone = false;
  };
  using Entries = std::map<std::string, Piece>;  // "": the value as a whole
  void put(Entries& entries, const std::string& name, std::string text, bool gone = false);

  std::map<std::string, Entries> pieces_;
  std::uint64_t number_ = 0;
};

}  // namespace phantom::synthetic_viewer
