#include "common/messages/model_check.hpp"

#include <spdlog/spdlog.h>

namespace phantom::messages {

void ModelCheck::look(std::string_view label) {
  if (own_ == nullptr || label == label_) return;
  label_ = label;
  std::string difference = robot::difference(*own_, label);
  if (!difference.empty()) {
    spdlog::error("{} comes from a process with another model: {}; give both hosts the same files", topic_,
                  difference);
  } else if (differs()) {
    spdlog::info("{} comes from a process with the same model again", topic_);
  }
  differs_.store(!difference.empty(), std::memory_order_relaxed);
  const std::lock_guard lock(mutex_);
  difference_ = std::move(difference);
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
