#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/clock.hpp"

namespace phantom::phantom_session {

/// A process to start.
struct ProcessSpec {
  std::string name;  ///< shown to the user; names the log file
  std::filesystem::path executable;
  std::vector<std::string> arguments;
  int nice = 0;
  std::filesystem::path log;  ///< file for stdout and stderr
};

/// The state of a process, or how it ended.
struct ProcessOutcome {
  std::string name;
  std::optional<int> exit_code;  ///< none while it runs; 128 + n if signal n ended it
  bool ended_by_us = false;      ///< it ended after stop_all() was called
};

/// Starts processes, notices when one ends, and stops them in reverse order of their start. Children die with
/// this process (PDEATHSIG). Not thread-safe.
class Supervisor {
 public:
  ~Supervisor();
  /// Starts a process. Throws core::MissingError if the executable does not exist, std::runtime_error if it
  /// cannot be started.
  void start(const ProcessSpec& spec);
  /// Returns the processes that ended since the last call without stop_all().
  std::vector<ProcessOutcome> newly_dead();
  /// Sends SIGTERM to all, the last started first, then SIGKILL to those that have not ended after `grace_s`.
  void stop_all(double grace_s);
  std::vector<ProcessOutcome> outcomes() const;

 private:
  struct Child {
    ProcessOutcome outcome;
    pid_t pid = -1;
    bool reported = false;
  };
  void reap();
  bool any_running() const;
  std::vector<Child> children_;
  bool stopping_ = false;
};

/// Returns the last `count` lines of a log file, to show why a process died.
std::string last_lines(const std::filesystem::path& file, int count);

}  // namespace phantom::phantom_session
