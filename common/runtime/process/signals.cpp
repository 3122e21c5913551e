#include "common/runtime/process/signals.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>

namespace phantom::runtime {
namespace {

// All of these are initialised by the compiler, because handlers run before any constructor.
constinit std::atomic<bool> g_installed{false}, g_stop{false};
constinit std::atomic<bool> g_starting{false};  // an end by a signal is that of the signal's default action
constinit std::atomic<int> g_stop_event{-1};
constinit std::atomic<std::uint32_t> g_emergency_stops{0};
constinit std::atomic<int> g_end_at_once{0}, g_code_at_once{0};

void on_end(int number) {
  if (g_starting.load(std::memory_order_relaxed)) {
    std::signal(number, SIG_DFL);
    raise(number);  // takes effect when this handler returns
    return;
  }
  if (g_end_at_once.load(std::memory_order_relaxed) > 0)
    _exit(g_code_at_once.load(std::memory_order_relaxed));
  const int error = errno;
  request_stop();
  errno = error;
}

void on_emergency(int) { g_emergency_stops.fetch_add(1, std::memory_order_relaxed); }

void handle(int number, void (*handler)(int)) noexcept {
  struct sigaction action {};
  action.sa_handler = handler;
  sigaction(number, &action, nullptr);
}

bool is_ignored(int number) noexcept {
  struct sigaction action {};
  return sigaction(number, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

void set_up() noexcept {
  g_stop_event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  g_starting = true;
  handle(SIGUSR1, on_emergency);
  for (const int number : {SIGINT, SIGTERM, SIGQUIT}) handle(number, on_end);
  if (!is_ignored(SIGHUP)) handle(SIGHUP, on_end);
  for (const int number : {SIGPIPE, SIGXFSZ}) handle(number, SIG_IGN);
}

}  // namespace

void install_signal_handlers() noexcept {
  if (!g_installed.exchange(true)) set_up();
  sigset_t held;
  sigemptyset(&held);
  sigaddset(&held, SIGUSR1);
  pthread_sigmask(SIG_UNBLOCK, &held, nullptr);
}

void signals_started() noexcept { g_starting = false; }

bool stop_requested() noexcept { return g_stop.load(std::memory_order_relaxed); }

void request_stop() noexcept {
  g_stop.store(true, std::memory_order_relaxed);
  const std::uint64_t one = 1;
  const int event = g_stop_event.load(std::memory_order_relaxed);
  if (event >= 0) [[maybe_unused]]
    const auto written = write(event, &one, sizeof one);
}

std::uint32_t emergency_stop_signals() noexcept { return g_emergency_stops.load(std::memory_order_relaxed); }

int stop_event() noexcept { return g_stop_event.load(std::memory_order_relaxed); }

namespace internal {

void enter_ends_at_once(int exit_code) noexcept {
  g_code_at_once.store(exit_code);
  g_end_at_once.fetch_add(1);
  if (stop_requested()) _exit(exit_code);  // the signal arrived just before
}

void leave_ends_at_once() noexcept { g_end_at_once.fetch_sub(1); }

}  // namespace internal
}  // namespace phantom::runtime
