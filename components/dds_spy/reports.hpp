#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/diagnostics/name_filter.hpp"
#include "components/dds_spy/dds_adapter.hpp"
#include "components/dds_spy/system_view.hpp"

namespace phantom::dds_spy {

/// What a report is made of; the view is read while its lock is held.
struct ReportInput {
  const SystemView& view;
  const std::map<std::string, TopicContract>& contracts;
  const diagnostics::NameFilter& topics;
  int domain = 0;
  double seconds = 0.0;  ///< since the spy joined, or since counts were reset
};

/// Whether the type is that of one of the project's topics.
bool is_project_type(const ReportInput& input, const std::string& type);

// Each report as JSON, and as text for people. Pure.

/// Hosts, participants with their processes, topics with type, writers and readers.
nlohmann::ordered_json topology_json(const ReportInput& input);
std::string topology_text(const ReportInput& input);

/// Every endpoint's QoS, where it departs from the topic's contract, and every pair that does not communicate
/// with reasons and advice.
nlohmann::ordered_json qos_json(const ReportInput& input);
std::string qos_text(const ReportInput& input);

/// Rate, period, jitter, gaps, size of each writer's samples.
nlohmann::ordered_json rates_json(const ReportInput& input);
std::string rates_text(const ReportInput& input);

/// Age of each writer's samples on arrival, and by which clocks.
nlohmann::ordered_json latency_json(const ReportInput& input);
std::string latency_text(const ReportInput& input);

}  // namespace phantom::dds_spy
