#include "common/messages/model_check.hpp"

#include <spdlog/spdlog.h>

namespace phantom::messages {

void ModelCheck::look(std::string_view label, core::Nanoseconds received_ns) {
  if (own_ == nullptr) return;
  if (label != label_) {
    label_ = label;
    std::string difference = robot::difference(*own_, label);
    differs_.store(!difference.empty(), std::memory_order_relaxed);
    if (!difference.empty()) {
      if (difference != logged_)
        spdlog::error("{} comes from a process with another model: {}; give both hosts the same files",
                      topic_, difference);
      logged_ = difference;
      const std::lock_guard lock(mutex_);
      difference_ = std::move(difference);
    }
  }
  if (differs()) differed_ns_ = received_ns;
  if (differs() || differed_ns_ == 0 || received_ns - differed_ns_ < kReported_ns) return;
  differed_ns_ = 0;
  const std::lock_guard lock(mutex_);
  difference_.clear();
}

void add_difference(core::Health& health, const std::string& difference) {
  if (difference.empty()) return;
  health.message += (health.message.empty() ? "" : "; ") + difference;
}

std::string ModelCheck::difference() const {
  const std::lock_guard lock(mutex_);
  return difference_;
}

}  // namespace phantom::messages
