#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "components/dds_spy/reports.hpp"
#include "components/dds_spy/table.hpp"

namespace phantom::dds_spy {
namespace {

using diagnostics::Guid;
using Json = nlohmann::ordered_json;

struct Row {
  const Guid* guid;
  const ObservedWriter* writer;
  StreamFigures figures;
};

std::vector<Row> rows_of(const ReportInput& input) {
  std::vector<Row> rows;
  for (const auto& [guid, writer] : input.view.writers()) {
    if (input.topics.keeps(writer.topic)) rows.push_back({&guid, &writer, writer.stream.figures()});
  }
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
    return std::tie(a.writer->topic, *a.guid) < std::tie(b.writer->topic, *b.guid);
  });
  return rows;
}

/// Returns the topics that have writers but no samples.
std::vector<std::string> silent_topics(const ReportInput& input) {
  std::map<std::string, bool> has_samples;
  for (const auto& [guid, endpoint] : input.view.graph().endpoints()) {
    if (!endpoint.writer || !input.topics.keeps(endpoint.topic)) continue;
    const auto found = input.view.writers().find(guid);
    has_samples[endpoint.topic] |=
        found != input.view.writers().end() && found->second.stream.figures().samples > 0;
  }
  std::vector<std::string> silent;
  for (const auto& [topic, any] : has_samples) {
    if (!any) silent.push_back(topic);
  }
  return silent;
}

std::string silent_line(const ReportInput& input) {
  const auto topics = silent_topics(input);
  return topics.empty() ? "" : fmt::format("nothing came on: {}\n", fmt::join(topics, ", "));
}

std::string type_note(const ReportInput& input, const Row& row) {
  const auto* endpoint = input.view.graph().endpoint(*row.guid);
  if (endpoint == nullptr) return "";
  return is_project_type(input, endpoint->type) ? "" : endpoint->type + " (foreign)";
}

std::string in_ms(double value_s) { return fmt::format("{:.3f}", 1e3 * value_s); }

std::string in_us(double value_s) { return fmt::format("{:.0f}", 1e6 * value_s); }

std::string sizes(const StreamFigures& f) {
  return f.least_octets == f.most_octets ? std::to_string(f.most_octets)
                                         : fmt::format("{}–{}", f.least_octets, f.most_octets);
}

const char* clock_name(LatencyClock clock) {
  constexpr std::array kNames{"none", "monotonic", "utc", "source_timestamp"};
  return kNames[static_cast<std::size_t>(clock)];
}

Json report_of(const ReportInput& input, Json streams) {
  return {{"domain", input.domain},
          {"seconds", input.seconds},
          {"silent", silent_topics(input)},
          {"streams", std::move(streams)}};
}

Json row_head(const ReportInput& input, const Row& row) {
  return {{"topic", row.writer->topic},
          {"writer", input.view.graph().who(*row.guid)},
          {"guid", diagnostics::to_string(*row.guid)},
          {"samples", row.figures.samples}};
}

}  // namespace

Json rates_json(const ReportInput& input) {
  Json list = Json::array();
  for (const Row& row : rows_of(input)) {
    const StreamFigures& f = row.figures;
    Json entry = row_head(input, row);
    entry.update(
        {{"octets", f.octets},
         {"least_octets", f.least_octets},
         {"most_octets", f.most_octets},
         {"rate_hz", f.rate_hz},
         {"octets_per_s",
          f.samples > 0 ? f.rate_hz * static_cast<double>(f.octets) / static_cast<double>(f.samples) : 0.0},
         {"period_s",
          {{"mean", f.period_mean_s},
           {"min", f.period_min_s},
           {"max", f.period_max_s},
           {"p99", f.period_p99_s}}},
         {"jitter_s", f.jitter_s},
         {"gaps", f.gaps},
         {"missing", f.missing},
         {"largest_gap", f.largest_gap},
         {"out_of_order", f.out_of_order},
         {"skipped_by_writer", f.skipped},
         {"restarts", f.restarts},
         {"deadlines_missed", row.writer->deadlines_missed},
         {"liveliness_lost", row.writer->liveliness_lost},
         {"undecodable", row.writer->undecodable},
         {"alive", row.writer->alive}});
    if (row.writer->instances.size() > 1 || !row.writer->instances.contains(""))
      entry["instances"] = row.writer->instances;
    const std::string note = type_note(input, row);
    if (!note.empty()) entry["foreign_type"] = input.view.graph().endpoint(*row.guid)->type;
    list.push_back(std::move(entry));
  }
  return report_of(input, std::move(list));
}

