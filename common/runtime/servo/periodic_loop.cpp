#include "common/runtime/servo/periodic_loop.hpp"

#include <sys/mman.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/runtime/process/process.hpp"

namespace phantom::runtime {
namespace {

constexpr double kPeriodsToHang = 20.0;

void sleep_until(core::Nanoseconds due_ns) noexcept {
  const timespec due{due_ns / core::kNsPerSecond, due_ns % core::kNsPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {
    if (stop_requested()) return;
  }
}

}  // namespace

PeriodicLoop::PeriodicLoop(std::string name, double period_s, core::ThreadRole role,
                           LoopScheduling scheduling)
    : period_s_(period_s),
      role_(role),
      scheduling_(scheduling),
      progress_(std::move(name), period_s,
                role == core::ThreadRole::kBareLoop
                    ? 0.0
                    : std::max(core::Progress::kHangsAfter_s, kPeriodsToHang * period_s)) {}

void PeriodicLoop::set_up_thread() {
  notice_ = core::apply_thread_config(role_, scheduling_.servo_priority);
  if (scheduling_.lock_memory && mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    notice_ +=
        (notice_.empty() ? "" : "; ") + std::string("memory not locked (") + std::strerror(errno) + ")";
  }
  set_up_.store(true, std::memory_order_release);
}

void PeriodicLoop::publish() noexcept {
  const auto us = [](core::Nanoseconds ns) { return static_cast<double>(ns) * 1e-3; };
  published_.write({us(lateness_.quantile_ns(0.5)), us(lateness_.quantile_ns(0.99)), us(lateness_.max_ns()),
                    us(work_.quantile_ns(0.5)), us(work_.max_ns()), slips_});
}

void PeriodicLoop::run(const std::function<bool(double dt_s)>& body) {
  set_up_thread();
  const core::Nanoseconds period_ns = core::from_seconds(period_s_);
  const core::Nanoseconds start_ns = core::monotonic_ns();
  const auto ticks_a_second = static_cast<std::uint64_t>(std::max(1.0, 1.0 / period_s_));
  core::Nanoseconds due_ns = start_ns + period_ns;
  core::Nanoseconds previous_due_ns = start_ns;
  std::uint64_t until_publishing = ticks_a_second;
  progress_.begin(start_ns);
  while (!stop_.load(std::memory_order_relaxed) && !stop_requested()) {
    sleep_until(due_ns);
    const core::Nanoseconds woken_ns = core::monotonic_ns();
    lateness_.record(woken_ns - due_ns);
    const bool go_on = body(core::seconds(due_ns - previous_due_ns));
    const core::Nanoseconds done_ns = core::monotonic_ns();
    work_.record(done_ns - woken_ns);
    progress_.tick(done_ns);
    if (--until_publishing == 0) {
      until_publishing = ticks_a_second;
      publish();
    }
    if (!go_on) break;
    previous_due_ns = due_ns;
    due_ns += period_ns;
    if (due_ns < done_ns) {
      const auto missed = static_cast<std::uint64_t>((done_ns - due_ns) / period_ns + 1);
      slips_ += missed;
      due_ns += static_cast<core::Nanoseconds>(missed) * period_ns;
    }
  }
  publish();
  progress_.end();
}

core::LoopStatistics PeriodicLoop::statistics() {
  published_.read(latest_);
  core::LoopStatistics now = progress_.statistics();
  now.wakeup_p50_us = latest_.p50_us;
  now.wakeup_p99_us = latest_.p99_us;
  now.wakeup_max_us = latest_.max_us;
  now.work_p50_us = latest_.work_p50_us;
  now.work_max_us = latest_.work_max_us;
  now.slips = latest_.slips;
  return now;
}

}  // namespace phantom::runtime
