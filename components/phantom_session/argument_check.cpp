#include "components/phantom_session/argument_check.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <sstream>
#include <stdexcept>

#include "common/core/errors.hpp"
#include "common/runtime/process.hpp"

namespace phantom::phantom_session {
namespace {

constexpr int kPoll_ms = 50;

struct Ended {
  int code = 0;  // 128 + n if signal n ended it
  std::string output;
};

/// Runs a program to its end and captures its output; ends it when a stop is requested.
Ended run(const std::filesystem::path& executable, std::vector<std::string> arguments) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    throw std::runtime_error(std::string("no pipe to be had: ") + std::strerror(errno));
  std::string path = executable.string();
  std::vector<char*> argv{path.data()};
  for (auto& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t pid = fork();
  if (pid == 0) {  // only async-signal-safe calls until exec
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(ends[1], STDOUT_FILENO);
    dup2(ends[1], STDERR_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(ends[1]);
  if (pid < 0) {
    close(ends[0]);
    throw std::runtime_error(path + ": cannot be started: " + std::strerror(errno));
  }
  Ended ended;
  std::array<char, 4096> buffer;
  for (bool open = true; open;) {
    if (runtime::stop_requested()) kill(pid, SIGKILL);
    pollfd wait{ends[0], POLLIN, 0};
    if (poll(&wait, 1, kPoll_ms) <= 0) continue;
    const ssize_t got = read(ends[0], buffer.data(), buffer.size());
    open = got > 0 || (got < 0 && errno == EINTR);
    if (got > 0) ended.output.append(buffer.data(), static_cast<std::size_t>(got));
  }
  close(ends[0]);
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  ended.code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  return ended;
}

/// Returns the line that says what is wrong: the last one that does not mention --help, without the
/// component's name.
std::string reason(const std::string& output, const std::string& component) {
  std::istringstream lines(output);
  std::string last;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.find("--help") == std::string::npos) last = line;
  }
  return last.starts_with(component + ": ") ? last.substr(component.size() + 2) : last;
}

}  // namespace

void check_arguments(const std::vector<PlannedProcess>& planned, const std::filesystem::path& bin) {
  for (const PlannedProcess& each : planned) {
    if (!each.own_arguments || runtime::stop_requested()) continue;
    const auto executable = bin / each.process.component;
    if (access(executable.c_str(), X_OK) != 0) {
      throw core::MissingError(executable.string() +
                               ": no such executable; build it first (./scripts/demo does)");
    }
    std::vector<std::string> arguments{"--check"};
    arguments.insert(arguments.end(), each.arguments.begin(), each.arguments.end());
    const Ended ended = run(executable, std::move(arguments));
    if (ended.code == runtime::kExitDone || runtime::stop_requested()) continue;
    const std::string said = each.process.name + ": " + reason(ended.output, each.process.component);
    if (ended.code == runtime::kExitUsage) throw core::ConfigError(said);
    if (ended.code == runtime::kExitMissing) throw core::MissingError(said);
    throw std::runtime_error(said + " (its --check ended with code " + std::to_string(ended.code) + ")");
  }
}

std::filesystem::path component_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

}  // namespace phantom::phantom_session
