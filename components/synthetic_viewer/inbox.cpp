#include "components/synthetic_viewer/inbox.hpp"

#include <chrono>

namespace phantom::synthetic_viewer {

bool Inbox::put(Event event) {
  const auto* hit = std::get_if<HitSample>(&event);
  const bool urgent = hit != nullptr && !hit->cleared;
  {
    const std::lock_guard lock(mutex_);
    if (events_.size() >= kMaxEvents) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    events_.push_back(std::move(event));
    if (urgent) urgent_ = true;
  }
  if (urgent) arrived_.notify_one();
  return true;
}

std::deque<Event> Inbox::take_events() {
  std::deque<Event> taken;
  const std::lock_guard lock(mutex_);
  taken.swap(events_);
  urgent_ = false;
  return taken;
}

void Inbox::wait_until(core::Nanoseconds due_ns) {
  const auto left = std::chrono::nanoseconds(due_ns - core::monotonic_ns());
  std::unique_lock lock(mutex_);
  arrived_.wait_for(lock, left, [this] { return urgent_.load(); });
}

void Inbox::wake() {
  {
    const std::lock_guard lock(mutex_);
    urgent_ = true;
  }
  arrived_.notify_one();
}

}  // namespace phantom::synthetic_viewer
