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

/// A sample as the adapter delivers it.
struct ReceivedSample {
  std::string topic;
  diagnostics::Guid writer{};
  SampleFacts facts;
  bool gone = false;     ///< its instance was disposed of, or has no writer any longer
  std::string instance;  ///< "id=3"; empty: no key, or an unknown type
  std::string problem;   ///< why it could not be decoded; empty: decoded, or an unknown type
  std::optional<nlohmann::ordered_json> content;  ///< none: unknown type, or see `problem`
  std::string octets;                             ///< of a sample without content, in hexadecimal
};

/// A writer and the statistics of its samples.
struct ObservedWriter {
  std::string topic;
  Stream stream;
  /// Greatest number of instances that are told apart; what comes of further ones, here or in all
  /// (SystemView::kMaxInstances), is counted as kOthers, and their deadlines are not watched.
  static constexpr std::size_t kMaxInstances = 4096;
  static constexpr const char* kOthers = "(others)";

  std::map<std::string, std::uint64_t> instances;  ///< number of samples by instance; empty name: no key
  std::map<std::string, DeadlineWatch> deadlines;  ///< by instance, if the writer offers a deadline
  std::uint64_t deadlines_missed = 0, undecodable = 0, liveliness_lost = 0;
  bool alive = true;
};

/// Holds everything that was discovered and received: participants and endpoints, the samples of each writer,
/// and events. Pure: the adapter passes it everything, with times. What is kept of others is bounded: the
/// guard bounds who is there (common/wire/guard.hpp), kMaxWriters are measured, and of the instances of all
/// of them together kMaxInstances are distinguished. Not thread-safe.
class SystemView {
 public:
  static constexpr std::size_t kMaxWriters = 8192, kMaxInstances = 65536;

  SystemView(std::size_t most_events, double quiet_s, EventLog::Report report)
      : events_(most_events, quiet_s, std::move(report)) {}

  void on_participant(const diagnostics::ParticipantInfo& participant, diagnostics::Presence presence,
                      core::Nanoseconds utc_ns);
  void on_endpoint(const diagnostics::EndpointInfo& endpoint, diagnostics::Presence presence,
                   core::Nanoseconds utc_ns);
  void on_sample(const ReceivedSample& sample);
  void on_liveliness(const diagnostics::Guid& writer, bool alive, core::Nanoseconds utc_ns);
  /// Notes the nodes of ROS 2 that a participant names.
  void on_nodes(const diagnostics::Guid& participant, std::vector<diagnostics::NodeInfo> nodes) {
    graph_.put_nodes(participant, std::move(nodes));
  }
  /// Notes that the topic's reader is new: its writers' next numbers are not compared with the last ones.
  void on_reader_made(const std::string& topic);
  /// Checks for missed deadlines, and whether ends disagree if there are other ends now, and reports events
  /// held back. To be called several times a second.
  void look(core::Nanoseconds now_ns, core::Nanoseconds utc_ns);
  /// Resets the counts, but not what was discovered.
  void reset_counts();

  const diagnostics::Graph& graph() const { return graph_; }
  const std::map<diagnostics::Guid, ObservedWriter>& writers() const { return writers_; }
  /// Returns how many samples came of writers that are not measured, because there are too many.
  std::uint64_t samples_left_out() const { return left_out_; }
  const EventLog& events() const { return events_; }
  EventLog& events() { return events_; }

 private:
  using Pair = std::pair<diagnostics::Guid, diagnostics::Guid>;
  void report(EventKind kind, core::Nanoseconds utc_ns, const std::string& topic, const std::string& who,
              std::string text);
  ObservedWriter* writer(const diagnostics::Guid& guid, const std::string& topic);
  template <class Predicate>
  void forget_writers(Predicate which);
  void watch_deadline(ObservedWriter& writer, const ReceivedSample& sample);
  void report_arrival(const ReceivedSample& sample, const Arrival& arrival);
  void report_disagreements(core::Nanoseconds utc_ns);

  diagnostics::Graph graph_;
  std::map<diagnostics::Guid, ObservedWriter> writers_;
  std::size_t told_apart_ = 0;  // instances of all writers
  std::uint64_t left_out_ = 0;
  bool ends_changed_ = false;         // since disagreements were last looked for
  std::map<Pair, bool> disagreeing_;  // already reported
  StatusWatch status_;
  EventLog events_;
};

}  // namespace phantom::dds_spy
