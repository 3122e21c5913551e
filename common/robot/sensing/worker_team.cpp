#include "common/robot/sensing/worker_team.hpp"

#include <pthread.h>

namespace phantom::robot {
namespace {

constexpr unsigned kPartBits = 20;
constexpr std::uint64_t kPartMask = WorkerTeam::kMaxParts;
/// Number of checks before a thread parks: some tens of microseconds. That is longer than a worker lags
/// behind the others at the end of a job, and much shorter than the time between two ticks.
constexpr int kSpins = 1000;

void relax() noexcept {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

std::uint64_t part_of(std::uint64_t ticket) noexcept { return ticket & kPartMask; }
std::uint64_t parts_of(std::uint64_t ticket) noexcept { return ticket >> kPartBits & kPartMask; }

/// Waits until `value` is no longer `old`: checks for a while, then parks.
void wait_for_change(const std::atomic<std::int32_t>& value, std::int32_t old) noexcept {
  for (int i = 0; i < kSpins; ++i, relax()) {
    if (value.load(std::memory_order_acquire) != old) return;
  }
  value.wait(old, std::memory_order_acquire);
}

}  // namespace

WorkerTeam::WorkerTeam(std::size_t threads) {
  for (std::size_t i = 1; i < threads; ++i) {
    workers_.emplace_back([this] { serve(); });
    pthread_setname_np(workers_.back().native_handle(), "sensing");
  }
}

WorkerTeam::~WorkerTeam() {
  stop_.store(true, std::memory_order_relaxed);
  job_counter_.fetch_add(1, std::memory_order_release);
  job_counter_.notify_all();
}

void WorkerTeam::take_parts() noexcept {
  std::uint64_t ticket = ticket_.load(std::memory_order_acquire);
  while (part_of(ticket) < parts_of(ticket)) {
    if (!ticket_.compare_exchange_weak(ticket, ticket + 1, std::memory_order_acq_rel,
                                       std::memory_order_acquire))
      continue;
    call_(job_, part_of(ticket));
    const auto parts = static_cast<std::int32_t>(parts_of(ticket));
    if (done_.fetch_add(1, std::memory_order_acq_rel) + 1 == parts) done_.notify_one();
    ticket = ticket_.load(std::memory_order_acquire);
  }
}

void WorkerTeam::serve() noexcept {
  // The bell is read before the ticket: a job that starts in between rings it, and the wait ends at once.
  for (std::int32_t seen = job_counter_.load(std::memory_order_acquire);
       !stop_.load(std::memory_order_relaxed);
       wait_for_change(job_counter_, seen), seen = job_counter_.load(std::memory_order_acquire)) {
    take_parts();
  }
}

void WorkerTeam::run(std::size_t parts, Call call, const void* job) noexcept {
  if (workers_.empty() || parts < 2 || parts > kMaxParts) {
    for (std::size_t part = 0; part < parts; ++part) call(job, part);
    return;
  }
  call_ = call;
  job_ = job;
  done_.store(0, std::memory_order_relaxed);
  const std::uint64_t number = (ticket_.load(std::memory_order_relaxed) >> 2 * kPartBits) + 1;
  ticket_.store(number << 2 * kPartBits | static_cast<std::uint64_t>(parts) << kPartBits,
                std::memory_order_release);
  job_counter_.fetch_add(1, std::memory_order_release);
  job_counter_.notify_all();
  take_parts();
  const auto all = static_cast<std::int32_t>(parts);
  for (std::int32_t done = done_.load(std::memory_order_acquire); done != all;
       done = done_.load(std::memory_order_acquire))
    wait_for_change(done_, done);
}

}  // namespace phantom::robot
