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

/// Between the middleware's threads and the viewer's: newest state by lock-free snapshot, events in a queue.
/// The middleware's side never waits for a picture: the queue's lock is held for a push or a swap only.
class Inbox {
 public:
  /// Newest value; one writing thread each.
  core::Snapshot<ArmSample> arm;
  core::Snapshot<PerceptSample> percept;
  core::Snapshot<MasterSample> master;
  StopBoard stops;  ///< any thread

  /// Any thread. An alert that is raised is urgent. False if the queue is full: the event is lost (and
  /// counted).
  bool put(Event event);
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }
  /// All events since the last call, in order.
  std::deque<Event> take_events();
  /// Whether something urgent came since the last take_events(). Any thread.
  bool urgent() const noexcept { return urgent_.load(std::memory_order_relaxed); }
  /// Sleeps until `due_ns` (CLOCK_MONOTONIC), something urgent, or wake().
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
