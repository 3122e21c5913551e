#include "components/phantom_sensing/alert_relay.hpp"

#include <spdlog/spdlog.h>

namespace phantom::phantom_sensing {

AlertRelay::AlertRelay(PerceptSink& next) : next_(next), thread_([this] { work(); }) {}

AlertRelay::~AlertRelay() { end(); }

void AlertRelay::on_alert(const percept::Alert& alert, bool cleared) {
  if (!waiting_.put({alert, cleared})) left_out_.fetch_add(1, std::memory_order_relaxed);
  wake_.raise();
}

void AlertRelay::end() {
  stop_.store(true, std::memory_order_release);
  wake_.raise();
  if (thread_.joinable()) thread_.join();
}

void AlertRelay::work() {
  constexpr double kLook_s = 1.0;
  std::uint64_t told = 0;
  Event event;
  for (bool last = false; !last;) {
    last = stop_.load(std::memory_order_acquire);
    while (waiting_.take(event)) next_.on_alert(event.alert, event.cleared);
    if (const std::uint64_t now = left_out(); now != told) {
      spdlog::warn("{} hit alerts found no room on their way to their topic and were left out", now - told);
      told = now;
    }
    if (!last) wake_.wait(kLook_s);
  }
}

}  // namespace phantom::phantom_sensing
