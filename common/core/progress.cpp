#include "common/core/progress.hpp"

#include <utility>

namespace phantom::core {

Progress::Progress(std::string name, double period_s, double limit_s)
    : name_(std::move(name)), period_s_(period_s), limit_s_(limit_s) {}

void Progress::begin(Nanoseconds now_ns) noexcept {
  begun_ns_.store(now_ns, std::memory_order_relaxed);
  last_ns_.store(now_ns, std::memory_order_relaxed);
}

void Progress::tick(Nanoseconds now_ns) noexcept {
  if (begun_ns_.load(std::memory_order_relaxed) == 0) begun_ns_.store(now_ns, std::memory_order_relaxed);
  const auto number = static_cast<std::uint64_t>(now_ns / kSlot_ns);
  auto& slot = slots_[number % kSlots];
  const std::uint64_t old = slot.load(std::memory_order_relaxed);
  slot.store(old >> kCountBits == number ? old + 1 : number << kCountBits | 1, std::memory_order_relaxed);
  ticks_.store(ticks_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  last_ns_.store(now_ns, std::memory_order_relaxed);
}

double Progress::rate_hz(Nanoseconds now_ns) const noexcept {
  const Nanoseconds begun_ns = begun_ns_.load(std::memory_order_relaxed);
  if (begun_ns == 0 || now_ns <= begun_ns) return 0.0;
  constexpr auto kReach_ns = static_cast<Nanoseconds>(kWindow + 1) * kSlot_ns;
  if (now_ns - begun_ns < kReach_ns)
    return static_cast<double>(ticks_.load(std::memory_order_relaxed)) / seconds(now_ns - begun_ns);
  const auto current = static_cast<std::uint64_t>(now_ns / kSlot_ns);  // not complete yet: left out
  std::uint64_t ticks = 0;
  for (const auto& slot : slots_) {
    const std::uint64_t word = slot.load(std::memory_order_relaxed);
    const std::uint64_t number = word >> kCountBits;
    if (number < current && number + kWindow >= current) ticks += word & ((1ULL << kCountBits) - 1);
  }
  return static_cast<double>(ticks) / seconds(static_cast<Nanoseconds>(kWindow) * kSlot_ns);
}

LoopStatistics Progress::statistics(Nanoseconds now_ns) const {
  const Nanoseconds ended_ns = ended_ns_.load();
  if (ended_ns != 0) now_ns = ended_ns;
  LoopStatistics out;
  out.name = name_;
  out.period_s = period_s_;
  out.rate_hz = rate_hz(now_ns);
  out.ticks = ticks_.load(std::memory_order_relaxed);
  const Nanoseconds last_ns = last_ns_.load(std::memory_order_relaxed);
  if (ended_ns != 0 || last_ns <= 0) return out;
  out.idle_s = now_ns > last_ns ? seconds(now_ns - last_ns) : 0.0;
  out.limit_s = limit_s_;
  return out;
}

}  // namespace phantom::core
