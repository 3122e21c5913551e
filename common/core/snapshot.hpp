#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace phantom::core {

/// Exchange of the newest value between one writer thread and `Readers` reader threads, numbered from 0.
///
/// Nobody ever waits, locks or allocates, whichever thread is preempted: the writer fills a slot that is
/// neither the newest nor claimed by a reader, and there are two more slots than readers. Each reader sees a
/// complete value, the newest written before the call; it looks again only if a write ended since it claimed.
/// A value that a reader does not fetch in time is overwritten: use it for states, and EventRing for events.
/// Thread-safe: one writer, one thread per reader number. Real-time safe: yes, all ends.
///
/// Source of the claims: M. M. Michael, Hazard pointers, IEEE TPDS 15 (2004) 491.
template <class T, std::uint32_t Readers = 1>
class Snapshot {
  static_assert(std::is_trivially_copyable_v<T>,
                "a snapshot is copied bytewise: keep it free of owning members");
  static_assert(Readers >= 1 && Readers <= 8, "each write looks at the claims of all readers");

 public:
  Snapshot() = default;
  Snapshot(const Snapshot&) = delete;
  Snapshot& operator=(const Snapshot&) = delete;

  /// Publishes `value`. Writer thread only.
  void write(const T& value) noexcept {
    const std::uint32_t slot = free_slot();
    slots_[slot] = value;
    newest_.store(++written_ * kSlots + slot);
  }

  /// Copies the newest value into `value` if one was written since this reader's last call; otherwise leaves
  /// `value` alone. Returns whether `value` is new. Thread of that reader only.
  template <std::uint32_t Reader = 0>
  bool read(T& value) noexcept {
    static_assert(Reader < Readers, "this snapshot has fewer readers");
    ReaderState& reader = readers_[Reader];
    std::uint64_t newest = newest_.load(std::memory_order_relaxed);
    if (newest == reader.seen) return false;
    // The claim counts once the slot is still the newest after it: no write chooses it from then on.
    do {
      newest = newest_.load();
      reader.claim.store(slot_of(newest));
    } while (newest_.load() != newest);
    value = slots_[slot_of(newest)];
    reader.claim.store(kNoSlot, std::memory_order_release);
    reader.seen = newest;
    return true;
  }

 private:
  static constexpr std::uint32_t kSlots = Readers + 2, kNoSlot = kSlots;

  struct alignas(64) ReaderState {
    std::atomic<std::uint32_t> claim{kNoSlot};
    std::uint64_t seen = 0;  // of that reader's thread
  };
  static std::uint32_t slot_of(std::uint64_t newest) noexcept {
    return static_cast<std::uint32_t>(newest % kSlots);
  }

  // Returns a slot that is neither the newest nor claimed: one of those after the newest, as each reader
  // claims one at most.
  std::uint32_t free_slot() const noexcept {
    std::array<bool, kSlots + 1> taken{};  // the last: no claim
    taken[slot_of(newest_.load(std::memory_order_relaxed))] = true;
    for (const ReaderState& reader : readers_) taken[reader.claim.load()] = true;
    std::uint32_t slot = 0;
    while (taken[slot]) ++slot;
    return slot;
  }

  std::array<T, kSlots> slots_{};
  alignas(64) std::uint64_t written_ = 0;             // of the writer's thread
  alignas(64) std::atomic<std::uint64_t> newest_{0};  // count of writes · kSlots + the slot of the last
  std::array<ReaderState, Readers> readers_{};
};

}  // namespace phantom::core
