#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/diagnostics/graph.hpp"
#include "components/dds_spy/events.hpp"
#include "components/dds_spy/status_watch.hpp"
#include "components/dds_spy/stream.hpp"

namespace phantom::dds_spy {

/// A sample as the adapter hands it on.
struct HeardSample {
  std::string topic;
  diagnostics::Guid writer{};
  SampleFacts facts;
  bool gone = false;     ///< its instance was disposed of, or has no writer any more
  std::string instance;  ///< "id=3"; empty: no key, or a type that is not known
  std::string problem;   ///< why it could not be decoded; empty: it could, or its type is not known
  std::optional<nlohmann::ordered_json> content;  ///< none: type not known, or see problem
  std::string octets;                             ///< of a sample without content, in hexadecimal digits
};

/// A writer and what came from it.
struct HeardWriter {
  std::string topic;
  Stream stream;
  std::map<std::string, std::uint64_t> instances;  ///< samples of each; the empty name for what has no key
  std::map<std::string, DeadlineWatch> deadlines;  ///< of each instance, where the writer offers a deadline
  std::uint64_t deadlines_missed = 0, undecodable = 0, liveliness_lost = 0;
  bool alive = true;
};

/// Everything that was discovered and heard: who is there, how the samples of each writer come, what
/// happened. Pure: told by the adapter, with times. Not thread-safe.
class SystemView {
 public:
  SystemView(std::size_t most_events, double quiet_s, EventLog::Report report)
      : events_(most_events, quiet_s, std::move(report)) {}

  enum class Change { kAppeared, kChanged, kLeft, kLost };
  void on_participant(const diagnostics::ParticipantInfo& participant, Change change,
                      core::Nanoseconds utc_ns);
  void on_endpoint(const diagnostics::EndpointInfo& endpoint, Change change, core::Nanoseconds utc_ns);
  void on_sample(const HeardSample& sample);
  void on_liveliness(const diagnostics::Guid& writer, bool alive, core::Nanoseconds utc_ns);
  /// The topic's reader was made anew: numbers of its writers are not compared with the last ones.
  void on_reader_made(const std::string& topic);
  /// Looks for what did not happen; call it some times a second.
  void look(core::Nanoseconds now_ns, core::Nanoseconds utc_ns);
  /// Forgets what was counted, not who is there.
  void reset_counts();

  const diagnostics::Graph& graph() const { return graph_; }
  const std::map<diagnostics::Guid, HeardWriter>& writers() const { return writers_; }
  const EventLog& events() const { return events_; }
  EventLog& events() { return events_; }

 private:
  using Pair = std::pair<diagnostics::Guid, diagnostics::Guid>;
  void say(EventKind kind, core::Nanoseconds utc_ns, const std::string& topic, const std::string& who,
           std::string text);
  HeardWriter& writer(const HeardSample& sample);
  void watch_deadline(HeardWriter& writer, const HeardSample& sample);
  void report_arrival(const HeardSample& sample, const Arrival& arrival);
  void report_disagreements(core::Nanoseconds utc_ns);

  diagnostics::Graph graph_;
  std::map<diagnostics::Guid, HeardWriter> writers_;
  std::map<Pair, bool> disagreeing_;  // told already
  StatusWatch status_;
  EventLog events_;
};

}  // namespace phantom::dds_spy
