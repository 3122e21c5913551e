#include "common/core/health.hpp"

#include <algorithm>
#include <cstdio>

namespace phantom::core {
namespace {

std::string sentence(const LoopStatistics& loop) {
  char seconds[32];
  std::snprintf(seconds, sizeof seconds, "%.1f", loop.idle_s);
  return "the " + loop.name + " loop has not run for " + seconds + " s";
}

}  // namespace

bool hangs(const LoopStatistics& loop) noexcept { return loop.limit_s > 0.0 && loop.idle_s > loop.limit_s; }

bool any_hangs(const Health& health) noexcept {
  return std::any_of(health.loops.begin(), health.loops.end(), hangs);
}

Health with_hung_loops(Health health) {
  std::string said;
  for (const LoopStatistics& loop : health.loops) {
    if (hangs(loop)) said += (said.empty() ? "" : "; ") + sentence(loop);
  }
  if (said.empty()) return health;
  health.state = ComponentState::kFault;
  health.message = said + (health.message.empty() ? "" : "; " + health.message);
  return health;
}

}  // namespace phantom::core
