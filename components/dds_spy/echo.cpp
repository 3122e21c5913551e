#include "components/dds_spy/echo.hpp"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "common/diagnostics/text.hpp"

namespace phantom::dds_spy {
namespace {

std::string in_json(const ReceivedSample& sample, const std::string& who, const std::string& type) {
  nlohmann::ordered_json line{{"topic", sample.topic},
                              {"type", type},
                              {"writer", who},
                              {"number", sample.facts.sequence_number},
                              {"received_utc_ns", sample.facts.received_utc_ns},
                              {"source_utc_ns", sample.facts.source_ns},
                              {"size", sample.facts.octets}};
  if (!sample.instance.empty()) line["instance"] = sample.instance;
  if (!sample.problem.empty()) line["problem"] = sample.problem;
  if (sample.content) {
    line["sample"] = *sample.content;
  } else {
    line["octets"] = sample.octets;
  }
  return diagnostics::to_line(line) + "\n";
}

std::string in_text(const ReceivedSample& sample, const std::string& who, const std::string& type) {
  std::string text = fmt::format("--- {} from {}, number {}, {} octets\n", sample.topic, who,
                                 sample.facts.sequence_number, sample.facts.octets);
  if (!sample.problem.empty()) text += "cannot be decoded: " + sample.problem + "\n";
  if (sample.content) return text + diagnostics::to_text(*sample.content);
  if (sample.problem.empty()) text += "type " + type + " is not the project's\n";
  return text + "octets: " + sample.octets + "\n";
}

}  // namespace

Echo::Echo(bool json, double every_s, std::uint64_t most)
    : json_(json), every_ns_(core::from_seconds(every_s)), most_(most) {}

std::optional<std::string> Echo::take(const ReceivedSample& sample, const diagnostics::Graph& graph) {
  if (complete()) return std::nullopt;
  if (every_ns_ > 0) {
    const auto [last, first] =
        last_ns_.find_or_add({sample.writer, sample.instance}, sample.facts.received_ns);
    if (!first && sample.facts.received_ns - last < every_ns_) return std::nullopt;
    last = sample.facts.received_ns;
  }
  ++shown_;
  const auto* endpoint = graph.endpoint(sample.writer);
  const std::string type = endpoint == nullptr ? "" : endpoint->type, who = graph.who(sample.writer);
  return json_ ? in_json(sample, who, type) : in_text(sample, who, type);
}

}  // namespace phantom::dds_spy
