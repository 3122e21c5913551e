#pragma once

// Restamps recorded samples as if they were made now. Part of the DDS adapter.

#include <memory>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/recent_map.hpp"
#include "common/dds/endpoints/topics.hpp"

namespace phantom::dds_recorder {

/// Moves the stamps and echoes of samples in time, so that receivers that refuse samples that are not newer,
/// or come from a second process, accept them. Each recorded session (a writing process) gets another session
/// number. Its clock readings move together, so that differences stay as recorded (÷ rate). Its sample
/// numbers stay as recorded in the first turn of a loop and continue to rise in the next. Echoes move like
/// the stamps that they answer; echoes of stamps that are not in the recording stay. It remembers the
/// kMaxSessions that were used last: the numbers of one that is forgotten begin again in the next turn. Not
/// thread-safe.
class Restamper {
 public:
  static constexpr std::size_t kMaxSessions = 16384;

  /// `session`: a random number for this replay. `rate` > 0.
  Restamper(std::uint64_t session, double rate) : session_(session), rate_(rate) {}

  std::size_t sessions() const { return sessions_.size(); }
  /// Begins a turn of the loop: clock readings start again, numbers continue.
  void begin(core::Nanoseconds now_ns, core::Nanoseconds utc_now_ns);
  /// Restamps the sample's bytes in place; `due_ns` is when it is to be sent. Returns false, with the bytes
  /// unchanged, if the type has no stamp or the bytes are not a valid sample.
  bool restamp(const dds::TopicDescription& topic, core::Nanoseconds due_ns,
               std::vector<std::uint8_t>& bytes);

  void move(msg::Stamp& stamp);
  void move(msg::Echo& echo) const;

 private:
  struct Session {
    core::Nanoseconds recorded_ns = 0,
                      now_ns = 0;           // first clock reading of this turn: as recorded, and moved
    std::uint64_t turn = 0;                 // turn of these readings
    std::uint64_t least = 0, greatest = 0;  // of the recorded numbers
    std::uint64_t added = 0;                // to the recorded numbers in `turn`
  };
  /// Returns what is added to the recorded numbers in this turn.
  std::uint64_t added(const Session& session) const;
  core::Nanoseconds moved(const Session& session, core::Nanoseconds recorded_ns) const;
  std::uint64_t renamed(std::uint64_t session) const;

  std::uint64_t session_;
  double rate_;
  std::uint64_t turn_ = 0;
  core::Nanoseconds utc_minus_monotonic_ns_ = 0, due_ns_ = 0;
  core::RecentMap<std::uint64_t, Session> sessions_{kMaxSessions};
};

}  // namespace phantom::dds_recorder
