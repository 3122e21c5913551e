#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace phantom::core {

/// Life of a component as the operator is told it (topic component_status).
enum class ComponentState { kStarting, kReady, kRunning, kDegraded, kStopped, kFault };

/// What a loop or serving thread did since it started.
struct LoopStatistics {
  std::string name;
  double period_s = 0.0;       ///< nominal
  double rate_hz = 0.0;        ///< of the last second
  double wakeup_p50_us = 0.0;  ///< lateness of the wake-up against its due time
  double wakeup_p99_us = 0.0;
  double wakeup_max_us = 0.0;
  double work_p50_us = 0.0;  ///< time spent in the loop's body
  double work_max_us = 0.0;
  std::uint64_t ticks = 0;
  std::uint64_t slips = 0;  ///< periods that passed without a tick
  double idle_s = 0.0;      ///< since its last tick
  double limit_s = 0.0;     ///< it hangs if it is idle for longer; 0: it may be idle for any time
};

/// A figure worth showing beside the state, e.g. {"sensors", 8123, ""} or {"model_age_ms", 12, "ms"}.
struct HealthFigure {
  std::string name;
  double value = 0.0;
  std::string unit;
};

/// What moves an arm (drives, or a simulation of them) as it tells of itself.
struct ActuatorHealth {
  bool fault = false;   ///< until a reset
  bool follows = true;  ///< does what it is told
  std::string message;  ///< what keeps it from that, in words for the operator; empty if nothing does
  std::vector<HealthFigure> figures;
};

struct Health {
  ComponentState state = ComponentState::kStarting;
  std::string message;  ///< one sentence for the operator; empty when there is nothing to say
  std::vector<LoopStatistics> loops;
  std::vector<HealthFigure> figures;
  std::string page;  ///< address of the page that it serves to people, "http://127.0.0.1:8080/"; empty: none
};

/// Whether a loop has been idle for longer than it may.
bool hangs(const LoopStatistics& loop) noexcept;
bool any_hangs(const Health& health) noexcept;
/// `health`, or, where any of its loops hangs, a fault whose message says which and for how long, before what
/// it said already. Whoever publishes health does this.
Health with_hung_loops(Health health);

}  // namespace phantom::core
