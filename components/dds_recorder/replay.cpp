#include "components/dds_recorder/replay.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/errors.hpp"
#include "common/diagnostics/name_filter.hpp"

namespace phantom::dds_recorder {
namespace {

/// Computes the due times of one turn: log times from `first_log_ns` on, shifted to `start_ns` and divided by
/// `rate`.
class Schedule {
 public:
  Schedule(std::uint64_t first_log_ns, core::Nanoseconds start_ns, double rate)
      : first_log_ns_(first_log_ns), start_ns_(start_ns), rate_(rate) {}
  core::Nanoseconds due(std::uint64_t log_ns) const {
    if (rate_ == 0.0 || log_ns <= first_log_ns_) return start_ns_;
    return start_ns_ + std::llround(static_cast<double>(log_ns - first_log_ns_) / rate_);
  }

 private:
  std::uint64_t first_log_ns_;
  core::Nanoseconds start_ns_;
  double rate_;
};

TopicInfo topic_of(const recording::McapReader& reader, const recording::Channel& channel,
                   const std::map<std::string, std::string>& remap) {
  TopicInfo topic;
  const auto renamed = remap.find(channel.topic);
  topic.name = renamed == remap.end() ? channel.topic : renamed->second;
  const auto schema = reader.schemas().find(channel.schema_id);
  topic.type = schema == reader.schemas().end() ? metadata_of(channel, "type") : schema->second.name;
  topic.keyed = metadata_of(channel, "keyed") == "yes";
  topic.durable = is_durable(channel);
  for (const auto& [key, value] : channel.metadata) {
    if (key.rfind("qos.", 0) == 0) topic.qos.emplace_back(key.substr(4), value);
  }
  return topic;
}

bool is_selected(const recording::Channel& channel, const diagnostics::NameFilter& wanted,
                 const ReplayRequest& request) {
  return wanted.keeps(channel.topic) && channel.message_encoding == "cdr" &&
         (request.commands || !is_command(channel.topic));
}

/// The state of one replay.
class Replay {
 public:
  Replay(const std::vector<OpenedRecording>& recordings, const ReplayRequest& request, ReplaySink& sink,
         ReplayClock& clock)
      : recordings_(recordings), request_(request), sink_(sink), clock_(clock), wanted_(request.topics) {}

  ReplayFigures run() {
    const auto [first_ns, last_ns] = times_of(recordings_);
    const recording::MessageFilter range = in_range(request_.range, first_ns);
    bool more = true;
    while (more && (request_.loops == 0 || figures_.loops < static_cast<std::uint64_t>(request_.loops))) {
      const core::Nanoseconds start_ns = clock_.now_ns();
      const std::uint64_t before = figures_.samples;
      sink_.begin(start_ns);
      more = turn(range, Schedule(std::max(range.from_ns, first_ns), start_ns, request_.rate));
      ++figures_.loops;
      if (figures_.samples == before) break;  // nothing in the range: do not loop for ever
      if (request_.rate > 0 && request_.loops != 1) {
        const std::uint64_t end_ns = std::min(range.until_ns, last_ns);  // a turn is as long as the range
        more = more && clock_.sleep_until(
                           Schedule(std::max(range.from_ns, first_ns), start_ns, request_.rate).due(end_ns));
      }
    }
    return std::move(figures_);
  }

 private:
  bool turn(const recording::MessageFilter& range, const Schedule& schedule) {
    for (const auto& part : parts_of(range)) {
      for (std::size_t i = 0; i < recordings_.size(); ++i) {
        if (!play(i, part, schedule)) return false;
      }
    }
    return true;
  }

  bool play(std::size_t number, const RangePart& part, const Schedule& schedule) {
    const recording::McapReader& reader = recordings_[number].reader;
    recording::MessageFilter filter = part.filter;
    filter.channel = [&](const recording::Channel& channel) {
      return is_selected(channel, wanted_, request_) && (number == 0 || !is_carried_over(channel)) &&
             (!part.durable_only || is_durable(channel));
    };
    recording::MessageCursor cursor(reader, filter);
    for (recording::Message message; cursor.next(message);) {
      const core::Nanoseconds due_ns = schedule.due(message.log_time_ns);
      if (!clock_.sleep_until(due_ns)) return false;
      figures_.worst_lateness_ns = std::max(figures_.worst_lateness_ns, clock_.now_ns() - due_ns);
      const bool sent = sink_.write(reader.channels().at(message.channel_id).topic, message, due_ns);
      ++(sent ? figures_.samples : figures_.failed);
    }
    if (figures_.loops == 0)
      figures_.problems.insert(figures_.problems.end(), cursor.problems().begin(), cursor.problems().end());
    return true;
  }

  const std::vector<OpenedRecording>& recordings_;
  const ReplayRequest& request_;
  ReplaySink& sink_;
  ReplayClock& clock_;
  diagnostics::NameFilter wanted_;
  ReplayFigures figures_;
};

}  // namespace

bool is_command(const std::string& topic) {
  return topic.size() > 8 && topic.compare(topic.size() - 8, 8, "_command") == 0;
}

std::map<std::string, TopicInfo> topics_to_replay(const std::vector<OpenedRecording>& recordings,
                                                  const ReplayRequest& request) {
  const auto remap = parse_remap(request.remap);
  const diagnostics::NameFilter wanted(request.topics);
  std::map<std::string, TopicInfo> topics;
  for (const auto& opened : recordings) {
    for (const auto& [id, channel] : opened.reader.channels()) {
      if (is_selected(channel, wanted, request))
        topics.emplace(channel.topic, topic_of(opened.reader, channel, remap));
    }
  }
  return topics;
}

std::map<std::string, std::string> parse_remap(const std::vector<std::string>& remap) {
  std::map<std::string, std::string> names;
  for (const std::string& rule : remap) {
    const auto at = rule.find(":=");
    if (at == std::string::npos || at == 0 || at + 2 == rule.size())
      throw core::ConfigError("--remap '" + rule +
                              "' is not a rule; allowed: OLD:=NEW, e.g. slave_state:=recorded_slave_state");
    if (!names.emplace(rule.substr(0, at), rule.substr(at + 2)).second)
      throw core::ConfigError("--remap '" + rule + "': " + rule.substr(0, at) + " has a new name already");
  }
  return names;
}

void validate(const ReplayRequest& request) {
  parse_remap(request.remap);
  if (request.range.until_s >= 0 && request.range.until_s <= request.range.from_s)
    throw core::ConfigError("--until " + std::to_string(request.range.until_s) +
                            " is not after --from; allowed: more than " +
                            std::to_string(request.range.from_s) + " s");
}

ReplayFigures replay(const std::vector<OpenedRecording>& recordings, const ReplayRequest& request,
                     ReplaySink& sink, ReplayClock& clock) {
  return Replay(recordings, request, sink, clock).run();
}

}  // namespace phantom::dds_recorder
