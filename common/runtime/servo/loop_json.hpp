#pragma once

#include <nlohmann/json.hpp>

#include "common/core/health.hpp"

namespace phantom::runtime {

/// Returns the statistics of a loop as JSON for the components' reports and the session's summary: period and
/// rate, lateness of its wake-ups, duration of its body.
inline nlohmann::ordered_json loop_json(const core::LoopStatistics& loop) {
  return {
      {"period_s", loop.period_s},       {"rate_hz", loop.rate_hz},      {"p50_us", loop.wakeup_p50_us},
      {"p99_us", loop.wakeup_p99_us},    {"max_us", loop.wakeup_max_us}, {"work_p50_us", loop.work_p50_us},
      {"work_max_us", loop.work_max_us}, {"ticks", loop.ticks},          {"slips", loop.slips}};
}

}  // namespace phantom::runtime
