#include "components/phantom_sensing/alert_relay.hpp"

#include <spdlog/spdlog.h>

#include "common/core/thread_config.hpp"

namespace phantom::phantom_sensing {

AlertRelay::AlertRelay(PerceptSink& next, int servo_priority)
    : next_(next), thread_([this, servo_priority] {
        core::apply_thread_config(core::ThreadRole::kAlerts, servo_priority);
        work();
      }) {}

AlertRelay::~AlertRelay() { end(); }

void AlertRelay::put(const Event& event) {
  if (!waiting_.put(event)) left_out_.fetch_add(1, std::memory_order_relaxed);
  wake_.raise();
}

void AlertRelay::on_alert(const percept::Alert& alert, bool cleared) { put(RaisedAlert{alert, cleared}); }

void AlertRelay::on_doubt(const percept::ModelDoubt& doubt, bool holds) { put(RaisedDoubt{doubt, holds}); }

void AlertRelay::end() {
  stop_.store(true, std::memory_order_release);
  wake_.raise();
  if (thread_.joinable()) thread_.join();
}

void AlertRelay::work() {
  constexpr double kLook_s = 1.0;
  std::uint64_t logged = 0;
  Event event;
  for (bool last = false; !last;) {
    progress_.tick();
    last = stop_.load(std::memory_order_acquire);
    while (waiting_.take(event)) {
      if (const auto* alert = std::get_if<RaisedAlert>(&event)) next_.on_alert(alert->alert, alert->cleared);
      if (const auto* doubt = std::get_if<RaisedDoubt>(&event)) next_.on_doubt(doubt->doubt, doubt->holds);
    }
    if (const std::uint64_t now = left_out(); now != logged) {
      spdlog::warn("{} hit alerts found no room on their way to their topic and were left out", now - logged);
      logged = now;
    }
    if (!last) wake_.wait(kLook_s);
  }
  progress_.end();
}

}  // namespace phantom::phantom_sensing
