#pragma once

#include <sys/types.h>

#include <csignal>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/core/network.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/files.hpp"

namespace phantom::end_to_end {

/// A shipped deployment in a DDS domain (and on userspace CAN buses) of the test's own, run by
/// phantom_session in the background, with the operator's page on a free port. Everything it writes is under
/// folder().
class RunningSystem {
 public:
  /// `seconds`: the session's length once all is ready; 0: until stop(). `topology`: its file's name in
  /// deploy/topologies, without .yaml. `without`: a process that the test runs itself. `changes`: by
  /// component, pieces of its shipped parameters and what they become.
  using Changes = std::map<std::string, std::vector<std::pair<std::string, std::string>>>;
  explicit RunningSystem(double seconds, const std::string& topology = "single_host",
                         const std::string& without = "", Changes changes = {});
  ~RunningSystem();

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path report() const { return folder_ / "report"; }
  core::NetworkOptions network() const;
  /// What phantom_session printed so far.
  std::string output() const;
  /// The process that it started with `word` in its command line; 0: none.
  pid_t process(const std::string& word) const;
  /// Asks it to end; by default as Ctrl-C.
  void stop(int signal = SIGINT);
  /// Waits for its end and returns its exit code.
  int wait();
  bool running();

 private:
  std::filesystem::path folder_;
  int domain_;
  pid_t pid_ = -1;
  int exit_code_ = -1;
};

using phantom::test::eventually;

using test::read_text;

}  // namespace phantom::end_to_end
