#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/files.hpp"

namespace phantom::test {

/// An exit code (128 + n if signal n ended it) and what was written to standard output and error.
struct Said {
  int exit_code = 0;
  std::string output;
};

/// Runs a line of shell to its end, as a person would type it.
inline Said run_line(const std::string& line) {
  FILE* pipe = popen((line + " 2>&1").c_str(), "r");
  std::string output;
  std::array<char, 4096> buffer;
  while (const std::size_t got = fread(buffer.data(), 1, buffer.size(), pipe))
    output.append(buffer.data(), got);
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), output};
}

/// A running executable whose output goes to a file; killed with this.
class Process {
 public:
  Process(const std::vector<std::string>& arguments, std::filesystem::path log) : log_(std::move(log)) {
    pid_ = fork();
    if (pid_ != 0) return;
    const int file = open(log_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
    std::vector<char*> raw;
    for (const std::string& argument : arguments) raw.push_back(const_cast<char*>(argument.c_str()));
    raw.push_back(nullptr);
    execvp(raw[0], raw.data());
    _exit(127);
  }
  ~Process() {
    if (pid_ > 0 && code_ < 0) end(SIGKILL);
  }
  Process(const Process&) = delete;
  pid_t pid() const { return pid_; }
  void signal(int number) const { kill(pid_, number); }
  int wait() {
    int status = 0;
    waitpid(pid_, &status, 0);
    return code_ = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  }
  /// Sends the signal and waits; the exit code. Of one that has ended already, that.
  int end(int number) {
    if (code_ >= 0) return code_;
    signal(number);
    return wait();
  }
  std::string output() const { return read_text(log_); }

 private:
  pid_t pid_ = -1;
  int code_ = -1;
  std::filesystem::path log_;
};

}  // namespace phantom::test