std::string rates_text(const ReportInput& input) {
  Table table({"TOPIC", "WRITER", ">SAMPLES", ">RATE/Hz", ">PERIOD/ms", ">MIN", ">MAX", ">P99", ">JITTER/ms",
               ">GAPS", ">MISSING", ">LATE", ">OCTETS", "NOTE"});
  for (const Row& row : rows_of(input)) {
    const StreamFigures& f = row.figures;
    std::string note = type_note(input, row);
    const auto add = [&](const std::string& text) { note += (note.empty() ? "" : "; ") + text; };
    if (!row.writer->alive) add("not alive");
    if (f.skipped > 0) add(fmt::format("{} numbers left out by the writer", f.skipped));
    if (f.restarts > 0) add(fmt::format("{} restarts", f.restarts));
    if (f.out_of_order > 0) add(fmt::format("{} out of order", f.out_of_order));
    if (row.writer->undecodable > 0) add(fmt::format("{} not decodable", row.writer->undecodable));
    if (row.writer->instances.size() > 1) add(fmt::format("{} instances", row.writer->instances.size()));
    const bool periodic = f.samples > 1;
    const auto ms = [&](double value_s) { return periodic ? in_ms(value_s) : std::string("–"); };
    table.add({row.writer->topic, input.view.graph().who(*row.guid), std::to_string(f.samples),
               periodic ? fmt::format("{:.2f}", f.rate_hz) : "–", ms(f.period_mean_s), ms(f.period_min_s),
               ms(f.period_max_s), ms(f.period_p99_s), ms(f.jitter_s), std::to_string(f.gaps),
               std::to_string(f.missing), std::to_string(row.writer->deadlines_missed), sizes(f), note});
  }
  return (table.empty() ? "" : table.text()) + silent_line(input);
}

Json latency_json(const ReportInput& input) {
  Json list = Json::array();
  for (const Row& row : rows_of(input)) {
    const StreamFigures& f = row.figures;
    Json entry = row_head(input, row);
    entry.update({{"clock", clock_name(f.clock)},
                  {"compared", f.latencies},
                  {"negative", f.negative_latencies},
                  {"latency_s",
                   {{"min", f.latency_min_s},
                    {"mean", f.latency_mean_s},
                    {"p50", f.latency_p50_s},
                    {"p99", f.latency_p99_s},
                    {"max", f.latency_max_s}}}});
    list.push_back(std::move(entry));
  }
  return report_of(input, std::move(list));
}

std::string latency_text(const ReportInput& input) {
  Table table(
      {"TOPIC", "WRITER", ">SAMPLES", ">P50/µs", ">P99/µs", ">MAX/µs", ">MEAN/µs", ">MIN/µs", "CLOCK"});
  bool two_clocks = false, negative = false;
  for (const Row& row : rows_of(input)) {
    const StreamFigures& f = row.figures;
    two_clocks |= f.clock == LatencyClock::kStampUtc;
    negative |= f.negative_latencies > 0;
    const auto us = [&](double value_s) { return f.latencies > 0 ? in_us(value_s) : std::string("–"); };
    table.add({row.writer->topic, input.view.graph().who(*row.guid), std::to_string(f.latencies),
               us(f.latency_p50_s), us(f.latency_p99_s), us(f.latency_max_s), us(f.latency_mean_s),
               us(f.latency_min_s), clock_name(f.clock)});
  }
  if (table.empty()) return silent_line(input);
  std::string text =
      table.text() + silent_line(input) +
      "Age of a sample when it is taken here, from its stamp; this process's own wake-up is part of it.\n"
      "monotonic: one clock, of this host. source_timestamp: UTC of the writer's host, by its DDS.\n";
  if (two_clocks)
    text +=
        "utc: the UTC clocks of two hosts; wrong by as much as these differ (chronyc tracking shows it).\n";
  if (negative) text += "A latency below zero shows that a clock is wrong by at least as much.\n";
  return text;
}

}  // namespace phantom::dds_spy
