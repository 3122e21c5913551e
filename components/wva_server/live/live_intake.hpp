#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/core/clock.hpp"
#include "common/messages/living.hpp"

namespace phantom::wva_server {

/// Samples of occupancy_change put together until somebody takes them: one change, however many came. A
/// change counts only if all before it were heard since the last whole one. Bounded. Not thread-safe.
class LiveIntake {
 public:
  /// Takes a sample. Returns false if it is of no use until a whole one comes.
  bool put(messages::OccupancyChange sample, core::Nanoseconds received_ns);
  /// Waits for a whole one.
  void restart();

  struct Taken {
    bool whole = false;  ///< blocks that are not there are free
    std::vector<messages::OccupancyBlock> blocks;
    /// When the earliest image that these rest on was exposed, by this host's clock; none: no image.
    std::optional<core::Nanoseconds> exposed_ns;
  };
  /// Returns what came since the last call; nothing, if no block may have changed.
  std::optional<Taken> take();

  bool waiting() const { return waiting_; }
  /// When the newest sample came, useful or not; 0: none did.
  core::Nanoseconds received_ns() const { return received_ns_; }
  bool follows() const { return follows_; }
  std::uint64_t missed() const { return missed_; }
  /// The cameras as the newest sample tells of them.
  const std::vector<messages::DepthCameraHealth>& cameras() const { return cameras_; }

 private:
  bool follows_ = false;  // all changes since a whole one were heard
  core::SampleId newest_;
  core::Nanoseconds received_ns_ = 0;
  std::uint64_t missed_ = 0;
  std::vector<messages::DepthCameraHealth> cameras_;
  bool waiting_ = false, whole_ = false;
  std::map<std::array<std::uint16_t, 3>, messages::OccupancyBlock> blocks_;
  std::optional<core::Nanoseconds> exposed_ns_;
};

}  // namespace phantom::wva_server
