#include "components/audio_percept/sink.hpp"

#include <algorithm>
#include <cmath>

#include "common/runtime/process/process.hpp"
#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {

int PacedSink::periods_due(double dt_s) {
  constexpr double kMaxOwed_s = 5.0;  // a suspended host catches up at most this much
  owed_s_ = std::min(owed_s_ + dt_s, kMaxOwed_s);
  const double periods = std::floor(owed_s_ / kPeriod_s + 1e-6);
  owed_s_ -= periods * kPeriod_s;
  return static_cast<int>(periods);
}

OpenedSink open_sink(const AudioPerceptConfig& config) {
  if (config.sink == SinkChoice::kPaced) return {};
  std::string reason;
  if (auto live = open_live_sink(config, reason)) return {std::move(live), ""};
  if (config.sink == SinkChoice::kLive) {
    throw runtime::MissingError("output.sink: live needs a playback device: " + reason +
                                "; allowed without one: auto or paced");
  }
  return {nullptr, reason};
}

}  // namespace phantom::audio_percept
