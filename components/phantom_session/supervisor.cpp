#include "components/phantom_session/supervisor.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <deque>
#include <fstream>

#include "common/core/errors.hpp"

namespace phantom::phantom_session {
namespace {

/// Blocks signals in this thread. Otherwise a child that gets SIGTERM between fork and exec would run the
/// parent's handler and continue.
class SignalsHeld {
 public:
  SignalsHeld() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalsHeld() { let_go(); }
  SignalsHeld(const SignalsHeld&) = delete;
  SignalsHeld& operator=(const SignalsHeld&) = delete;
  /// Restores the mask and keeps SIGUSR1 blocked: one that arrives before the child has a handler waits for
  /// it (runtime::install_signal_handlers()).
  void keep_emergency_stop() const {
    sigset_t mask = before_;
    sigaddset(&mask, SIGUSR1);
    pthread_sigmask(SIG_SETMASK, &mask, nullptr);
  }
  void let_go() const { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_;
};

// Runs between fork and exec: only async-signal-safe calls are allowed.
[[noreturn]] void become(const ProcessSpec& spec, char* const* argv, int log, const SignalsHeld& held) {
  for (const int handled : {SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGUSR1, SIGPIPE, SIGXFSZ})
    signal(handled, SIG_DFL);
  held.keep_emergency_stop();
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  setpgid(0, 0);  // Ctrl-C reaches the supervisor alone, which ends its children in order
  if (spec.nice != 0) setpriority(PRIO_PROCESS, 0, spec.nice);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(argv[0], argv);
  _exit(127);
}

}  // namespace

Supervisor::~Supervisor() {
  if (any_running()) stop_all(1.0);
}

void Supervisor::start(const ProcessSpec& spec) {
  if (access(spec.executable.c_str(), X_OK) != 0) {
    throw core::MissingError(spec.executable.string() +
                             ": no such executable; build it first (./scripts/demo does)");
  }
  std::filesystem::create_directories(spec.log.parent_path());
  const int log = open(spec.log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (log < 0) throw std::runtime_error(spec.log.string() + ": cannot be written: " + std::strerror(errno));
  std::string executable = spec.executable.string();
  std::vector<std::string> arguments = spec.arguments;
  std::vector<char*> argv{executable.data()};
  for (auto& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const SignalsHeld held;
  const pid_t pid = fork();
  if (pid == 0) become(spec, argv.data(), log, held);
  close(log);
  if (pid < 0) throw std::runtime_error(spec.name + ": cannot be started: " + std::strerror(errno));
  children_.push_back({{spec.name, std::nullopt, false}, pid, false});
}

void Supervisor::reap() {
  for (auto& child : children_) {
    int status = 0;
    if (child.outcome.exit_code || waitpid(child.pid, &status, WNOHANG) != child.pid) continue;
    child.outcome.exit_code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
    child.outcome.ended_by_us = stopping_;
  }
}

bool Supervisor::any_running() const {
  for (const auto& child : children_) {
    if (!child.outcome.exit_code) return true;
  }
  return false;
}

std::vector<ProcessOutcome> Supervisor::newly_dead() {
  reap();
  std::vector<ProcessOutcome> dead;
  for (auto& child : children_) {
    if (!child.outcome.exit_code || child.reported || child.outcome.ended_by_us) continue;
    child.reported = true;
    dead.push_back(child.outcome);
  }
  return dead;
}

void Supervisor::stop_all(double grace_s) {
  reap();
  stopping_ = true;
  for (auto child = children_.rbegin(); child != children_.rend(); ++child) {
    if (!child->outcome.exit_code) kill(child->pid, SIGTERM);
  }
  const auto end = core::monotonic_ns() + core::from_seconds(grace_s);
  while (any_running() && core::monotonic_ns() < end) {
    usleep(10'000);
    reap();
  }
  for (auto& child : children_) {
    if (!child.outcome.exit_code) kill(child.pid, SIGKILL);
  }
  while (any_running()) {
    usleep(10'000);
    reap();
  }
}

std::vector<ProcessOutcome> Supervisor::outcomes() const {
  std::vector<ProcessOutcome> all;
  for (const auto& child : children_) all.push_back(child.outcome);
  return all;
}

std::string last_lines(const std::filesystem::path& file, int count) {
  std::ifstream stream(file);
  std::deque<std::string> lines;
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line);
    if (lines.size() > static_cast<std::size_t>(count)) lines.pop_front();
  }
  std::string text;
  for (const auto& line : lines) text += "    " + line + '\n';
  return text;
}

}  // namespace phantom::phantom_session
