#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace phantom::processes {

/// How long something took, and how much of that was no fault of the process: time in which it, its
/// descendants or the observer were ready to run and the host ran something else.
struct Duration {
  double wall_s = 0.0, waited_for_cpu_s = 0.0;
  double own_s() const { return wall_s - waited_for_cpu_s; }
};

/// One thread of a process, as the kernel shows it.
struct ThreadSeen {
  std::string name;
  bool fifo = false;
  int priority = 0;  ///< real-time priority; 0 without one
};

/// An executable of ours, run as a child.
class RunningProcess {
 public:
  struct Options {
    std::vector<std::string> arguments;
    std::map<std::string, std::string> environment;  ///< beside that of the test
    int output = -1;                                 ///< where standard output and error go; −1: into log()
    bool real_time = true;                           ///< whether it keeps the right to real-time priority
  };
  /// `name`: of the executable. Its files go into `folder`.
  RunningProcess(const std::string& name, const Options& options, const std::filesystem::path& folder);
  /// Kills it if it still runs.
  ~RunningProcess();
  RunningProcess(const RunningProcess&) = delete;
  RunningProcess& operator=(const RunningProcess&) = delete;

  pid_t pid() const { return pid_; }
  bool running();
  /// 128 + n if signal n ended it; −1 while it runs.
  int exit_code() const { return exit_code_; }
  /// Sends the signal and waits for the end, at most `limit_s` of wall time; then kills it.
  Duration end(int signal, double limit_s = 60.0);
  std::string log() const;
  std::vector<ThreadSeen> threads() const;
  /// The thread of that name; 0: none.
  pid_t thread(const std::string& name) const;

 private:
  pid_t pid_ = -1;
  int exit_code_ = -1;
  std::filesystem::path log_;
};

/// The shipped topology of one host, with the page on a free port, in `folder`; every process finds it by
/// --deployment.
std::filesystem::path write_topology(const std::filesystem::path& folder);
/// A configuration of a component, `from` in it replaced.
std::filesystem::path write_config(const std::filesystem::path& folder, const std::string& component,
                                   const std::string& from, const std::string& to);

/// A pipe that nobody reads and that holds no further byte.
class FullPipe {
 public:
  FullPipe();
  ~FullPipe();
  int writer() const { return ends_[1]; }

 private:
  int ends_[2] = {-1, -1};
};

/// The service manager's end of sd_notify.
class NotifySocket {
 public:
  NotifySocket();
  ~NotifySocket();
  const std::string& name() const { return name_; }
  /// What has come since the last call.
  std::vector<std::string> take() const;

 private:
  std::string name_;
  int socket_ = -1;
};

}  // namespace phantom::processes
