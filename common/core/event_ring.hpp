#pragma once

#include <array>
#include <atomic>
#include <cstddef>

namespace phantom::core {

/// Events on their way from one thread to another, in order, `Size` at most (a power of two). Carries events,
/// of which each counts; for state, of which the newest counts, there is Snapshot.
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

  /// False, and nothing done, where the reader has left no room. Writer thread only.
  bool put(const T& event) noexcept {
    const std::size_t put = put_.load(std::memory_order_relaxed);
    if (put - taken_.load(std::memory_order_acquire) == Size) return false;
    places_[put & (Size - 1)] = event;
    put_.store(put + 1, std::memory_order_release);
    return true;
  }

  /// The oldest that waits; false, and `event` left alone, if none does. Reader thread only.
  bool take(T& event) noexcept {
    const std::size_t taken = taken_.load(std::memory_order_relaxed);
    if (put_.load(std::memory_order_acquire) == taken) return false;
    event = places_[taken & (Size - 1)];
    taken_.store(taken + 1, std::memory_order_release);
    return true;
  }

 private:
  std::array<T, Size> places_{};
  alignas(64) std::atomic<std::size_t> put_{0};  // events ever; the difference is what waits
  alignas(64) std::atomic<std::size_t> taken_{0};
};

}  // namespace phantom::core
