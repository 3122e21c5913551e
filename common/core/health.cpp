#include "common/core/health.hpp"

#include <algorithm>
#include <array>

#include "common/core/text.hpp"

namespace phantom::core {
namespace {

std::string sentence(const LoopStatistics& loop) {
  return formatted("the %s loop has not run for %.1f s", loop.name.c_str(), loop.idle_s);
}

}  // namespace

const char* name_of(ComponentState state) noexcept {
  constexpr std::array kNames{"starting", "ready", "running", "degraded", "stopped", "fault"};
  return kNames[static_cast<std::size_t>(state)];
}

bool hangs(const LoopStatistics& loop) noexcept { return loop.limit_s > 0.0 && loop.idle_s > loop.limit_s; }

bool any_hangs(const Health& health) noexcept {
  return std::any_of(health.loops.begin(), health.loops.end(), hangs);
}

Health with_hung_loops(Health health) {
  std::string hung;
  for (const LoopStatistics& loop : health.loops) {
    if (hangs(loop)) hung += (hung.empty() ? "" : "; ") + sentence(loop);
  }
  if (hung.empty()) return health;
  health.state = ComponentState::kFault;
  health.message = hung + (health.message.empty() ? "" : "; " + health.message);
  return health;
}

}  // namespace phantom::core
