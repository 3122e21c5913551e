#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <variant>

#include "common/core/snapshot.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/runtime/cell/other_arms.hpp"
#include "components/synthetic_viewer/samples/recent_samples.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"
#include "components/synthetic_viewer/state/camera_control.hpp"
#include "components/synthetic_viewer/state/stop_status.hpp"
#include "components/synthetic_viewer/video/video_source.hpp"

namespace phantom::synthetic_viewer {

using Event =
    std::variant<HitSample, ObjectSample, MeshChunkSample, ComponentSample, WorkspaceSample, SkinSample,
                 DoubtSample, UncertaintySample, FindingSample, LiveObjectSample, Command, ViewRequest>;

/// Passes samples from the middleware's threads to the viewer: newest states by lock-free snapshot, events in
/// two queues, one of them for alerts. The middleware's side never waits for a picture: the queues' lock is
/// held for a push or a swap only. Bounded in memory, whatever comes.
class Inbox {
 public:
  /// Greatest numbers of events that wait, of statuses among them, and greatest memory of the parts of meshes
  /// among them.
  static constexpr std::size_t kMaxEvents = 16384, kMaxStatuses = 1024,
                               kMaxMeshBytes = std::size_t{512} << 20;

  /// Who reads the newest values: the viewer's loop, the scene stream, and the thread on which alerts come.
  static constexpr std::uint32_t kLoop = 0, kScene = 1, kAlerts = 2;
  /// The newest values; each has one writing thread.
  core::Snapshot<ArmSample, 3> arm;
  core::Snapshot<PerceptSample, 3> percept;
  core::Snapshot<MasterSample, 2> master;
  core::Snapshot<GripperSample, 2> gripper;
  std::array<core::Snapshot<ArmSample, 2>, runtime::kMaxOtherArms> others;  ///< of other arms
  StopStatus stops;                                                         ///< any thread
  RecentSamples past;                                                       ///< any thread
  PictureInbox video;                    ///< of a camera whose pictures come over a topic
  std::atomic<bool> live_matter{false};  ///< the workspace has some, as the viewer's loop knows

  /// Surfaces of live matter in W, by its ids.
  using LiveShapes = std::map<std::uint16_t, geometry::TriangleMesh>;
  /// Brings all of them for the viewer's pictures. Any thread.
  void put_live_shapes(LiveShapes shapes);
  /// Returns the newest since the last call; nothing: there are none.
  std::optional<LiveShapes> take_live_shapes();

  /// Queues an event. Any thread. A raised alert is urgent. Returns false if the queue is full: the event is
  /// then lost and counted.
  bool put(Event event);
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }
  /// Returns all alerts since the last call, in order.
  std::deque<Event> take_hits();
  /// Returns all other events since the last call, in order. To be called only once those of the last call
  /// are dealt with: what waits here is bounded.
  std::deque<Event> take_events();
  /// Returns whether an urgent event came since the last take_hits(). Any thread.
  bool urgent() const noexcept { return urgent_.load(std::memory_order_relaxed); }
  /// Sleeps until `due_ns` (CLOCK_MONOTONIC), an urgent event, or wake().
  void wait_until(core::Nanoseconds due_ns);
  /// Ends the present or the next wait_until() at once.
  void wake();

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  bool has_room(const Event& event) const;

  std::deque<Event> hits_, events_;
  std::optional<LiveShapes> live_shapes_;
  std::size_t statuses_ = 0, mesh_bytes_ = 0;  // in events_
  std::atomic<bool> urgent_{false};
  std::atomic<std::uint64_t> lost_{0};
};

}  // namespace phantom::synthetic_viewer
