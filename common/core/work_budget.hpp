#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <utility>

namespace phantom::core {

/// A bound on work that is counted while it is done, in units that do not depend on the machine, and a way to
/// end it. Threads count through a WorkMeter each. Thread-safe.
class WorkBudget {
 public:
  /// `go_on` may be empty. It is called every few thousand units, on any of the threads that work; the work
  /// ends once it returns false.
  explicit WorkBudget(std::uint64_t most = UINT64_MAX, std::function<bool()> go_on = {})
      : most_(most), go_on_(std::move(go_on)) {}

  /// Counts units. Returns false if the work must end: it is over the bound, or go_on() returned false.
  bool spend(std::uint64_t units) {
    const std::uint64_t before = spent_.fetch_add(units, std::memory_order_relaxed);
    if (before + units > most_) exceeded_.store(true, std::memory_order_relaxed);
    if (go_on_ && !go_on_()) stopped_.store(true, std::memory_order_relaxed);
    return !ended();
  }
  bool ended() const { return exceeded() || stopped_.load(std::memory_order_relaxed); }
  /// Returns whether more than the bound was counted.
  bool exceeded() const { return exceeded_.load(std::memory_order_relaxed); }
  std::uint64_t spent() const { return spent_.load(std::memory_order_relaxed); }
  std::uint64_t most() const { return most_; }

 private:
  const std::uint64_t most_;
  const std::function<bool()> go_on_;
  std::atomic<std::uint64_t> spent_{0};
  std::atomic<bool> exceeded_{false}, stopped_{false};
};

/// Counts one thread's work for a budget, which it asks every kEvery units. Without a budget it counts
/// nothing.
class WorkMeter {
 public:
  static constexpr std::uint64_t kEvery = 16384;

  explicit WorkMeter(WorkBudget* budget) : budget_(budget) {}
  ~WorkMeter() {
    if (budget_ != nullptr && units_ > 0) budget_->spend(units_);
  }
  WorkMeter(const WorkMeter&) = delete;
  WorkMeter& operator=(const WorkMeter&) = delete;

  /// Returns false if the work must end.
  bool spend(std::uint64_t units) {
    if (budget_ == nullptr) return true;
    units_ += units;
    if (units_ < kEvery) return !budget_->ended();
    const std::uint64_t counted = units_;
    units_ = 0;
    return budget_->spend(counted);
  }

 private:
  WorkBudget* budget_;
  std::uint64_t units_ = 0;
};

}  // namespace phantom::core
