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

/// Returns the kind's name in --kind and JSON, e.g. "deadline_missed".
const char* name_of(EventKind kind);
std::vector<std::string> event_kind_names();

struct Event {
  core::Nanoseconds utc_ns = 0;
  EventKind kind{};
  std::string topic;        ///< empty: none
  std::string who;          ///< participant, or component and host
  std::string text;         ///< one sentence
  std::uint64_t count = 1;  ///< number of like events since the last one reported
};

/// Returns "22:31:04.123  deadline_missed     slave_state  slave_io (process 12): nothing for 34 ms …"
std::string event_line(const Event& event);
nlohmann::ordered_json event_json(const Event& event);

/// Reports events. Of those that can come at a topic's rate (gaps, deadlines …), it reports the first of each
/// kind, topic and participant at once. Those that follow within the quiet time are counted, and reported
/// together after it with the newest one's text. Keeps the newest `most` reported events, and at most
/// kMaxHeld of those that are held back: for a further one the longest held goes out early. Not thread-safe.
class EventLog {
 public:
  static constexpr std::size_t kMaxHeld = 4096;

  using Report = std::function<void(const Event&)>;
  EventLog(std::size_t most, double quiet_s, Report report);
  void add(Event event);
  /// Reports the events that were held back for the quiet time.
  void look(core::Nanoseconds utc_ns);
  /// Reports all events that were held back.
  void flush();
  const std::deque<Event>& newest() const { return newest_; }
  std::size_t held() const { return held_.size(); }
  /// Returns the number of events of each kind, including those held back.
  const std::map<EventKind, std::uint64_t>& totals() const { return totals_; }

 private:
  using Key = std::tuple<EventKind, std::string, std::string>;
  struct Held {
    core::Nanoseconds reported_ns = 0;
    Event event;
    std::uint64_t count = 0;
  };
  void report(const Event& event);
  void release(Held& held);
  void make_room();

  std::size_t most_;
  core::Nanoseconds quiet_ns_;
  Report report_;
  std::map<Key, Held> held_;
  std::deque<Event> newest_;
  std::map<EventKind, std::uint64_t> totals_;
};

}  // namespace phantom::dds_spy
