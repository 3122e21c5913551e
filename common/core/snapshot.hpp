#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace phantom::core {

/// Exchange of the newest value between one writer thread and one reader thread (triple buffer).
///
/// Neither side ever waits, locks or allocates. The reader always sees a complete value, the newest written
/// before the call. A value that the reader does not fetch in time is overwritten: use it for states, and
/// EventRing for events. Thread-safe: one writer, one reader. Real-time safe: yes, both ends.
template <class T>
class Snapshot {
  static_assert(std::is_trivially_copyable_v<T>,
                "a snapshot is copied bytewise: keep it free of owning members");

 public:
  Snapshot() = default;
  Snapshot(const Snapshot&) = delete;
  Snapshot& operator=(const Snapshot&) = delete;

  /// Publishes `value`. Writer thread only.
  void write(const T& value) noexcept {
    slots_[write_slot_] = value;
    write_slot_ = middle_.exchange(write_slot_ | kFresh, std::memory_order_acq_rel) & kSlotMask;
  }

  /// Copies the newest value into `value` if one was written since the last call; otherwise leaves `value`
  /// alone. Returns whether `value` is new. Reader thread only.
  bool read(T& value) noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    read_slot_ = middle_.exchange(read_slot_, std::memory_order_acq_rel) & kSlotMask;
    value = slots_[read_slot_];
    return true;
  }

 private:
  static constexpr std::uint32_t kSlotMask = 3;
  static constexpr std::uint32_t kFresh = 4;

  std::array<T, 3> slots_{};
  alignas(64) std::uint32_t write_slot_ = 0;
  alignas(64) std::atomic<std::uint32_t> middle_{1};
  alignas(64) std::uint32_t read_slot_ = 2;
};

}  // namespace phantom::core
