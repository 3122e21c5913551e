#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace phantom::core {

/// State of a component as the operator sees it (topic component_status).
enum class ComponentState { kStarting, kReady, kRunning, kDegraded, kStopped, kFault };
/// Returns "starting", "ready", "running", "degraded", "stopped" or "fault".
const char* name_of(ComponentState state) noexcept;

/// Statistics of a loop or serving thread since it started.
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
  double limit_s = 0.0;     ///< the loop hangs if idle_s exceeds this; 0: no limit
};

/// A number shown beside the state, e.g. {"sensors", 8123, ""} or {"model_age_ms", 12, "ms"}.
struct HealthFigure {
  std::string name;
  double value = 0.0;
  std::string unit;
};

/// Statistics of one endpoint of this process on a topic since it was created (topic component_status).
struct EndpointStatistics {
  std::string topic;
  bool writer = false;
  std::uint32_t matched = 0;
  std::uint64_t samples = 0;
  std::uint64_t refused = 0;  ///< samples that the component's validation refused
  std::uint64_t deadline_missed = 0;
  std::uint64_t liveliness_lost = 0;
  std::uint64_t incompatible_qos = 0;
  double busy_s = 0.0;  ///< time that the component's callback has spent on its current sample
};

/// State of an arm's actuators (drives, or a simulation of them), as they report it themselves.
struct ActuatorHealth {
  bool fault = false;   ///< stays true until a reset
  bool follows = true;  ///< whether the actuators follow their commands
  std::string message;  ///< why they do not, or what they warn of, for the operator; empty: nothing to say
  std::vector<HealthFigure> figures;
};

struct Health {
  ComponentState state = ComponentState::kStarting;
  std::string message;  ///< one sentence for the operator; empty when there is nothing to say
  std::vector<LoopStatistics> loops;
  std::vector<HealthFigure> figures;
  std::string page;  ///< web page that the component serves, "http://127.0.0.1:8080/"; empty: none
};

/// Returns whether a loop has been idle for longer than its limit.
bool hangs(const LoopStatistics& loop) noexcept;
bool any_hangs(const Health& health) noexcept;
/// Returns `health`, or a fault if any of its loops hangs: the message then begins with which loop hangs and
/// for how long. Every publisher of health calls this.
Health with_hung_loops(Health health);

}  // namespace phantom::core
