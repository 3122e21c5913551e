#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "common/core/clock.hpp"

namespace phantom::dds_spy {

enum class EventKind {
  kParticipantJoined,
  kParticipantLeft,
  kParticipantLost,
  kWriterJoined,
  kWriterLeft,
  kReaderJoined,
  kReaderLeft,
  kQosMismatch,
  kGap,
  kSkip,
  kRestart,
  kDeadlineMissed,
  kDeadlineMet,
  kLivelinessLost,
  kLivelinessBack,
  kUndecodable,
  kInstanceGone,
  kComponentState,
  kComponentCounter,
};

/// "deadline_missed", as --kind takes it and JSON has it.
const char* name_of(EventKind kind);
std::vector<std::string> event_kind_names();

struct Event {
  core::Nanoseconds utc_ns = 0;
  EventKind kind{};
  std::string topic;        ///< empty: none
  std::string who;          ///< participant
  std::string text;         ///< one sentence
  std::uint64_t count = 1;  ///< as many alike since the last that was told
};

/// "22:31:04.123  deadline_missed     slave_state  slave_io (process 12): nothing for 34 ms …"
std::string event_line(const Event& event);
nlohmann::ordered_json event_json(const Event& event);

/// Tells events. Of those that come at a topic's rate (gaps, deadlines …), the first of its kind, topic and
/// participant at once; those that follow within a quiet time are counted and told together when it is over,
/// with the newest one's text. Keeps the newest `most`. Not thread-safe.
class EventLog {
 public:
  using Report = std::function<void(const Event&)>;
  EventLog(std::size_t most, double quiet_s, Report report);
  void add(Event event);
  /// Tells what was held back for long enough.
  void look(core::Nanoseconds utc_ns);
  /// Tells all that was held back.
  void flush();
  const std::deque<Event>& newest() const { return newest_; }
  /// Events of each kind, counted ones included.
  const std::map<EventKind, std::uint64_t>& totals() const { return totals_; }

 private:
  using Key = std::tuple<EventKind, std::string, std::string>;
  struct Held {
    core::Nanoseconds told_ns = 0;
    Event event;
    std::uint64_t count = 0;
  };
  void report(const Event& event);
  void release(Held& held);

  std::size_t most_;
  core::Nanoseconds quiet_ns_;
  Report report_;
  std::map<Key, Held> held_;
  std::deque<Event> newest_;
  std::map<EventKind, std::uint64_t> totals_;
};

}  // namespace phantom::dds_spy
