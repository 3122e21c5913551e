#pragma once

#include <functional>

namespace phantom::dds {

/// Niceness of Fast DDS's threads in the haptic path, where it is permitted: they hold locks that the
/// publisher and the receiver need, and must soon be given the processor again. Not SCHED_FIFO: what a reader
/// misses is sent again as often as it asks, and a reader on the same host that is kept from running by that
/// asks for ever.
inline constexpr int kHapticNiceness = -10;

/// Calls `make` once, in a thread with the name of those of Fast DDS (core/thread_place.hpp) and, if
/// `in_haptic_path`, with kHapticNiceness where that is permitted: the threads inherit both that `make`
/// starts, and Fast DDS 2.9 has no setting for them. Throws what `make` throws. Blocks until `make` has
/// returned. Real-time safe: no.
void with_dds_threads(bool in_haptic_path, const std::function<void()>& make);

/// To be called where a sample has come: if this is a thread of Fast DDS, it takes the receiver's place
/// (core::ThreadRole::kReceiver), once. Allocates nothing.
void take_receivers_place(int servo_priority) noexcept;

}  // namespace phantom::dds
