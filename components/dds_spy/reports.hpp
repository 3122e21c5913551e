#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/diagnostics/name_filter.hpp"
#include "components/dds_spy/dds_adapter.hpp"
#include "components/dds_spy/system_view.hpp"

namespace phantom::dds_spy {

/// The input of a report. The caller holds the view's lock.
struct ReportInput {
  const SystemView& view;
  const std::map<std::string, TopicContract>& contracts;
  const diagnostics::NameFilter& topics;
  int domain = 0;
  double seconds = 0.0;  ///< since the spy joined or the counts were reset
};

/// Returns whether the type belongs to one of the project's topics.
bool is_project_type(const ReportInput& input, const std::string& type);

// Each report exists as JSON and as text. Pure.

/// Reports hosts, participants with their processes, and topics with type, writers and readers.
nlohmann::ordered_json topology_json(const ReportInput& input);
std::string topology_text(const ReportInput& input);

/// Reports every endpoint's QoS, its departures from the topic's contract, and every pair of endpoints that
/// does not communicate, with reasons and advice.
nlohmann::ordered_json qos_json(const ReportInput& input);
std::string qos_text(const ReportInput& input);

/// Reports rate, period, jitter, gaps and size of each writer's samples.
nlohmann::ordered_json rates_json(const ReportInput& input);
std::string rates_text(const ReportInput& input);

/// Reports the age of each writer's samples on arrival, and the clocks compared.
nlohmann::ordered_json latency_json(const ReportInput& input);
std::string latency_text(const ReportInput& input);

}  // namespace phantom::dds_spy
