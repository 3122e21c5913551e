#include "common/runtime/process/last_words.hpp"

#include <cxxabi.h>
#include <execinfo.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <string_view>
#include <typeinfo>

#include "common/runtime/process/log.hpp"

namespace phantom::runtime {
namespace {

constexpr int kMaxCalls = 32;
constexpr unsigned kGrace_s = 2;

struct Fatal {
  int number;
  std::string_view name;
};
constexpr Fatal kFatal[] = {
    {SIGABRT, "SIGABRT"},
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    {SIGSEGV, "SIGSEGV"}, {SIGBUS, "SIGBUS"}, {SIGFPE, "SIGFPE"}, {SIGILL, "SIGILL"},
#endif
};

std::array<char, 64> g_component{};  // a copy: a signal's handler may use no string of the heap

struct ThreadName {
  ThreadName() noexcept { prctl(PR_GET_NAME, text.data()); }
  std::array<char, 16> text{};
};

/// Async-signal-safe.
void say(std::string_view text) noexcept {
  [[maybe_unused]] const auto written = write(STDERR_FILENO, text.data(), text.size());
}

// Only async-signal-safe calls are allowed, and backtrace(), which needs no heap after its first call. The
// action was reset before this is called, so that the second signal ends the process.
void on_fatal(int number) {
  alarm(kGrace_s);
  const auto* const fatal = std::find_if(std::begin(kFatal), std::end(kFatal),
                                         [number](const Fatal& each) { return each.number == number; });
  say(g_component.data());
  say(": ");
  say(fatal->name);
  say(" in thread '");
  say(ThreadName().text.data());
  say("', called from:\n");
  std::array<void*, kMaxCalls> calls{};
  backtrace_symbols_fd(calls.data(), backtrace(calls.data(), kMaxCalls), STDERR_FILENO);
  raise(number);
}

std::string name_of(const std::type_info& type) {
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> name(
      abi::__cxa_demangle(type.name(), nullptr, nullptr, &status), std::free);
  return status == 0 ? name.get() : type.name();
}

/// Returns type and message of the exception that nobody caught.
std::string uncaught() {
  const auto thrown = std::current_exception();
  if (!thrown) return "none: a thread was destroyed while it ran, or a pure virtual function was called";
  try {
    std::rethrow_exception(thrown);
  } catch (const std::exception& problem) {
    return name_of(typeid(problem)) + ": " + problem.what();
  } catch (...) {
    const std::type_info* type = abi::__cxa_current_exception_type();
    return type != nullptr ? name_of(*type) : "an unknown type";
  }
}

[[noreturn]] void on_terminate() noexcept {
  print_line(std::string(g_component.data()) + ": uncaught exception in thread '" + ThreadName().text.data() +
             "': " + uncaught());
  finish_log();
  std::abort();
}

}  // namespace

void leave_last_words(const std::string& component) {
  component.copy(g_component.data(), g_component.size() - 1);
  std::array<void*, 1> call{};
  backtrace(call.data(), 1);  // loads what it needs
  std::set_terminate(on_terminate);
  std::signal(SIGALRM, SIG_DFL);
  struct sigaction action {};
  action.sa_handler = on_fatal;
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_NODEFER;
  for (const Fatal& fatal : kFatal) sigaction(fatal.number, &action, nullptr);
}

}  // namespace phantom::runtime
