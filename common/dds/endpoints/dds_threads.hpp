#pragma once

#include <functional>

namespace phantom::dds {

/// Niceness of Fast DDS's threads in the haptic path, if the process may set it. These threads hold locks
/// that the publisher and the receiver need, so they must soon run again. They are not SCHED_FIFO: a reader
/// requests missed samples again and again, and they are resent each time; a reader on the same host that
/// this keeps from running would request for ever.
inline constexpr int kHapticNiceness = -10;

/// Calls `make` once in a thread that has the name of Fast DDS's threads (core/thread_place.hpp) and, if
/// `in_haptic_path`, kHapticNiceness where the process may set it. Threads that `make` starts inherit both;
/// Fast DDS 2.9 has no setting for them, and 3.1 names them itself. Throws what `make` throws. Blocks until
/// `make` has returned. Real-time safe: no.
void with_dds_threads(bool in_haptic_path, const std::function<void()>& make);

/// Gives the calling thread the receiver's place (core::ThreadRole::kReceiver) if it is a thread of Fast DDS,
/// at the thread's first call only. Call it where a sample arrives. Allocates nothing.
void take_receivers_place(int servo_priority) noexcept;

}  // namespace phantom::dds
