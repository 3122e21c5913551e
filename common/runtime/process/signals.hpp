#pragma once

#include <cstdint>

namespace phantom::runtime {

/// Installs the handlers of every signal that a process of this project handles. This is the only place that
/// does so, beside the last words of a crash (last_words.hpp):
/// - SIGINT, SIGTERM, SIGHUP and SIGQUIT request an orderly end. A SIGHUP that is ignored (nohup) stays so.
///   Until signals_started() the signal's default action ends the process, because nothing has begun.
/// - SIGUSR1 is counted from the first moment on (emergency_stop_signals()).
/// - SIGPIPE and SIGXFSZ are ignored, so that write() reports EPIPE and EFBIG.
///
/// Unblocks SIGUSR1, which a parent may block across exec() so that none is lost. Executables run it before
/// the constructors of their shared libraries (process_main.cpp). A second call does nothing.
void install_signal_handlers() noexcept;

/// Ends the time in which a signal ends the process by its default action. Call it once, before the work.
void signals_started() noexcept;

/// Returns true after a signal that ends the process, or request_stop(). Real-time safe: yes.
bool stop_requested() noexcept;
/// Requests an orderly end of the process, as a signal does. Async-signal-safe.
void request_stop() noexcept;
/// Returns how many SIGUSR1 signals have arrived. Each one requests an emergency stop from a process that
/// moves something, and from a recorder that it writes what it holds in memory. Real-time safe: yes.
std::uint32_t emergency_stop_signals() noexcept;
/// Returns a file descriptor that is readable once a stop is requested; −1 before install_signal_handlers().
int stop_event() noexcept;

namespace internal {
/// Counts living EndsAtOnce objects (process.hpp).
void enter_ends_at_once(int exit_code) noexcept;
void leave_ends_at_once() noexcept;
}  // namespace internal

}  // namespace phantom::runtime
