#pragma once

#include <spdlog/spdlog.h>

#include "common/core/clock.hpp"
#include "common/core/log_rate.hpp"

namespace phantom::messages {

/// Returns whether a request is logged at `rate`; logs how many requests before it were not. `what`: their
/// name in that line. A flood of requests must not fill the log or hide what else it says. Not thread-safe.
/// Real-time safe: no.
inline bool is_logged(core::LogRate& rate, const char* what) {
  const core::LogRate::Answer answer = rate.admit(core::monotonic_ns());
  if (answer.log && answer.left_out > 0) spdlog::warn("{}: {} more, not logged", what, answer.left_out);
  return answer.log;
}

}  // namespace phantom::messages
