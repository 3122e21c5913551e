#include "common/runtime/servo_session.hpp"

#include <spdlog/spdlog.h>

namespace phantom::runtime {

using teleop::LinkState;

void LinkAnnouncer::look(const teleop::SideOutputs& now) {
  if (now.state != before_.state && now.state == LinkState::kStopped) {
    spdlog::warn("link {} → stopped: {}", name_of(before_.state), name_of(now.stop.cause));
  } else if (now.state != before_.state) {
    spdlog::info("link {} → {}", name_of(before_.state), name_of(now.state));
  }
  if (now.partner_unconfirmed && !before_.partner_unconfirmed) {
    spdlog::error("{} HAS NOT CONFIRMED THAT IT IS STOPPED within {} s", partner_, teleop::kConfirmWithin_s);
  }
  before_ = now;
}

void ActuatorAnnouncer::look(const core::ActuatorHealth& actuator) {
  if (actuator.message == said_) return;
  said_ = actuator.message;
  if (actuator.fault) {
    spdlog::error("drives: {}", said_);
  } else {
    spdlog::info("drives: {}", said_.empty() ? "all follow" : said_);
  }
}

core::Health with_actuator(core::Health health, const core::ActuatorHealth& actuator, LinkState link) {
  health.figures.insert(health.figures.end(), actuator.figures.begin(), actuator.figures.end());
  if (!actuator.fault && (actuator.follows || link == LinkState::kStopped)) return health;
  health.state = actuator.fault ? core::ComponentState::kFault : core::ComponentState::kStarting;
  health.message = actuator.message;
  return health;
}

void log_notice(const std::string& refused) {
  if (!refused.empty()) spdlog::warn("servo thread: {}", refused);
}

}  // namespace phantom::runtime
