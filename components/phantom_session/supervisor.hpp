#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/clock.hpp"

namespace phantom::phantom_session {

/// What to start.
struct ProcessSpec {
  std::string name;  ///< shown to the user; also the log file's name
  std::filesystem::path executable;
  std::vector<std::string> arguments;
  int nice = 0;
  std::filesystem::path log;  ///< stdout and stderr go here
};

/// How a process is or how it ended.
struct ProcessOutcome {
  std::string name;
  std::optional<int> exit_code;  ///< absent while it runs; 128 + n if signal n ended it
  bool ended_by_us = false;      ///< it ended after stop_all() asked it to
};

/// Starts processes, notices when one ends, and ends them in order. Children die with this process
/// (PDEATHSIG). Not thread-safe.
class Supervisor {
 public:
  ~Supervisor();
  /// Starts one. Throws core::MissingError if the executable is not there, std::runtime_error if it cannot be
  /// started.
  void start(const ProcessSpec& spec);
  /// Names of the processes that ended since the last call without being asked to.
  std::vector<ProcessOutcome> newly_dead();
  /// SIGTERM to all, the last started first; SIGKILL to those that have not ended after `grace_s`.
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

/// The last lines of a log file, for telling why a process died.
std::string last_lines(const std::filesystem::path& file, int count);

}  // namespace phantom::phantom_session
