#include "common/dds/admission/refusal_log.hpp"

#include <spdlog/spdlog.h>

namespace phantom::dds {

void RefusalLog::refused(std::string_view why, core::Nanoseconds now_ns) {
  const std::lock_guard lock(mutex_);
  ++count_;
  if (now_ns < quiet_until_ns_) return;
  quiet_until_ns_ = now_ns + kEvery_ns;
  spdlog::warn("{} refused: {} ({} refused so far)", topic_, why, count_);
}

}  // namespace phantom::dds
