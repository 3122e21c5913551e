#pragma once

#include <functional>
#include <span>
#include <string>

namespace phantom::core {

/// The role of a thread in the project's processes. It fixes the thread's name and its priority.
enum class ThreadRole {
  kServo,
  kBareLoop,
  kPublisher,
  kCanBus,
  kDrives,
  kReceiver,
  kSwitch,
  kDesk,
  kSensing,
  kControl,
  kAlerts,
  kReplies,
  kAudio,
  kDds,
  kMain,
  kWorkspace,
  kViewer,
  kFilm,
  kPictures,
  kPage,
  kPageReader,
  kScene,
  kRequests,
  kReadmission,
  kStopFile,
  kHelper,
  kOutput,
};

/// A thread's row in the scheduling scheme of all processes, which docs/threads.md shows as a table.
struct ThreadConfig {
  ThreadRole role;
  const char* name;  ///< as the kernel shows it (at most 15 characters); "": the name of the executable
  /// How far its SCHED_FIFO priority is below the servo's; kOrdinary: no real-time priority.
  int below_servo;
  const char* processes;  ///< processes that have such a thread
  const char* does;
  const char* may_block_on;

  static constexpr int kOrdinary = -1;
};

/// Returns all places, the most urgent first.
std::span<const ThreadConfig> thread_scheme() noexcept;
const ThreadConfig& place_of(ThreadRole role) noexcept;

/// Returns the SCHED_FIFO priority of a role if the servo has `servo_priority`: at least 1, or 0 for none, if
/// the role has none or `servo_priority` is 0.
int fifo_priority(ThreadRole role, int servo_priority) noexcept;

/// The servo's priority unless a configuration says otherwise.
inline constexpr int kServoPriority = 20;

/// Gives the calling thread its name and the priority of its role, or ordinary scheduling if the role has
/// none. Threads that it starts afterwards inherit both. Returns what the kernel refused, in words for a
/// person; empty if nothing. Not real-time safe.
std::string apply_thread_config(ThreadRole role, int servo_priority = 0);

/// Calls `work` once in a thread of that role and returns when `work` has returned. Threads that `work`
/// starts inherit the role's place. Throws what `work` throws. Not real-time safe.
void run_in_place(ThreadRole role, int servo_priority, const std::function<void()>& work);

}  // namespace phantom::core
