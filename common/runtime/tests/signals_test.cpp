#include "common/runtime/process/signals.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <functional>

#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

constexpr int kRight = 42;

// Returns the exit code of a child that installs the handlers and then does `work`; 128 + n: signal n ended
// it.
int outcome(
    const std::function<bool()>& work, const std::function<void()>& before = [] {}) {
  const pid_t child = fork();
  if (child == 0) {
    before();
    install_signal_handlers();
    _exit(work() ? kRight : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

TEST(Signals, SR25_EverySignalThatEndsRequestsAnOrderlyEnd) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    EXPECT_EQ(outcome([number] {
                signals_started();
                raise(number);
                return stop_requested();
              }),
              kRight)
        << number;
  }
}

TEST(Signals, BeforeTheWorkSuchASignalEndsTheProcess) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT})
    EXPECT_EQ(outcome([number] { return raise(number) == 0; }), 128 + number);
}

TEST(Signals, SR01_AnEmergencyStopIsCountedFromTheFirstMomentOn) {
  EXPECT_EQ(outcome([] {
              raise(SIGUSR1);
              signals_started();
              raise(SIGUSR1);
              return emergency_stop_signals() == 2 && !stop_requested();
            }),
            kRight);
  const auto held = [] {  // as phantom_session starts its processes
    sigset_t mask;
    sigemptyset(&mask);
    sigaddset(&mask, SIGUSR1);
    sigprocmask(SIG_BLOCK, &mask, nullptr);
    raise(SIGUSR1);
  };
  EXPECT_EQ(outcome([] { return emergency_stop_signals() == 1; }, held), kRight);
}

TEST(Signals, AFileThatGrowsTooLargeAndABrokenPipeAreErrorsOfWrite) {
  const std::string file = (test::new_folder() / "grows").string();
  EXPECT_EQ(outcome([&file] {
              const rlimit limit{16, 16};
              setrlimit(RLIMIT_FSIZE, &limit);
              FILE* out = fopen(file.c_str(), "w");
              const char bytes[64] = {};
              const bool first = write(fileno(out), bytes, sizeof bytes) == 16;
              const bool too_large = write(fileno(out), bytes, sizeof bytes) < 0 && errno == EFBIG;
              int ends[2] = {-1, -1};
              const bool piped = pipe(ends) == 0 && close(ends[0]) == 0;
              return first && too_large && piped && write(ends[1], bytes, 1) < 0 && errno == EPIPE;
            }),
            kRight);
}

}  // namespace
}  // namespace phantom::runtime
