#pragma once

#include <functional>
#include <span>
#include <string>

namespace phantom::core {

/// What a thread of one of our processes does: fixes its name and how urgent it is.
enum class ThreadRole {
  kServo,
  kBareLoop,
  kPublisher,
  kCanBus,
  kDrives,
  kReceiver,
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
  kRequests,
  kReadmission,
  kHelper,
  kOutput,
};

/// A thread's place in the one scheme of all processes, which ARCHITECTURE.md shows as a table.
struct ThreadPlace {
  ThreadRole role;
  const char* name;       ///< as the kernel shows it (at most 15 characters); "": the executable's
  int below_servo;        ///< its SCHED_FIFO priority is so much below the servo's; kOrdinary: it has none
  const char* processes;  ///< that have it
  const char* does;
  const char* may_block_on;

  static constexpr int kOrdinary = -1;
};

/// All places, the most urgent first.
std::span<const ThreadPlace> thread_scheme() noexcept;
const ThreadPlace& place_of(ThreadRole role) noexcept;

/// The SCHED_FIFO priority of a role where the servo has `servo_priority`; 0: none, for the role has none or
/// `servo_priority` is 0. At least 1 else.
int fifo_priority(ThreadRole role, int servo_priority) noexcept;

/// The servo's priority unless a configuration says otherwise.
inline constexpr int kServoPriority = 20;

/// Gives the calling thread its name and the priority of its role, or ordinary scheduling if it has none;
/// threads that it starts thereafter inherit both. Returns what was refused, for a person; empty if nothing.
/// Not real-time safe.
std::string take_place(ThreadRole role, int servo_priority = 0);

/// Calls `work` once in a thread of that role, whose place the threads inherit that `work` starts, and
/// returns when it has. Throws what `work` throws. Not real-time safe.
void run_in_place(ThreadRole role, int servo_priority, const std::function<void()>& work);

}  // namespace phantom::core
