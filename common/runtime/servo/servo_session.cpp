#include "common/runtime/servo/servo_session.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

namespace phantom::runtime {

using teleop::LinkState;

void LinkLogger::update(const teleop::SideOutputs& now) {
  if (now.state != before_.state && now.state == LinkState::kStopped) {
    spdlog::warn("link {} → stopped: {}", name_of(before_.state), name_of(now.stop.cause));
  } else if (now.state != before_.state) {
    spdlog::info("link {} → {}", name_of(before_.state), name_of(now.state));
  }
  if (now.partner_unconfirmed && !before_.partner_unconfirmed) {
    spdlog::error("{} HAS NOT CONFIRMED THAT IT IS STOPPED within {:g} s", partner_,
                  teleop::kConfirmWithin_s);
  }
  if (now.enabling != before_.enabling) {
    const bool trouble = component_state(now.enabling) != core::ComponentState::kReady;
    spdlog::log(trouble ? spdlog::level::warn : spdlog::level::info, "enabling switch {}",
                permits(now.enabling) ? "held" : reason_of(now.enabling));
  }
  if (now.loop.starved && !before_.loop.starved) spdlog::warn(held_up_sentence(now.loop));
  if (!now.loop.starved && before_.loop.starved) spdlog::info("the servo loop runs on schedule again");
  before_ = now;
}

void ActuatorLogger::update(const core::ActuatorHealth& actuator) {
  if (actuator.message == logged_) return;
  logged_ = actuator.message;
  if (actuator.fault) {
    spdlog::error("drives: {}", logged_);
  } else {
    spdlog::info("drives: {}", logged_.empty() ? "all follow" : logged_);
  }
}

std::string held_up_sentence(const teleop::LoopPace& pace) {
  return fmt::format(
      "the servo loop was held up {} times within {:g} s, by up to {:.0f} ms: uncoupled, the drives hold or "
      "coast by themselves",
      pace.late_ticks, pace.window_s, 1e3 * pace.longest_gap_s);
}

core::Health with_actuator(core::Health health, const core::ActuatorHealth& actuator,
                           const teleop::SideOutputs& now) {
  health.figures.insert(health.figures.end(), actuator.figures.begin(), actuator.figures.end());
  if (!actuator.fault && now.state == LinkState::kStopped) return health;
  if (!actuator.fault && now.loop.starved) {  // why the drives do not follow
    health.state = core::ComponentState::kDegraded;
    health.message = held_up_sentence(now.loop);
    return health;
  }
  if (!actuator.fault && actuator.follows) {
    health.message += (health.message.empty() || actuator.message.empty() ? "" : "; ") + actuator.message;
    return health;
  }
  health.state = actuator.fault ? core::ComponentState::kFault : core::ComponentState::kStarting;
  health.message = actuator.message;
  return health;
}

core::Health with_stop_trouble(core::Health health, const std::string& trouble) {
  if (trouble.empty()) return health;
  if (health.state != core::ComponentState::kFault) health.state = core::ComponentState::kDegraded;
  health.message = trouble;
  return health;
}

void log_notice(const std::string& refused) {
  if (!refused.empty()) spdlog::warn("servo thread: {}", refused);
}

}  // namespace phantom::runtime
