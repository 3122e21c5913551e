#pragma once

// Makes recorded samples look as if they were made now. Part of the DDS adapter.

#include <map>
#include <memory>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/topics.hpp"

namespace phantom::dds_recorder {

/// Moves the stamps and echoes of samples in time. Each recorded session (a writing process) becomes another
/// one; its clock readings move as a whole, so that differences stay (÷ rate); its numbers stay in the first
/// turn of a loop and go on rising in the next, so that receivers that refuse what is not newer, or comes
/// from a second process, accept them. Echoes move as the stamps that they answer; echoes of stamps that are
/// not in the recording stay. Not thread-safe.
class Restamper {
 public:
  /// `session`: random, of this replay. `rate` > 0.
  Restamper(std::uint64_t session, double rate) : session_(session), rate_(rate) {}

  /// A turn begins: clocks start again, numbers go on.
  void begin(core::Nanoseconds now_ns, core::Nanoseconds utc_now_ns);
  /// Changes the sample's bytes in place; `due_ns` is when it is to be sent. False if the type has no stamp,
  /// or the bytes are no sample: then they are as before.
  bool restamp(const dds::TopicDescription& topic, core::Nanoseconds due_ns,
               std::vector<std::uint8_t>& bytes);

  void move(msg::Stamp& stamp);
  void move(msg::Echo& echo) const;

 private:
  struct Session {
    core::Nanoseconds recorded_ns = 0,
                      now_ns = 0;           // the first clock reading of this turn, and when that is now
    std::uint64_t turn = 0;                 // that these are of
    std::uint64_t least = 0, greatest = 0;  // numbers seen
    std::uint64_t added = 0;                // to them, in this turn
  };
  core::Nanoseconds moved(const Session& session, core::Nanoseconds recorded_ns) const;
  std::uint64_t renamed(std::uint64_t session) const;

  std::uint64_t session_;
  double rate_;
  std::uint64_t turn_ = 0;
  core::Nanoseconds utc_minus_monotonic_ns_ = 0, due_ns_ = 0;
  std::map<std::uint64_t, Session> sessions_;
};

}  // namespace phantom::dds_recorder
