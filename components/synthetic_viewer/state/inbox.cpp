#include "components/synthetic_viewer/state/inbox.hpp"

#include <chrono>
#include <utility>

namespace phantom::synthetic_viewer {

/// Called with the lock held.
bool Inbox::has_room(const Event& event) const {
  if (hits_.size() + events_.size() >= kMaxEvents) return false;
  if (const auto* chunk = std::get_if<MeshChunkSample>(&event))
    return mesh_bytes_ + chunk->data.size() <= kMaxMeshBytes;
  return !std::holds_alternative<ComponentSample>(event) || statuses_ < kMaxStatuses;
}

bool Inbox::put(Event event) {
  const auto* hit = std::get_if<HitSample>(&event);
  const bool urgent = hit != nullptr && !hit->cleared;
  {
    const std::lock_guard lock(mutex_);
    if (!has_room(event)) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    if (const auto* chunk = std::get_if<MeshChunkSample>(&event)) mesh_bytes_ += chunk->data.size();
    if (std::holds_alternative<ComponentSample>(event)) ++statuses_;
    (hit != nullptr ? hits_ : events_).push_back(std::move(event));
    if (urgent) urgent_ = true;
  }
  if (urgent) arrived_.notify_one();
  return true;
}

void Inbox::put_live_shapes(LiveShapes shapes) {
  const std::lock_guard lock(mutex_);
  live_shapes_ = std::move(shapes);
}

std::optional<Inbox::LiveShapes> Inbox::take_live_shapes() {
  const std::lock_guard lock(mutex_);
  return std::exchange(live_shapes_, std::nullopt);
}

std::deque<Event> Inbox::take_hits() {
  std::deque<Event> taken;
  const std::lock_guard lock(mutex_);
  taken.swap(hits_);
  urgent_ = false;
  return taken;
}

std::deque<Event> Inbox::take_events() {
  std::deque<Event> taken;
  const std::lock_guard lock(mutex_);
  taken.swap(events_);
  statuses_ = mesh_bytes_ = 0;
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
