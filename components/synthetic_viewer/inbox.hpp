#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <variant>

#include "common/core/snapshot.hpp"
#include "components/synthetic_viewer/camera_control.hpp"
#include "components/synthetic_viewer/samples.hpp"
#include "components/synthetic_viewer/stop_board.hpp"

namespace phantom::synthetic_viewer {

using Event = std::variant<HitSample, ObjectSample, ObjectGone, MeshChunkSample, ComponentSample,
                           WorkspaceSample, SkinSample, Command, ViewRequest>;

/// Passes samples from the middleware's threads to the viewer: newest states by lock-free snapshot, events in
/// a queue. The middleware's side never waits for a picture: the queue's lock is held for a push or a swap
/// only.
class Inbox {
 public:
  /// The newest values; each has one writing thread.
  core::Snapshot<ArmSample> arm;
  core::Snapshot<PerceptSample> percept;
  core::Snapshot<MasterSample> master;
  StopBoard stops;  ///< any thread

  /// Queues an event. Any thread. A raised alert is urgent. Returns false if the queue is full: the event is
  /// then lost and counted.
  bool put(Event event);
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }
  /// Returns all events since the last call, in order.
  std::deque<Event> take_events();
  /// Returns whether an urgent event came since the last take_events(). Any thread.
  bool urgent() const noexcept { return urgent_.load(std::memory_order_relaxed); }
  /// Sleeps until `due_ns` (CLOCK_MONOTONIC), an urgent event, or wake().
  void wait_until(core::Nanoseconds due_ns);
  /// Ends the present or the next wait_until() at once.
  void wake();

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  static constexpr std::size_t kMaxEvents = 16384;

  std::deque<Event> events_;
  std::atomic<bool> urgent_{false};
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace phantom::synthetic_viewer
