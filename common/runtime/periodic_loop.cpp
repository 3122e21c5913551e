#include "common/runtime/periodic_loop.hpp"

#include <pthread.h>
#include <sys/mman.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/runtime/process.hpp"

namespace phantom::runtime {
namespace {

void sleep_until(core::Nanoseconds due_ns) noexcept {
  const timespec due{due_ns / core::kNsPerSecond, due_ns % core::kNsPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {
    if (stop_requested()) return;
  }
}

}  // namespace

PeriodicLoop::PeriodicLoop(std::string name, double period_s, LoopScheduling scheduling)
    : name_(std::move(name)), period_s_(period_s), scheduling_(scheduling) {}

void PeriodicLoop::set_up_thread() {
  pthread_setname_np(pthread_self(), name_.substr(0, 15).c_str());
  if (scheduling_.fifo_priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = scheduling_.fifo_priority;
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (error != 0)
      notice_ += std::string("no real-time priority (") + std::strerror(error) +
                 "): expect slips under load; grant CAP_SYS_NICE or an rtprio limit; ";
  }
  if (scheduling_.lock_memory && mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    notice_ += std::string("memory not locked (") + std::strerror(errno) + "); ";
  }
  if (!notice_.empty()) notice_.resize(notice_.size() - 2);
  set_up_.store(true, std::memory_order_release);
}

void PeriodicLoop::publish(core::Nanoseconds start_ns) noexcept {
  const auto us = [](core::Nanoseconds ns) { return static_cast<double>(ns) * 1e-3; };
  published_.write({core::seconds(core::monotonic_ns() - start_ns), us(lateness_.quantile_ns(0.5)),
                    us(lateness_.quantile_ns(0.99)), us(lateness_.max_ns()), us(work_.quantile_ns(0.5)),
                    us(work_.max_ns()), ticks_, slips_});
}

void PeriodicLoop::run(const std::function<bool(double dt_s)>& body) {
  set_up_thread();
  const core::Nanoseconds period_ns = core::from_seconds(period_s_);
  const core::Nanoseconds start_ns = core::monotonic_ns();
  const auto ticks_a_second = static_cast<std::uint64_t>(std::max(1.0, 1.0 / period_s_));
  core::Nanoseconds due_ns = start_ns + period_ns;
  core::Nanoseconds previous_due_ns = start_ns;
  while (!stop_.load(std::memory_order_relaxed) && !stop_requested()) {
    sleep_until(due_ns);
    const core::Nanoseconds woken_ns = core::monotonic_ns();
    lateness_.record(woken_ns - due_ns);
    const bool go_on = body(core::seconds(due_ns - previous_due_ns));
    const core::Nanoseconds done_ns = core::monotonic_ns();
    work_.record(done_ns - woken_ns);
    ++ticks_;
    if (ticks_ % ticks_a_second == 0) publish(start_ns);
    if (!go_on) break;
    previous_due_ns = due_ns;
    due_ns += period_ns;
    if (due_ns < done_ns) {
      const auto missed = static_cast<std::uint64_t>((done_ns - due_ns) / period_ns + 1);
      slips_ += missed;
      due_ns += static_cast<core::Nanoseconds>(missed) * period_ns;
    }
  }
  publish(start_ns);
}

core::LoopStatistics PeriodicLoop::statistics() {
  published_.read(latest_);
  return {name_,
          period_s_,
          latest_.elapsed_s > 0 ? static_cast<double>(latest_.ticks) / latest_.elapsed_s : 0.0,
          latest_.p50_us,
          latest_.p99_us,
          latest_.max_us,
          latest_.work_p50_us,
          latest_.work_max_us,
          latest_.ticks,
          latest_.slips};
}

}  // namespace phantom::runtime
