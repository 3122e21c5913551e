#pragma once

#include <array>
#include <atomic>
#include <cstddef>

namespace phantom::core {

/// Ring buffer that passes events from one thread to another in order, `Size` (a power of two) at most at a
/// time. Every event counts. For a state, of which only the newest value counts, use Snapshot.
///
/// Neither side ever waits, locks or allocates, unless copying a T does. Thread-safe: one writer, one reader.
/// Real-time safe: yes, both ends.
template <class T, std::size_t Size>
class EventRing {
  static_assert(Size > 0 && (Size & (Size - 1)) == 0, "places are found by a mask");

 public:
  EventRing() = default;
  EventRing(const EventRing&) = delete;
  EventRing& operator=(const EventRing&) = delete;

  /// Adds an event. Returns false, and changes nothing, if the ring is full. Writer thread only.
  bool put(const T& event) noexcept {
    const std::size_t put = put_.load(std::memory_order_relaxed);
    if (put - taken_.load(std::memory_order_acquire) == Size) return false;
    places_[put & (Size - 1)] = event;
    put_.store(put + 1, std::memory_order_release);
    return true;
  }

  /// Takes the oldest event out of the ring. Returns false, and leaves `event` alone, if the ring is empty.
  /// Reader thread only.
  bool take(T& event) noexcept {
    const std::size_t taken = taken_.load(std::memory_order_relaxed);
    if (put_.load(std::memory_order_acquire) == taken) return false;
    event = places_[taken & (Size - 1)];
    taken_.store(taken + 1, std::memory_order_release);
    return true;
  }

 private:
  std::array<T, Size> places_{};
  alignas(64) std::atomic<std::size_t> put_{0};  // total count of events put; put_ − taken_ events wait
  alignas(64) std::atomic<std::size_t> taken_{0};
};

}  // namespace phantom::core
