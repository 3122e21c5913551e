// freeze_thread THREAD: one thread of a process does not run while this does: until its standard input ends.
// Nothing else of the process is held up. Says "frozen" once it is.
// freeze_thread THREAD GAP_MS RUN_MS COUNT: so many times in a row it does not run for GAP_MS and runs for
// RUN_MS.
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace {

int hold_up(pid_t thread, int gap_ms, int run_ms, int count) {
  for (int status = 0, i = 0; i < count; ++i) {
    usleep(1000 * gap_ms);
    if (ptrace(PTRACE_CONT, thread, nullptr, nullptr) != 0) return 3;
    usleep(1000 * run_ms);
    if (i + 1 == count) break;
    if (ptrace(PTRACE_INTERRUPT, thread, nullptr, nullptr) != 0 || waitpid(thread, &status, __WALL) != thread)
      return 3;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 5) {
    std::fputs("usage: freeze_thread THREAD [GAP_MS RUN_MS COUNT]\n", stderr);
    return 2;
  }
  const pid_t thread = std::atoi(argv[1]);
  int status = 0;
  if (ptrace(PTRACE_SEIZE, thread, nullptr, nullptr) != 0 ||
      ptrace(PTRACE_INTERRUPT, thread, nullptr, nullptr) != 0 || waitpid(thread, &status, __WALL) != thread) {
    std::perror("freeze_thread");
    return 3;
  }
  std::puts("frozen");
  std::fflush(stdout);
  if (argc == 5) return hold_up(thread, std::atoi(argv[2]), std::atoi(argv[3]), std::atoi(argv[4]));
  char ignored[64];
  while (read(STDIN_FILENO, ignored, sizeof ignored) > 0) continue;
  ptrace(PTRACE_DETACH, thread, nullptr, nullptr);  // fails if the process ended meanwhile
}
